//! Energy of a character.

use super::bodies::Bodies;
use super::spatial::SpatialMotion;
use crate::model::Model;

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
    kinetic_energy_at(model, bodies, bodies.velocity.iter(), rates)
}

/// The same where the bodies move with `velocities`.
pub(super) fn kinetic_energy_at(
    model: &Model,
    bodies: &Bodies,
    velocities: impl Iterator<Item = SpatialMotion>,
    rates: &[f64],
) -> f64 {
    let of_bodies: f64 = bodies
        .iter()
        .map(|body| body.inertia)
        .zip(velocities)
        .map(|(inertia, it)| it.dot(inertia.times(it)))
        .sum();
    let of_rotors: f64 = model.armature.iter().zip(rates).map(|(inertia, rate)| inertia * rate * rate).sum();
    0.5 * (of_bodies + of_rotors)
}
