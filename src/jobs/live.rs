//! A running job as others see it: its curve as it grows, and the way to stop it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tokio::sync::watch;

use gaitwright_learning::learn::{Cancel, Generation};

/// How far a running job is; what changes whenever there is something new to see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Moment {
    /// Points of the curve so far.
    pub generations: usize,
    /// The job no longer runs, and its record shows it.
    pub over: bool,
}

/// A running job, shared by its worker and whoever watches it.
#[derive(Debug, Default)]
pub struct Live {
    cancel: Cancel,
    /// Somebody asked for the end of the job, rather than for the end of the service.
    unwanted: AtomicBool,
    curve: Mutex<Vec<Generation>>,
    moment: watch::Sender<Moment>,
}

impl Live {
    /// The flag its learner polls.
    pub fn cancel(&self) -> &Cancel {
        &self.cancel
    }

    /// Stops the job for good.
    pub fn abandon(&self) {
        self.unwanted.store(true, Ordering::Relaxed);
        self.cancel.cancel();
    }

    /// Whether the job was stopped for good.
    pub fn is_abandoned(&self) -> bool {
        self.unwanted.load(Ordering::Relaxed)
    }

    /// Starts from the curve of an earlier run of the same job.
    pub fn preload(&self, curve: Vec<Generation>) {
        self.moment.send_modify(|moment| moment.generations = curve.len());
        *self.curve() = curve;
    }

    /// Adds a point to the curve.
    pub fn push(&self, figures: Generation) {
        let mut curve = self.curve();
        curve.push(figures);
        let generations = curve.len();
        self.moment.send_modify(|moment| moment.generations = generations);
    }

    /// Marks the job as over.
    pub fn finish(&self) {
        self.moment.send_modify(|moment| moment.over = true);
    }

    /// The curve from generation `first` on.
    pub fn curve_from(&self, first: u32) -> Vec<Generation> {
        let curve = self.curve();
        curve[curve.partition_point(|figures| figures.generation < first)..].to_vec()
    }

    /// A watch on what happens next.
    pub fn watch(&self) -> watch::Receiver<Moment> {
        self.moment.subscribe()
    }

    fn curve(&self) -> MutexGuard<'_, Vec<Generation>> {
        // A push cannot leave the curve half-made, so it is whole even if a holder panicked.
        self.curve.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
