//! Why a simulation cannot go on.

use super::command::Command;
use super::lcp::SolveStatus;
use super::rows::{RowOwner, Rows};
use super::state::State;
use crate::model::Model;

/// A simulation that cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{cause} at {time} s ({place})")]
pub struct Failure {
    /// Time of the state, s: the beginning of the substep that failed, or its end where a number became non-finite.
    pub time: f64,
    /// The body or joint, or what a row of the complementarity problem belongs to.
    pub place: String,
    /// What happened.
    pub cause: FailureCause,
}

/// What ended a simulation.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FailureCause {
    /// The complementarity problem has no solution, or none that pivoting finds.
    #[error("the complementarity problem has no solution that pivoting could find")]
    NoSolution,
    /// The complementarity problem's lengths or bounds disagree.
    #[error("the complementarity problem is malformed")]
    MalformedProblem,
    /// A number of the complementarity problem is not finite.
    #[error("a number of the complementarity problem is not finite")]
    NonFiniteProblem,
    /// The chosen solver cannot handle the problem's friction.
    #[error("the solver does not handle this problem")]
    UnsupportedProblem,
    /// The mass matrix is singular.
    #[error("nothing resists an acceleration: the mass matrix is singular")]
    SingularMass,
    /// A body needs shorter substeps than the shortest.
    #[error("turns or swings too fast to be followed")]
    TooFast,
    /// A number of the state that a simulation is to go on from is not finite.
    #[error("a number of the state to go on from is not finite")]
    NonFiniteStart,
    /// A number of the command is not finite.
    #[error("a number of the command is not finite")]
    NonFiniteCommand,
    /// A number of the state is not finite, and no row acted.
    #[error("the state became non-finite; no constraint was active")]
    NonFinite,
    /// A number of the state is not finite.
    #[error("the state became non-finite; the largest residual is that of {owner}")]
    NonFiniteWithRows {
        /// What the row with the largest residual belongs to, in words.
        owner: String,
    },
    /// What another engine reports.
    #[error("{0}")]
    OtherEngine(&'static str),
}

/// The failure that goes with a solver's `status` for the problem of `rows`, if its forces cannot be used. It names the row that is not
/// finite, where one is.
pub(super) fn fail_unless_usable(
    status: SolveStatus,
    model: &Model,
    state: &State,
    rows: &Rows,
) -> Result<(), Failure> {
    let cause = match status {
        SolveStatus::Solved | SolveStatus::IterationLimit | SolveStatus::Singular => return Ok(()),
        SolveStatus::Ray => FailureCause::NoSolution,
        SolveStatus::Malformed => FailureCause::MalformedProblem,
        SolveStatus::NotFinite => FailureCause::NonFiniteProblem,
        SolveStatus::Unsupported => FailureCause::UnsupportedProblem,
    };
    let place = match rows.worst() {
        Some(owner) if status == SolveStatus::NotFinite => describe(model, owner),
        _ => format!("character {}", model.character.name),
    };
    Err(Failure { time: state.time, place, cause })
}

/// The failure of `body`, which needs shorter substeps than the shortest.
pub(super) fn too_fast(model: &Model, state: &State, body: usize) -> Failure {
    let place = match body {
        0 => format!("root link {}", model.character.links[0].name),
        _ => format!("body of joint {}", model.joint_names[body - 1]),
    };
    Failure { time: state.time, place, cause: FailureCause::TooFast }
}

/// Fails if a number of `state` is not finite, naming the body.
///
/// # Errors
/// [`Failure`] names the joint's body or the root link.
pub fn check_finite(model: &Model, state: &State) -> Result<(), Failure> {
    check_finite_with(model, state, || None)
}

/// Fails if a number of `state`, from which a simulation is to go on, is not finite, naming the body.
pub(super) fn check_start(model: &Model, state: &State) -> Result<(), Failure> {
    let failure = |place| Failure { time: state.time, place, cause: FailureCause::NonFiniteStart };
    not_finite(model, state).map_or(Ok(()), |place| Err(failure(place)))
}

/// Fails if a number of `command` is not finite, naming the joint. `time` is that of the state, s.
pub(super) fn check_command(model: &Model, command: Command<'_>, time: f64) -> Result<(), Failure> {
    let not_finite = |numbers: &[f64]| numbers.iter().position(|number| !number.is_finite());
    let joint = match command {
        Command::Passive => None,
        Command::Torque(torque) => not_finite(torque),
        Command::Velocity(wanted) => {
            wanted.iter().position(|wanted| wanted.is_some_and(|wanted| !wanted.is_finite()))
        }
        Command::Track { now, next } => not_finite(now).or_else(|| not_finite(next)),
    };
    let Some(joint) = joint else { return Ok(()) };
    let place = format!("joint {}", model.joint_names[joint]);
    Err(Failure { time, place, cause: FailureCause::NonFiniteCommand })
}

/// Fails if a number of `state` is not finite, naming the body and the row with the largest residual.
pub(super) fn check_finite_with(
    model: &Model,
    state: &State,
    worst: impl FnOnce() -> Option<RowOwner>,
) -> Result<(), Failure> {
    let Some(place) = not_finite(model, state) else { return Ok(()) };
    let cause = match worst() {
        None => FailureCause::NonFinite,
        Some(owner) => FailureCause::NonFiniteWithRows { owner: describe(model, owner) },
    };
    Err(Failure { time: state.time, place, cause })
}

/// Which body has a number in `state` that is not finite, in words.
fn not_finite(model: &Model, state: &State) -> Option<String> {
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
    match (root_is_finite, joint) {
        (true, None) => None,
        (_, Some(joint)) => Some(format!("body of joint {}", model.joint_names[joint])),
        (false, None) => Some(format!("root link {}", model.character.links[0].name)),
    }
}

/// A row's owner in words.
fn describe(model: &Model, owner: RowOwner) -> String {
    match owner {
        RowOwner::Contact { link } => format!("a contact of link {}", model.character.links[link].name),
        RowOwner::LowerLimit(joint) | RowOwner::UpperLimit(joint) => {
            format!("the limit of joint {}", model.joint_names[joint])
        }
        RowOwner::DryFriction(joint) => format!("the dry friction of joint {}", model.joint_names[joint]),
        RowOwner::Torque(joint) => format!("the torque limit of joint {}", model.joint_names[joint]),
        RowOwner::Drive(joint) => format!("the drive of joint {}", model.joint_names[joint]),
        RowOwner::Joint(joint) => format!("what holds joint {} together", model.joint_names[joint]),
        RowOwner::Loop(index) => format!("the loop {}", model.character.loops[index].name),
        RowOwner::TrunkLock => format!("the rotation lock of link {}", model.character.links[0].name),
    }
}
