//! What accuracy costs in computing time: settings compared on one problem, and the one to be recommended.
//!
//! An [`AccuracyProblem`] is a set of pieces of a simulation whose true ends are known: of a closed-form scene
//! ([`scenes`]) from its exact solution, of any other scenario ([`reference()`]) from a far finer simulation of the
//! same pieces. A [`Sweep`] lists the settings that are tried on it, by this simulator and by rapier3d ([`rapier`]).
//! [`study()`] tries them and fills a [`Table`]: the figures of every setting, the front of those that no other beats,
//! and the one to take for a tolerance ([`Table::recommend`]). [`settle`] chooses settings for a simulation or a job
//! that asks for a tolerance. The [`catalogue`] holds hard cases and the bounds that must hold in them.

pub mod catalogue;
mod choice;
mod csv_text;
mod engine;
mod fault;
mod figures;
mod front;
mod measure;
mod problem;
pub mod rapier;
mod recommendation;
mod reference;
mod row;
pub mod scenes;
mod settings;
mod spread;
mod stepper;
mod study;
mod sweep;
mod table;
mod trial;
mod truth;

pub use choice::{AccuracyCheck, check, prepare, prepare_until, settle, swaying};
pub use engine::Engine;
pub use fault::{Divergence, LeftOutReason, StudyError};
pub use figures::{Figures, TrialOutcome};
pub use measure::{Measure, displacement};
pub use problem::{AccuracyProblem, Piece};
pub use recommendation::Recommendation;
pub use reference::{Pieces, reference};
pub use row::{RowStatus, TableRow};
pub use settings::TrialSettings;
pub use spread::ErrorSpread;
pub use study::{StudyObserver, study};
pub use sweep::{Method, Series, Sweep};
pub use table::{StudySubject, Table, TableFormat};
pub use truth::{OtherTruth, Truth};
