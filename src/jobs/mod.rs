//! Jobs: what is asked for, kept, queued, worked at and left behind.
//!
//! [`Jobs`] is what clients of every kind speak with; [`start()`] puts workers to it; [`run()`] is the way
//! of a job that learns, for the workers and for the command line alike.

mod changes;
mod characters;
mod check;
mod error;
mod figures;
mod files;
mod hearing;
mod housekeeping;
mod job;
mod keeper;
mod lease;
mod live;
mod memory;
mod once;
mod order;
mod places;
mod queue;
mod repertoire;
mod reporter;
mod request;
mod results;
mod retention;
mod run;
mod service;
mod start;
mod store;
mod study;
mod teaching;
mod text;
mod work;
mod worker;

pub use changes::Changes;
pub use check::{Findings, JointFinding, ShapeFinding, Standing, check};
pub use error::ServiceError;
pub use figures::{COUNTERS, HISTOGRAMS, Histogram};
pub use files::{Artefact, Joined, Recorded, Run, Shelf, choose_cryptography};
pub use job::{CharacterName, Job, JobState, JobStorage, MOST_ATTEMPTS, Progress, Stage, Timings};
pub use live::{Live, Moment};
pub use memory::{MemoryEstimate, MemoryShare};
pub use once::{IdempotencyKey, IdempotencyKeyError, Posting};
pub use order::{Order, read_character};
pub use places::{FilesPlace, PlaceError, StorePlace, without_password};
pub use repertoire::{MotionSummary, Repertoire, RepertoireEntry, RepertoireFormat};
pub use request::{CharacterChoice, JobRequest, JobTerms, Priority, PriorityError, Settings};
pub use results::JobFile;
pub use retention::{Expiry, KeptThing, NOTICE, Retention, RetentionError, RetentionOptions, Upkeep};
pub use run::{
    PreparedRun, ReplayError, RunError, RunOutcome, RunTimes, RunWatcher, TrainingReport, Unsuccessful,
    replay, run,
};
pub use service::{JOB_MEMORY, Jobs, LEASE, QUEUE, ServiceOptions, WORKERS};
pub use start::{start, start_workers};
pub use store::{
    Amendment, CharacterDeletion, Claim, Claimed, Holding, QueueRoom, Reclaimed, Store, StoreError,
    StoredCharacter, StoredJob,
};
pub use study::{StudyRequest, USUAL_TOLERANCES};
pub use teaching::{LegFinding, Teaching, TeachingMethod};
pub use work::{EarlierResults, LearningRecord, MotionOutcome, StudyRecord, Work};
