//! The best of a niche so far, and what is known of it.

use std::cmp::Reverse;

use gaitwright_physics::motion::Trial;

use crate::program::refine::Candidate;
use crate::program::ring::Wanted;

/// A candidate and what it is to be.
#[derive(Clone)]
pub(super) struct Found {
    pub(super) wanted: Wanted,
    pub(super) candidate: Candidate,
    /// Whether it was found natural in a continuous simulation.
    pub(super) natural: bool,
    /// What was left of it in the trials, where it is natural and there was time for all of them.
    pub(super) trials: Vec<Trial>,
}

impl Found {
    /// Whether it is natural, and how few trials it failed: the more, the better.
    pub(super) fn proof(&self) -> (bool, Reverse<usize>) {
        (self.natural, Reverse(self.trials.len() - kept(&self.trials)))
    }

    /// Whether it is natural and kept every trial.
    pub(super) fn is_proven(&self) -> bool {
        self.proof() == (true, Reverse(0))
    }

    /// Whether it is worth more than `other`, which was found in the same way.
    pub(super) fn beats(&self, other: &Self) -> bool {
        let (own, others) = (self.proof(), other.proof());
        own > others || (own == others && self.candidate.cost < other.candidate.cost)
    }
}

/// In how many trials a motion stayed up and went on.
pub(super) fn kept(trials: &[Trial]) -> usize {
    trials.iter().filter(|trial| trial.kept()).count()
}
