//! Jobs: what is asked for, kept, queued, worked at and left behind.
//!
//! [`Jobs`] is what clients of every kind speak with; [`start()`] puts workers to it; [`run()`] is the way
//! of a job that learns, for the workers and for the command line alike.

mod check;
mod files;
mod job;
mod live;
mod request;
mod run;
mod service;
mod store;
mod study;
mod work;
mod worker;

pub use check::{Findings, JointFinding, ShapeFinding, Standing, check};
pub use files::Artefact;
pub use job::{CharacterName, Job, Progress, Stage, State, Timings};
pub use live::{Live, Moment};
pub use request::{CharacterChoice, JobRequest, Settings};
pub use run::{
    Order, Outcome, Prepared, ReplayError, Report, RunError, Watcher, read_character, replay, run,
};
pub use service::{Jobs, ServiceError, Setting};
pub use store::{Store, StoreError};
pub use study::StudyRequest;
pub use work::{Learned, Studied, Work};
pub use worker::start;
