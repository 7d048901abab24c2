//! The observer of a learner.

use super::behaviour::Behaviour;
use super::checkpoint::Checkpoint;
use super::generation::Generation;

/// Observes a learner; called from its coordinating thread only, in order.
pub trait Observer {
    /// A generation has ended.
    fn generation(&mut self, figures: &Generation);
    /// There is a new best behaviour, which passed the continuous check.
    fn improved(&mut self, best: &Behaviour);
    /// There is a state from which the same job can be resumed to the same result.
    fn checkpoint(&mut self, checkpoint: &Checkpoint);
}
