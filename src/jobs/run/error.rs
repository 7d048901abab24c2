//! Why a run, or the replay of a motion, could not be brought to its end.

use crate::export::{DiagramError, RecordingError};
use crate::jobs::store::StoreError;
use gaitwright_learning::accuracy::StudyError;
use gaitwright_learning::learn::LearnError;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::sim::Failure;

/// Why a run could not be brought to its end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The character, or what is wanted of it, is impossible.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The simulation that settings are compared with broke off.
    #[error(transparent)]
    Study(StudyError),
    /// A file could not be written.
    #[error("a file could not be written: {0}")]
    File(#[from] std::io::Error),
    /// The recording could not be written.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The gait diagram could not be drawn.
    #[error(transparent)]
    Diagram(#[from] DiagramError),
    /// The learner's threads could not be started.
    #[error("the learner could not be started: {0}")]
    Threads(LearnError),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl RunError {
    /// Whether it is about what is stored rather than about the job.
    pub fn is_about_storage(&self) -> bool {
        matches!(self, Self::File(_) | Self::Recording(_) | Self::Store(_))
    }
}

impl From<StudyError> for RunError {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Input(error) => Self::Input(error),
            error => Self::Study(error),
        }
    }
}

impl From<LearnError> for RunError {
    fn from(error: LearnError) -> Self {
        match error {
            LearnError::Input(error) => Self::Input(error),
            error @ LearnError::Threads(_) => Self::Threads(error),
        }
    }
}

/// Why the gait of a motion could not be measured.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The motion is not of this character, or its scene cannot be simulated.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The simulation could not go on.
    #[error("the simulation of the motion broke off: {0}")]
    BrokenOff(Failure),
    /// The character fell too early, s.
    #[error("the character fell after {0:.3} s, before it had gone round its loop once")]
    Fallen(f64),
}
