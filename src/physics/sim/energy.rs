//! Energy of a character.

use multiversion::multiversion;

use super::bodies::Bodies;
use super::spatial::{SpatialMotion, WideInertia, WideMotion};
use crate::model::Model;
use crate::model::wide::{LANES, Lanes};

/// Energy of a character, J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Kinetic energy of bodies and rotors, J.
    pub kinetic: f64,
    /// Potential energy of gravity, J; zero with the centre of mass at the world's origin.
    pub potential: f64,
}

/// Kinetic energy of the `bodies` of `model` and of the rotors of joints that move at `rates`, J.
pub(super) fn kinetic_energy(model: &Model, bodies: &Bodies, rates: &[f64]) -> f64 {
    let mut of_lanes = [0.0; LANES];
    for (placed, velocities) in bodies.groups.iter().zip(&bodies.velocity.groups).skip(1) {
        add_twice_energies(&placed.inertia, velocities, &mut of_lanes);
    }
    let root = bodies.at(0);
    let of_bodies = root.velocity.dot(root.inertia.times(root.velocity)) + of_lanes.iter().sum::<f64>();
    0.5 * (of_bodies + twice_energy_of_rotors(model, rates))
}

/// The same where the bodies move with `velocities`.
pub(super) fn kinetic_energy_at(
    model: &Model,
    bodies: &Bodies,
    velocities: impl Iterator<Item = SpatialMotion>,
    rates: &[f64],
) -> f64 {
    let twice = |(index, it): (usize, SpatialMotion)| it.dot(bodies.at(index).inertia.times(it));
    let of_bodies: f64 = velocities.enumerate().map(twice).sum();
    0.5 * (of_bodies + twice_energy_of_rotors(model, rates))
}

/// Adds to the lanes of `sums` twice the kinetic energies of bodies of these inertias and velocities, J.
#[multiversion(targets("x86_64+avx2"))]
fn add_twice_energies(inertias: &WideInertia, velocities: &WideMotion, sums: &mut Lanes) {
    for (lane, sum) in sums.iter_mut().enumerate() {
        let velocity = velocities.at(lane);
        *sum += velocity.dot(inertias.at(lane).times(velocity));
    }
}

/// Twice the kinetic energy of the rotors of joints that move at `rates`, J.
fn twice_energy_of_rotors(model: &Model, rates: &[f64]) -> f64 {
    model.armature.iter().zip(rates).map(|(inertia, rate)| inertia * rate * rate).sum()
}
