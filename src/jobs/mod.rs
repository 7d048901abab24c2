//! Jobs: what is asked for, kept, queued, worked at and left behind.
//!
//! [`Jobs`] is what clients of every kind speak with; [`start()`] puts workers to it; [`run()`] is the way
//! of a job that learns, for the workers and for the command line alike.

mod characters;
mod check;
mod error;
mod figures;
mod files;
mod job;
mod live;
mod once;
mod order;
mod queue;
mod repertoire;
mod request;
mod results;
mod run;
mod service;
mod store;
mod study;
mod work;
mod worker;

pub use check::{Findings, JointFinding, ShapeFinding, Standing, check};
pub use error::ServiceError;
pub use figures::{COUNTERS, HISTOGRAMS, Histogram};
pub use files::{Artefact, Shelf};
pub use job::{CharacterName, Job, JobState, Progress, Stage, Timings};
pub use live::{Live, Moment};
pub use once::{IdempotencyKey, IdempotencyKeyError};
pub use order::{Order, read_character};
pub use repertoire::{MotionSummary, Repertoire, RepertoireEntry, RepertoireFormat};
pub use request::{CharacterChoice, JobRequest, Settings};
pub use run::{
    PreparedRun, ReplayError, RunError, RunOutcome, RunWatcher, TrainingReport, Unsuccessful, replay, run,
};
pub use service::{Jobs, ServiceOptions};
pub use store::{Store, StoreError};
pub use study::StudyRequest;
pub use work::{LearningRecord, StudyRecord, Work};
pub use worker::start;
