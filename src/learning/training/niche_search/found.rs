//! The best of a niche so far, and what is known of it.

use std::cmp::Reverse;

use gaitwright_physics::motion::Trial;

use crate::program::candidate::Candidate;
use crate::program::ring::Wanted;
use crate::program::subject::Subject;

/// A candidate and what it is to be.
#[derive(Clone)]
pub(super) struct Found {
    pub(super) wanted: Wanted,
    pub(super) candidate: Candidate,
    /// Whether it was found natural in a continuous simulation.
    pub(super) natural: bool,
    /// Whether it stayed up in that simulation; `None` where there was none.
    pub(super) stood: Option<bool>,
    /// What was left of it in the trials; `None` where there were none, or no time for all of them.
    pub(super) trials: Option<Vec<Trial>>,
}

/// What is known of a motion, from the least to the most.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Proof {
    /// It did not stay up when it was judged.
    Fallen,
    /// It is not natural, or not known to be.
    Unnatural,
    /// It is natural, and its trials were not made to their end.
    Untried,
    /// It is natural and failed so many trials, the fewer the better.
    Tried(Reverse<usize>),
}

impl Proof {
    pub(super) const ALL_TRIALS_KEPT: Self = Self::Tried(Reverse(0));

    /// Of a natural motion.
    pub(super) fn of(trials: Option<&[Trial]>) -> Self {
        let failed = |trials: &[Trial]| trials.iter().filter(|trial| !trial.kept()).count();
        trials.map_or(Self::Untried, |trials| Self::Tried(Reverse(failed(trials))))
    }
}

impl Found {
    pub(super) fn proof(&self) -> Proof {
        match (self.natural, self.stood) {
            (true, _) => Proof::of(self.trials.as_deref()),
            (false, Some(false)) => Proof::Fallen,
            (false, _) => Proof::Unnatural,
        }
    }

    /// Whether it did not stay up when it was judged or in one of its trials.
    pub(super) fn falls(&self) -> bool {
        let falls_in_a_trial = |trials: &Vec<Trial>| trials.iter().any(|trial| !trial.stood());
        self.stood == Some(false) || self.trials.as_ref().is_some_and(falls_in_a_trial)
    }

    /// Whether it is worth more than `other`.
    pub(super) fn beats(&self, other: &Self, subject: &Subject) -> bool {
        // Searches differ in how strict they are and in whether a drift is still to be mended.
        let cost = |found: &Self| found.candidate.cost_as(subject, &found.wanted.as_it_goes().strictly());
        let (own, others) = (self.proof(), other.proof());
        own > others || (own == others && cost(self) < cost(other))
    }
}
