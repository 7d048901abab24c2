//! Which feedback the gaits of a niche have, and what a search for them takes.

use crate::program::gaits::NamedGait;
use crate::program::rollout::{GALLOPING_STRIDES, STEERED_STRIDES, STRIDES};

/// How many times the generations of a gait it takes to balance it.
const TIMES: u32 = 4;

/// Which feedback the gaits of a search have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Feedback {
    /// None.
    Open,
    /// It keeps up what stays up without for a while, and falls later or when it is disturbed. That takes no longer to refine than a gait
    /// without.
    Keeps,
    /// It balances what falls at once without.
    Balances,
}

/// The searches for a balance in one attempt.
pub(super) struct Balances {
    /// Generations of each.
    pub(super) generations: u32,
    /// So many there are where time allows.
    pub(super) usual: u32,
    /// And so many at most, where none stays up.
    pub(super) most: u32,
}

impl Feedback {
    pub(super) fn is_given(self) -> bool {
        self != Self::Open
    }

    /// How many times the generations of a gait an attempt takes.
    pub(super) fn times(self) -> u32 {
        if self == Self::Balances { TIMES } else { 1 }
    }

    /// The searches of an attempt of so many `generations`: one, as long as the attempt itself, for what stays up for a while
    /// anyway; otherwise some that share them.
    pub(super) fn searches(self, generations: u32) -> Balances {
        match self {
            Self::Open => Balances { generations: 0, usual: 0, most: 0 },
            Self::Keeps => Balances { generations, usual: 1, most: 8 },
            Self::Balances => Balances { generations: generations / 4, usual: 4, most: 8 },
        }
    }

    /// Strides over which candidates for `gait` are tried.
    pub(super) fn strides(self, gait: &NamedGait) -> usize {
        match self {
            Self::Open if gait.gallops() => GALLOPING_STRIDES,
            Self::Open => STRIDES,
            Self::Keeps | Self::Balances => STEERED_STRIDES,
        }
    }
}
