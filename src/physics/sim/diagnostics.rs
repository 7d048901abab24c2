//! Quantities of a state: energy, momentum, poses, joint separation.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::bodies::Bodies;
use super::coordinates::{maximal, reduced};
use super::energy::{Energy, kinetic_energy};
use super::momentum::{Composite, Momentum};
use super::rows::joint::Coupling;
use super::spatial::SpatialMotion;
use super::state::State;
use crate::model::Model;
use crate::scene::StepPlan;

fn placed(model: &Model, state: &State) -> Bodies {
    let mut bodies = Bodies::new(model);
    if state.body_states.is_empty() {
        reduced::kinematics::place(model, state, &mut bodies);
    } else {
        maximal::kinematics::place(model, state, &mut bodies);
    }
    bodies
}

/// Greatest distance (m) or angle (rad) by which the two bodies of a joint or of a closed loop are apart.
/// Only loops can come apart in reduced coordinates.
pub fn joint_separation(model: &Model, state: &State) -> f64 {
    let joints = if state.body_states.is_empty() { 0 } else { model.joint_count() };
    if joints == 0 && model.loops.is_empty() {
        return 0.0;
    }
    let bodies = placed(model, state);
    let tree = (0..joints).map(|joint| Coupling::of_joint(model, &bodies, joint));
    let loops = (0..model.loops.len()).map(|index| Coupling::of_loop(model, &bodies, index));
    tree.chain(loops).map(|coupling| coupling.separation()).fold(0.0, f64::max)
}

/// Centre of mass of `model` in `state`, world frame, m.
pub fn center_of_mass(model: &Model, state: &State) -> Point3<f64> {
    state.root.position + first_moment(&placed(model, state)) / model.mass
}

/// World frames of the character's links in `state`, in their order.
pub fn link_poses(model: &Model, state: &State) -> Vec<Isometry3<f64>> {
    let bodies = placed(model, state);
    let frame = |index: usize| {
        let body = bodies.at(index);
        let origin = state.root.position.coords + body.origin;
        let rotation = Rotation3::from_matrix_unchecked(body.rotation);
        Isometry3::from_parts(Translation3::from(origin), UnitQuaternion::from_rotation_matrix(&rotation))
    };
    let frames: Vec<Isometry3<f64>> = (0..bodies.len()).map(frame).collect();
    model.links.iter().map(|place| frames[place.body] * place.pose).collect()
}

/// Energy of `model` in `state` under the gravity of `plan`. The rotors' share (armature) is included.
pub fn energy(model: &Model, plan: &StepPlan, state: &State) -> Energy {
    let bodies = placed(model, state);
    let first = first_moment(&bodies) + state.root.position.coords * model.mass;
    Energy {
        kinetic: kinetic_energy(model, &bodies, &state.velocities),
        potential: -plan.gravity.dot(&first),
    }
}

/// Momentum of `model` in `state`.
pub fn momentum(model: &Model, state: &State) -> Momentum {
    // Of these bodies the root moves already.
    Composite::new(&placed(model, state)).momentum(SpatialMotion::ZERO)
}

/// The sum of mass times centre of mass of all `bodies`, about the common point, kg m.
fn first_moment(bodies: &Bodies) -> Vector3<f64> {
    (0..bodies.len()).map(|index| bodies.at(index).inertia.first_moment).sum()
}
