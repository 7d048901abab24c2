//! Why a simulation cannot go on.

use super::lcp::Status;
use super::rows::Owner;
use super::state::State;
use crate::model::Model;

/// A simulation that cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{cause} at {time} s ({place})")]
pub struct Failure {
    /// End of the step that failed, s.
    pub time: f64,
    /// The body or joint.
    pub place: String,
    /// What happened.
    pub cause: String,
}

/// The failure that goes with a solver's `status`, if its forces cannot be used.
pub(super) fn fail_unless_usable(status: Status, model: &Model, state: &State) -> Result<(), Failure> {
    let cause = match status {
        Status::Solved | Status::IterationLimit | Status::Singular => return Ok(()),
        Status::Ray => "the complementarity problem has no solution that pivoting could find",
        Status::Malformed => "the complementarity problem is malformed",
        Status::NotFinite => "a number of the complementarity problem is not finite",
        Status::Unsupported => "the solver does not handle this problem",
    };
    Err(Failure {
        time: state.time,
        place: format!("character {}", model.character.name),
        cause: cause.into(),
    })
}

pub(super) fn too_fast(model: &Model, state: &State, body: usize) -> Failure {
    let place = match body {
        0 => format!("root link {}", model.character.links[0].name),
        _ => format!("body of joint {}", model.joint_names[body - 1]),
    };
    Failure { time: state.time, place, cause: "turns or swings too fast to be followed".into() }
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
