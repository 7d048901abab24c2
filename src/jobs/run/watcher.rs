//! Who watches a run.

use super::prepared::PreparedRun;
use crate::jobs::job::Stage;
use gaitwright_learning::learn::{Checkpoint, Generation};

/// Watches a run.
pub trait RunWatcher {
    /// A stage of the run begins.
    fn stage(&mut self, stage: Stage);
    /// The learning is about to begin.
    fn prepared(&mut self, prepared: &PreparedRun);
    /// A generation has been evaluated.
    fn generation(&mut self, figures: &Generation);
    /// The run can be resumed from here.
    fn checkpoint(&mut self, checkpoint: &Checkpoint);
}

/// Nobody watches.
impl RunWatcher for () {
    fn stage(&mut self, _: Stage) {}
    fn prepared(&mut self, _: &PreparedRun) {}
    fn generation(&mut self, _: &Generation) {}
    fn checkpoint(&mut self, _: &Checkpoint) {}
}
