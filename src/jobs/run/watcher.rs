//! Who watches a run.

use std::time::Duration;

use super::prepared::PreparedRun;
use crate::jobs::job::Stage;
use crate::jobs::live::OnTheWay;
use crate::jobs::repertoire::RepertoireEntry;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::learn::Generation;
use gaitwright_learning::training::{LearnedMotion, TrainingCheckpoint};

/// What the wall clock's time since the learning began was spent on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunTimes {
    /// Learning.
    pub learning: Duration,
    /// Checking and recording motions, also between two generations, and writing the results.
    pub checking: Duration,
}

/// Watches a run.
pub trait RunWatcher {
    /// A stage of the run begins.
    fn stage(&mut self, stage: Stage);
    /// The learning is about to begin.
    fn prepared(&mut self, prepared: &PreparedRun);
    /// A generation has been evaluated.
    fn generation(&mut self, figures: &Generation);
    /// There is a motion better than those before it, with this gait, on the way to the one that is wanted; the recording shows it.
    fn improved(&mut self, _motion: &LearnedMotion, _gait: &GaitReport) {}
    /// What there is so far of results that no file holds yet; told whenever a motion is better than those before it or finished.
    fn on_the_way(&mut self, _files: OnTheWay) {}
    /// A motion has been finished and checked.
    fn learned(&mut self, entry: &RepertoireEntry);
    /// The run can be resumed from here.
    fn checkpoint(&mut self, checkpoint: &TrainingCheckpoint);
    /// What the time was spent on so far; told with every generation, after every check and at the end.
    fn spent(&mut self, _times: RunTimes) {}
    /// Whether the folder has passed to somebody else, so that nothing may be written into it any more.
    fn is_lost(&self) -> bool {
        false
    }
}

/// Nobody watches.
impl RunWatcher for () {
    fn stage(&mut self, _: Stage) {}
    fn prepared(&mut self, _: &PreparedRun) {}
    fn generation(&mut self, _: &Generation) {}
    fn learned(&mut self, _: &RepertoireEntry) {}
    fn checkpoint(&mut self, _: &TrainingCheckpoint) {}
}
