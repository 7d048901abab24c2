//! What accuracy costs in computing time: settings compared on one problem, and the one to be recommended.
//!
//! A [`Problem`] is a set of pieces of a simulation whose true ends are known: of a closed-form scene
//! ([`scenes`]) from its exact solution, of anybody's scenario ([`reference()`]) from a far finer simulation of
//! the same pieces. A [`Sweep`] says which settings are tried on it, a [`Table`] holds what came of each, its
//! front and what it recommends for a tolerance ([`Table::recommend`]). [`study()`] is the way from the one to
//! the other. [`settle`] chooses settings for a simulation or a job that asks for a tolerance. The
//! [`catalogue`] holds the hard cases and the bounds that must hold in them.

pub mod catalogue;
mod choice;
mod engine;
mod fault;
mod front;
mod measure;
mod problem;
pub mod rapier;
mod reference;
pub mod scenes;
mod study;
mod sweep;
mod table;
mod trial;

pub use choice::{prepare, prepare_until, settle, swaying};
pub use fault::StudyError;
pub use front::Recommendation;
pub use measure::{Measure, displacement};
pub use problem::{Piece, Problem};
pub use reference::{Pieces, reference};
pub use study::{Watcher, study};
pub use sweep::{Method, Point, Series, Sweep};
pub use table::{Engine, Row, Status, Subject, Table, TableFormat, Truth};
pub use trial::{Figures, Outcome};
