//! What was changed in the algorithm as published, one by one.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A change of the algorithm as published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Repair {
    /// The way of a transition is taken in the heading at its start, and not in the world's axes: the physical states
    /// that transitions start from are headed anywhere.
    HeadingFrame,
    /// Turn and drift are charged over a whole cycle, and not transition by transition: the sway of a walk cancels out.
    WholeCycle,
    /// How long it takes to get to a state is a gene of that state, and not the same for all.
    TransitionTimes,
    /// Crossover exchanges states, and limbs, that refer to each other as a whole.
    WholeGroups,
    /// A subset is closed under mirroring and under the cyclic shift of limbs, and the behaviour of its mirrored half
    /// follows from that of the other half.
    Symmetry,
    /// Beside the behaviour of the greedy policy, the cycle of greatest reward per time is tried.
    BestCycle,
    /// Impacts, jerky torques and the swaying of the trunk are charged, too, and not energy, slip, turn and drift alone.
    NaturalCost,
    /// Until a behaviour has passed the whole check, only the best of a generation is given it.
    BoundedStart,
}

impl Repair {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::HeadingFrame,
        Self::WholeCycle,
        Self::TransitionTimes,
        Self::WholeGroups,
        Self::Symmetry,
        Self::BestCycle,
        Self::NaturalCost,
        Self::BoundedStart,
    ];

    /// Its name in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::HeadingFrame => "heading_frame",
            Self::WholeCycle => "whole_cycle",
            Self::TransitionTimes => "transition_times",
            Self::WholeGroups => "whole_groups",
            Self::Symmetry => "symmetry",
            Self::BestCycle => "best_cycle",
            Self::NaturalCost => "natural_cost",
            Self::BoundedStart => "bounded_start",
        }
    }

    fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// A set of repairs; all of them where nothing is said. A document lists them by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "BTreeSet<Repair>", into = "BTreeSet<Repair>")]
#[schemars(with = "BTreeSet<Repair>")]
pub struct Repairs(u8);

impl Repairs {
    /// None: the algorithm as published.
    pub const NONE: Self = Self(0);

    /// Whether `repair` is among them.
    pub fn has(self, repair: Repair) -> bool {
        self.0 & repair.bit() != 0
    }

    /// All of these but `repair`.
    pub fn without(self, repair: Repair) -> Self {
        Self(self.0 & !repair.bit())
    }
}

impl Default for Repairs {
    fn default() -> Self {
        BTreeSet::from(Repair::ALL).into()
    }
}

impl From<BTreeSet<Repair>> for Repairs {
    fn from(repairs: BTreeSet<Repair>) -> Self {
        Self(repairs.into_iter().fold(0, |bits, repair| bits | repair.bit()))
    }
}

impl From<Repairs> for BTreeSet<Repair> {
    fn from(repairs: Repairs) -> Self {
        Repair::ALL.into_iter().filter(|repair| repairs.has(*repair)).collect()
    }
}
