//! What the niches of a training share: where candidates are tried, and how far the training is.

use std::time::Duration;

use rayon::ThreadPool;

use super::checkpoint::Milestone;
use super::motion::LearnedMotion;
use super::observer::TrainingObserver;
use crate::learn::{Clock, Generation, LearningSetup, Stop, StopReason};
use crate::program::rollout::Arena;
use crate::program::subject::Subject;

/// What does not change during the search.
pub(super) struct Shared<'a> {
    pub(super) setup: &'a LearningSetup,
    pub(super) subject: &'a Subject,
    /// At the step that was asked for.
    pub(super) fine: Arena,
    /// At a longer one, which ranks nearly as well in half the time.
    pub(super) coarse: Arena,
    pub(super) pool: ThreadPool,
    pub(super) stop: Stop,
}

impl Shared<'_> {
    /// What of the budget is used up, if anything is.
    pub(super) fn used_up(&self, progress: &Progress) -> Option<StopReason> {
        let most = self.setup.parameters.budget.generations();
        let all = most.is_some_and(|most| progress.curve.len() >= most as usize);
        if progress.hurried { Some(StopReason::Seconds) } else { all.then_some(StopReason::Generations) }
    }
}

/// What changes.
pub(super) struct Progress {
    /// Motions shown, in order.
    pub(super) milestones: Vec<Milestone>,
    pub(super) curve: Vec<Generation>,
    /// Simulated time of all niches, s.
    pub(super) simulated: f64,
    /// A search was cut short for want of time, so that it could be ended properly.
    pub(super) hurried: bool,
    /// The clock decided what was searched for, though everything was.
    pub(super) by_the_clock: bool,
    clock: Clock,
    /// What the clock showed when this run began.
    started: Duration,
    /// Time spent before this run was resumed, s.
    pub(super) spent: f64,
}

impl Progress {
    /// Of a run that begins.
    pub(super) fn new(clock: &Clock) -> Self {
        Self::resumed(clock, Vec::new(), Vec::new(), 0.0, (0.0, false))
    }

    /// How far an earlier run had come.
    pub(super) fn resumed(
        clock: &Clock,
        milestones: Vec<Milestone>,
        curve: Vec<Generation>,
        simulated: f64,
        (spent, by_the_clock): (f64, bool),
    ) -> Self {
        let clock = clock.clone();
        let started = clock.now();
        Self { milestones, curve, simulated, hurried: false, by_the_clock, clock, started, spent }
    }

    /// s since the start of the training.
    pub(super) fn elapsed(&self) -> f64 {
        self.spent + self.clock.since(self.started)
    }

    /// Shows a motion and keeps it.
    pub(super) fn show(
        &mut self,
        motion: LearnedMotion,
        finished: bool,
        observer: &mut dyn TrainingObserver,
    ) {
        if finished {
            observer.finished(&motion);
        } else {
            observer.improved(&motion);
        }
        self.milestones.push(Milestone { motion, finished });
    }
}
