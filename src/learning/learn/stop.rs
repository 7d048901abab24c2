//! When and why a learner stops.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::clock::Clock;

/// Asks a learner to stop; it does so within a second. Clones share one state.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<CancelState>);

#[derive(Debug, Default)]
struct CancelState {
    clock: Clock,
    cancelled: AtomicBool,
    /// Somebody has looked since the last [`Cancel::take_looked`].
    looked: AtomicBool,
    tried: AtomicU64,
}

impl Cancel {
    /// For a learner whose time is told by `clock`.
    pub fn of_learner_with(clock: Clock) -> Self {
        Self(Arc::new(CancelState { clock, ..CancelState::default() }))
    }

    /// What tells the learner the time.
    pub(crate) fn clock(&self) -> &Clock {
        &self.0.clock
    }

    /// Asks the learner to stop, from any thread.
    pub fn cancel(&self) {
        self.0.cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the learner has been asked to stop.
    pub fn is_cancelled(&self) -> bool {
        // Looked at all the time by all threads: written only when it changes, it stays in every core's cache.
        if !self.0.looked.load(Ordering::Relaxed) {
            self.0.looked.store(true, Ordering::Relaxed);
        }
        self.0.cancelled.load(Ordering::Relaxed)
    }

    /// The same for who only waits for a learner: it does not count as a look of the learner's own.
    pub fn is_asked_for(&self) -> bool {
        self.0.cancelled.load(Ordering::Relaxed)
    }

    /// Whether anybody has asked [`Cancel::is_cancelled`] since this was asked last: a learner that does not is stuck.
    pub fn take_looked(&self) -> bool {
        self.0.looked.swap(false, Ordering::Relaxed)
    }

    /// How many candidates have been tried since the learner began: a sign of how far it is long before the first
    /// generation is whole.
    pub fn tried(&self) -> u64 {
        self.0.tried.load(Ordering::Relaxed)
    }
}

/// Why a learner stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// All generations of the budget were done.
    Generations,
    /// Every gait that was asked for has been searched for.
    Complete,
    /// The time of the budget was used up.
    Seconds,
    /// It was cancelled.
    Cancelled,
}

/// The conditions on which evaluations break off; none by default.
#[derive(Debug, Clone, Default)]
pub struct Stop {
    cancel: Cancel,
    /// By the clock of `cancel`.
    deadline: Option<Duration>,
}

/// An evaluation was broken off; its generation is discarded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted(pub StopReason);

impl Stop {
    /// On `cancel`, or once `seconds` have passed from now by its clock.
    pub fn new(cancel: &Cancel, seconds: Option<f64>) -> Self {
        let length = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds.max(0.0)).ok());
        Self {
            cancel: cancel.clone(),
            deadline: length.and_then(|length| cancel.clock().now().checked_add(length)),
        }
    }

    /// What tells the time.
    pub(crate) fn clock(&self) -> &Clock {
        self.cancel.clock()
    }

    /// Whether it was cancelled; time may be over without.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// Counts a candidate that has been tried.
    pub fn count(&self) {
        self.cancel.0.tried.fetch_add(1, Ordering::Relaxed);
    }

    /// s that are left, where they are limited.
    pub fn left(&self) -> Option<f64> {
        self.deadline.map(|deadline| deadline.saturating_sub(self.clock().now()).as_secs_f64())
    }

    /// What comes of work that breaks off when this says so, if it did not.
    ///
    /// # Errors
    /// The reason to stop.
    pub fn whole<T>(&self, work: impl FnOnce() -> T) -> Result<T, Interrupted> {
        self.check()?;
        let done = work();
        self.check()?;
        Ok(done)
    }

    /// Whether to continue; called every few milliseconds during all work of the learner.
    ///
    /// # Errors
    /// The reason to stop.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.cancel.is_cancelled() {
            return Err(Interrupted(StopReason::Cancelled));
        }
        match self.deadline {
            Some(deadline) if self.clock().now() >= deadline => Err(Interrupted(StopReason::Seconds)),
            _ => Ok(()),
        }
    }
}
