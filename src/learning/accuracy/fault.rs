//! Why there is no study, and why a setting has no figures.

use super::rapier::Unsupported;
use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::sim::Failure;

/// Why a study, or a choice of settings that rests on one, could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// The request is impossible; its faults have JSON pointers into the scenario.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Even the finest simulation of the scenario breaks off before its end.
    #[error("the finest simulation, which others are compared with, broke off: {0}")]
    BrokenOff(#[from] Failure),
}

/// Why a trial broke off or its simulation cannot be compared with the truth any more.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Divergence {
    /// A step failed.
    #[error("{0}")]
    Failed(#[from] Failure),
    /// The error at a mark is not finite or beyond 100 m or rad, which is no inaccuracy any more.
    #[error("off by {error:.3e} {unit} at {time} s")]
    Lost {
        /// The error, in `unit`.
        error: f64,
        /// Unit of the problem's measure of error.
        unit: &'static str,
        /// Time of the mark in the whole simulation, s.
        time: f64,
    },
    /// The engine cannot start from a state at which a piece begins.
    #[error("{0}")]
    NoRestart(#[from] Unsupported),
}

/// Why a setting was not tried on a problem, or not to the end.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LeftOutReason {
    /// The method changes the feedforward of a drive that has no targets.
    #[error("no joint is driven toward a target")]
    NoTargets,
    /// The method changes the coordinates of a character without joints.
    #[error("the character has no joints: both coordinates are the same")]
    NoJoints,
    /// The method changes the friction cone where there is no friction.
    #[error("nothing here has friction")]
    NoFriction,
    /// The method changes the solver where no complementarity problem has to be solved.
    #[error("neither contact nor limits: there is nothing to solve")]
    NothingToSolve,
    /// The method's settings contradict each other.
    #[error("{}", reasons(.0))]
    Settings(Vec<Fault>),
    /// The scene cannot be simulated with these settings.
    #[error("{0}")]
    Plan(InputError),
    /// The engine compared with lacks something that the scene asks for.
    #[error("{0}")]
    Unsupported(#[from] Unsupported),
    /// The variant of the scenario that the method simulates has no reference.
    #[error("{0}")]
    NoReference(StudyError),
    /// The trial would take too long; the number is the greatest rate of evaluations that is allowed, 1/s.
    #[error("takes more than {0} evaluations a second")]
    TooCostly(u64),
}

fn reasons(faults: &[Fault]) -> String {
    faults.iter().map(|fault| fault.reason.as_str()).collect::<Vec<_>>().join("; ")
}
