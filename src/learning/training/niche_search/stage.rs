//! One speed of a niche.

use super::found::Found;
use crate::program::candidate::Candidate;
use crate::program::cost::HOLDS;
use crate::program::refine::Refinement;
use crate::program::ring::Wanted;

/// A refinement at one speed.
pub(super) struct Stage {
    pub(super) wanted: Wanted,
    pub(super) refinement: Refinement,
}

impl Stage {
    pub(super) fn best(&self) -> &Candidate {
        self.refinement.best()
    }

    pub(super) fn holds(&self) -> bool {
        self.best().cost < HOLDS
    }

    pub(super) fn found(&self) -> Found {
        let (wanted, candidate) = (self.wanted.clone(), self.best().clone());
        Found { wanted, candidate, natural: false, stood: None, trials: None }
    }

    /// Whether it does what is wanted for less than `other`.
    pub(super) fn beats(&self, other: &Self) -> bool {
        let cost = |stage: &Self| stage.best().figures.cost_of_transport;
        self.holds() && (!other.holds() || cost(self) < cost(other))
    }
}

/// What is made of what a refinement finds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Rank {
    /// It is the niche's best.
    Leading,
    /// It is a motion of the niche where it is natural.
    Beginning,
    /// Nothing yet.
    Rival,
}

/// At which step candidates are tried.
#[derive(Debug, Clone, Copy)]
pub(super) enum Fidelity {
    /// At a longer step.
    Coarse,
    /// At the step that was asked for.
    Fine,
}
