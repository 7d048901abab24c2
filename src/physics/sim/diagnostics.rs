//! What a state amounts to: energy, momentum, poses, and whether its numbers are finite.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::reduced::kinematics::{BodyMotion, place};
use super::rows::Owner;
use super::rows::joint::Coupling;
use super::state::State;
use super::{Failure, maximal};
use crate::model::Model;
use crate::scene::StepPlan;

/// Energy of a character, J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Of motion.
    pub kinetic: f64,
    /// Of height: zero with the centre of mass at the world's origin.
    pub potential: f64,
}

/// Momentum of a character in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Momentum {
    /// kg m/s.
    pub linear: Vector3<f64>,
    /// About the centre of mass, kg m²/s.
    pub angular: Vector3<f64>,
}

fn placed(model: &Model, state: &State) -> Vec<BodyMotion> {
    let mut bodies = vec![BodyMotion::REST; model.bodies.len()];
    if state.parts.is_empty() {
        place(model, state, &mut bodies);
    } else {
        maximal::kinematics::place(model, state, &mut bodies);
    }
    bodies
}

/// Greatest distance (m) or angle (rad) by which the two bodies of a joint or of a closed loop are apart.
/// Only loops can come apart in reduced coordinates.
pub fn joint_separation(model: &Model, state: &State) -> f64 {
    let joints = if state.parts.is_empty() { 0 } else { model.joint_count() };
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
    let sum: Vector3<f64> = placed(model, state).iter().map(|body| body.inertia.first_moment).sum();
    state.root.position + sum / model.mass
}

/// World frames of the character's links in `state`, in their order.
pub fn link_poses(model: &Model, state: &State) -> Vec<Isometry3<f64>> {
    let frames: Vec<Isometry3<f64>> = placed(model, state)
        .iter()
        .map(|body| {
            let origin = state.root.position.coords + body.origin;
            let rotation = UnitQuaternion::from_matrix(&body.rotation);
            Isometry3::from_parts(Translation3::from(origin), rotation)
        })
        .collect();
    model.links.iter().map(|place| frames[place.body] * place.pose).collect()
}

/// Energy of `model` in `state` under the gravity of `plan`. The rotors' share (armature) is included.
pub fn energy(model: &Model, plan: &StepPlan, state: &State) -> Energy {
    let bodies = placed(model, state);
    let first: Vector3<f64> = bodies.iter().map(|body| body.inertia.first_moment).sum();
    let first = first + state.root.position.coords * model.mass;
    Energy {
        kinetic: kinetic_energy(model, &bodies, &state.velocities),
        potential: -plan.gravity.dot(&first),
    }
}

/// Kinetic energy of the `bodies` of `model` and of the rotors of joints that move at `rates`, J.
pub(super) fn kinetic_energy(model: &Model, bodies: &[BodyMotion], rates: &[f64]) -> f64 {
    let of_bodies: f64 = bodies.iter().map(|body| body.velocity.dot(body.inertia.times(body.velocity))).sum();
    let of_rotors: f64 = model.armature.iter().zip(rates).map(|(inertia, rate)| inertia * rate * rate).sum();
    0.5 * (of_bodies + of_rotors)
}

/// Momentum of `model` in `state`.
pub fn momentum(model: &Model, state: &State) -> Momentum {
    let bodies = placed(model, state);
    let mut linear = Vector3::zeros();
    let mut about_root = Vector3::zeros();
    let mut first = Vector3::zeros();
    for body in &bodies {
        let momentum = body.inertia.times(body.velocity);
        linear += momentum.force;
        about_root += momentum.moment;
        first += body.inertia.first_moment;
    }
    Momentum { linear, angular: about_root - (first / model.mass).cross(&linear) }
}

/// Fails if a number of `state` is not finite, naming the body.
///
/// # Errors
/// [`Failure`] names the joint's body or the root link.
pub fn check_finite(model: &Model, state: &State) -> Result<(), Failure> {
    check_finite_with(model, state, || None)
}

/// Fails if a number of `state` is not finite, naming the body and the row with the largest residual.
pub(super) fn check_finite_with(
    model: &Model,
    state: &State,
    worst: impl FnOnce() -> Option<Owner>,
) -> Result<(), Failure> {
    let root = &state.root;
    let root_is_finite = root.position.coords.sum().is_finite()
        && root.orientation.coords.sum().is_finite()
        && root.linear_velocity.sum().is_finite()
        && root.angular_velocity.sum().is_finite();
    let joint = state
        .angles
        .iter()
        .zip(&state.velocities)
        .position(|(angle, velocity)| !(angle.is_finite() && velocity.is_finite()));
    let place = match (root_is_finite, joint) {
        (true, None) => return Ok(()),
        (_, Some(joint)) => format!("body of joint {}", model.joint_names[joint]),
        (false, None) => format!("root link {}", model.character.links[0].name),
    };
    let cause = match worst() {
        None => "the state became non-finite; no constraint was active".to_owned(),
        Some(owner) => {
            format!("the state became non-finite; the largest residual is that of {}", describe(model, owner))
        }
    };
    Err(Failure { time: state.time, place, cause })
}

/// A row's owner in words.
fn describe(model: &Model, owner: Owner) -> String {
    match owner {
        Owner::Contact { link } => format!("a contact of link {}", model.character.links[link].name),
        Owner::LowerLimit(joint) | Owner::UpperLimit(joint) => {
            format!("the limit of joint {}", model.joint_names[joint])
        }
        Owner::DryFriction(joint) => format!("the dry friction of joint {}", model.joint_names[joint]),
        Owner::Torque(joint) => format!("the torque limit of joint {}", model.joint_names[joint]),
        Owner::Drive(joint) => format!("the drive of joint {}", model.joint_names[joint]),
        Owner::Joint(joint) => format!("what holds joint {} together", model.joint_names[joint]),
        Owner::Loop(index) => format!("the loop {}", model.character.loops[index].name),
        Owner::TrunkLock => format!("the rotation lock of link {}", model.character.links[0].name),
    }
}
