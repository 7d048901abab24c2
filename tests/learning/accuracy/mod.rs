//! The price of accuracy: solutions, measures, sweeps, tables, recommendations, and the command.

mod choices;
mod measures;
mod solutions;
mod studies;
mod tables;

use gaitwright_learning::accuracy::StudyObserver;

/// Never ends a study.
pub struct Unwatched;

impl StudyObserver for Unwatched {
    fn progress(&mut self, _: usize, _: usize, _: &str) {}

    fn stop(&self) -> bool {
        false
    }
}
