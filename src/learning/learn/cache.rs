//! The transition cache: what was simulated once is not simulated again (the remedy that Tokizaki &
//! Hasegawa plan in section 5).
//!
//! The key is the pair of states, with the trunk's cell at the start of the transition where the trunk has cells.
//! The physical state at the start is not part of it: the cache holds the result of the first simulation of the
//! transition, from whatever physical state the character was in then. The continuous check does not use it.

use std::collections::HashMap;
use std::sync::Arc;

use super::grid::{GridState, Level};
use super::objective::Terms;

/// What identifies a transition.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub struct TransitionKey {
    /// Levels of the state it starts from; `None` for the standing pose.
    pub from: Option<Vec<Level>>,
    /// State it leads to.
    pub to: GridState,
    /// Cell of the trunk at its start, see [`super::evaluation::World::cell`].
    pub cell: usize,
    /// Whether the physical state after it is kept in a mirror.
    pub mirrored: bool,
}

/// The result of simulating a transition.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedTransition<S> {
    /// The terms of its reward, summed over the transition.
    pub terms: Terms,
    /// s simulated: the transition time, or less if the character fell.
    pub seconds: f64,
    /// The physical state after it and the trunk's cell there; `None` if the character fell or the
    /// simulation could not go on.
    pub after: Option<(S, usize)>,
}

/// Transitions simulated so far, shared by all individuals of a generation. It changes only between generations, so
/// that what an individual finds in it depends neither on the others of its generation nor on the number of threads.
#[derive(Debug, Clone)]
pub struct Cache<S> {
    known: HashMap<TransitionKey, Arc<TrackedTransition<S>>>,
    capacity: usize,
}

/// Transitions an individual simulated for itself, in order.
pub type Additions<S> = Vec<(TransitionKey, Arc<TrackedTransition<S>>)>;

impl<S> Cache<S> {
    /// An empty cache that holds at most `capacity` transitions.
    pub fn new(capacity: usize) -> Self {
        Self { known: HashMap::new(), capacity }
    }

    /// The transition, if it is known.
    pub fn get(&self, key: &TransitionKey) -> Option<&Arc<TrackedTransition<S>>> {
        self.known.get(key)
    }

    /// Adds what an individual simulated, as far as there is room. A transition that is already known stays as it is.
    pub fn merge(&mut self, additions: Additions<S>) {
        for (key, tracked) in additions {
            if self.known.len() >= self.capacity {
                return;
            }
            self.known.entry(key).or_insert(tracked);
        }
    }

    /// Removes all transitions.
    pub fn clear(&mut self) {
        self.known.clear();
    }
}

/// How many transitions were asked for and how much was simulated.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimulationTotals {
    /// Transitions the Q-learners asked for.
    pub asked: u64,
    /// Those of them that had to be simulated.
    pub simulated: u64,
    /// Simulated time, continuous checks included, s.
    pub seconds: f64,
    /// Simulated time that the caches saved, s.
    #[serde(default)]
    pub saved: f64,
}

impl SimulationTotals {
    /// Share of the transitions asked for that were not simulated, 0 to 1.
    pub fn hit_rate(&self) -> f64 {
        if self.asked == 0 { 0.0 } else { (self.asked - self.simulated) as f64 / self.asked as f64 }
    }
}

impl std::ops::AddAssign for SimulationTotals {
    fn add_assign(&mut self, other: Self) {
        self.asked += other.asked;
        self.simulated += other.simulated;
        self.seconds += other.seconds;
        self.saved += other.saved;
    }
}
