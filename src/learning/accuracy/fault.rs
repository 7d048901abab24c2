//! Why there is no study.

use gaitwright_physics::fault::InputError;
use gaitwright_physics::sim::Failure;

/// Why a study, or a choice of settings that rests on one, could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StudyError {
    /// What was asked for is impossible.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The scenario cannot be simulated to its end, however finely.
    #[error("the finest simulation, which others are compared with, broke off: {0}")]
    BrokenOff(Failure),
}
