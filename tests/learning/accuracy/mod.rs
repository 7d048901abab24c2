//! The price of accuracy: solutions, measures, sweeps, tables, recommendations, and the command.

mod choices;
mod measures;
mod solutions;
mod studies;
mod tables;

use gaitwright_learning::accuracy::Watcher;

/// Never ends a study.
pub struct Unwatched;

impl Watcher for Unwatched {
    fn progress(&mut self, _: usize, _: usize, _: &str) {}

    fn stop(&self) -> bool {
        false
    }
}
