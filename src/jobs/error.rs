//! Why a question to the service could not be answered.

use std::io;
use std::time::Duration;

use uuid::Uuid;

use super::job::JobState;
use super::store::StoreError;
use gaitwright_physics::fault::InputError;

/// Why a question could not be answered.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The input cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// There is no job of this id.
    #[error("there is no job {0}")]
    UnknownJob(Uuid),
    /// There is no character of this id.
    #[error("there is no character {0}")]
    UnknownCharacter(Uuid),
    /// A job that has not ended was posted with the character.
    #[error("the character {id} is needed by the job {job}, which has not ended")]
    CharacterNeeded {
        /// The character.
        id: Uuid,
        /// The job.
        job: Uuid,
    },
    /// The job is not in a state for what was asked.
    #[error("the job {id} is {}; {needs}", state.name())]
    WrongState {
        /// The job.
        id: Uuid,
        /// Where it stands.
        state: JobState,
        /// Which jobs it can be asked of.
        needs: &'static str,
    },
    /// The key of the request has come before with another request.
    #[error("the idempotency key has been used for another request")]
    KeyReused,
    /// As many jobs wait as may wait.
    #[error("{0} jobs are waiting already")]
    Full(u64),
    /// As many jobs of the caller wait as may wait.
    #[error("{0} jobs of this caller are waiting already")]
    FullForCaller(u64),
    /// As much is computed as may be at once.
    #[error("as much is being computed as may be at once")]
    Busy,
    /// Nobody waits for the answer any more.
    #[error("the answer was given up")]
    GivenUp,
    /// The service is about to end.
    #[error("the service is shutting down")]
    ShuttingDown,
    /// Workers have ended although the service has not.
    #[error("{alive} of {workers} workers are left")]
    Unmanned {
        /// Workers that are left.
        alive: usize,
        /// Workers that there should be.
        workers: usize,
    },
    /// Where jobs and files are kept does not answer.
    #[error("the store, or where the files are, has not answered within {} s", .0.as_secs())]
    Silent(Duration),
    /// The store failed.
    #[error(transparent)]
    Store(StoreError),
    /// A file could not be read or written.
    #[error("a file failed: {0}")]
    File(#[from] io::Error),
    /// Computing the answer broke off.
    #[error("computing the answer broke off: {0}")]
    Broken(#[from] tokio::task::JoinError),
}

impl From<StoreError> for ServiceError {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Full(waiting) => Self::Full(waiting),
            StoreError::FullForCaller(waiting) => Self::FullForCaller(waiting),
            error => Self::Store(error),
        }
    }
}
