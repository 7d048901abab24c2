//! Who watches a learner, and how it is stopped.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Behaviour, Checkpoint};

/// Figures of one generation; one point of the learning curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Generation {
    /// From 0.
    pub generation: u32,
    /// Fitness of the best behaviour so far, m/s along the task's direction less its costs; until one
    /// has passed the continuous check, that of the best individual of this generation.
    pub best: f64,
    /// Mean fitness of the populations.
    pub mean: f64,
    /// Standard deviation of the populations' fitness.
    pub spread: f64,
    /// Share of the transitions asked for so far that came from the cache, 0 to 1.
    pub cache_hit_rate: f64,
    /// Simulated seconds so far.
    pub simulated_seconds: f64,
    /// Simulated seconds saved so far by the cache.
    pub saved_seconds: f64,
    /// s of the wall clock since the start (not part of any result).
    pub elapsed: f64,
}

/// Watches a learner; called from its coordinating thread only, in order.
pub trait Observer {
    /// A generation has ended.
    fn generation(&mut self, figures: &Generation);
    /// A new best behaviour, which stayed upright through the continuous check.
    fn improved(&mut self, best: &Behaviour);
    /// A state from which the same job can be resumed to the same result.
    fn checkpoint(&mut self, checkpoint: &Checkpoint);
}

/// Asks a learner to stop; it does within a second.
#[derive(Debug, Clone, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Asks for it, from any thread.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether it was asked for.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Why a learner stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// All generations were done.
    Generations,
    /// The time was over.
    Seconds,
    /// It was cancelled.
    Cancelled,
}

/// When evaluations have to break off.
#[derive(Debug, Clone)]
pub struct Stop {
    cancel: Cancel,
    deadline: Option<Instant>,
}

/// An evaluation was broken off; its generation is discarded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Interrupted(pub StopReason);

impl Stop {
    /// On `cancel`, or once `seconds` of the wall clock have passed from now.
    pub fn new(cancel: &Cancel, seconds: Option<f64>) -> Self {
        let length = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds.max(0.0)).ok());
        Self {
            cancel: cancel.clone(),
            deadline: length.and_then(|length| Instant::now().checked_add(length)),
        }
    }

    /// Says whether to go on; asked every few milliseconds, whatever the learner is about.
    ///
    /// # Errors
    /// The reason to stop.
    pub fn check(&self) -> Result<(), Interrupted> {
        if self.cancel.is_cancelled() {
            return Err(Interrupted(StopReason::Cancelled));
        }
        match self.deadline {
            Some(deadline) if Instant::now() >= deadline => Err(Interrupted(StopReason::Seconds)),
            _ => Ok(()),
        }
    }
}
