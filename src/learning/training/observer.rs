//! The observer of a training.

use super::checkpoint::TrainingCheckpoint;
use super::motion::LearnedMotion;
use crate::learn::Generation;

/// Observes a training; called from its coordinating thread only, in order.
pub trait TrainingObserver {
    /// A generation has ended.
    fn generation(&mut self, figures: &Generation);
    /// There is a motion better than those before it, on the way to the one that is wanted.
    fn improved(&mut self, motion: &LearnedMotion);
    /// A motion is as it will be.
    fn finished(&mut self, motion: &LearnedMotion);
    /// There is a state from which the same training can be resumed to the same result.
    fn checkpoint(&mut self, checkpoint: &TrainingCheckpoint);
}
