//! How children differ from their parents.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How often each kind of crossover is used, relative to the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Crossover {
    /// Every state whole from one parent or the other.
    pub uniform: f64,
    /// Every limb's angles and velocities in a state from one parent or the other.
    pub limb: f64,
    /// Uniform, with the mate that is closest in state space among several drawn.
    pub neighbouring: f64,
}

impl Default for Crossover {
    fn default() -> Self {
        Self { uniform: 1.0, limb: 1.0, neighbouring: 1.0 }
    }
}

/// How often what is changed at random in a child.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mutation {
    /// Probability of each joint's angle to move by a level or two.
    pub angle: f64,
    /// Probability of each joint's velocity to move by a level or two.
    pub velocity: f64,
    /// Probability of each state to be drawn afresh.
    pub state: f64,
    /// Probability of each limb to follow another one from now on, or to go its own way again: legs
    /// that do the same, together or in turn, are found far sooner than each by itself.
    pub limb: f64,
    /// Probability of each state to be reached in a beat more or less, where that is a gene.
    pub time: f64,
}

impl Default for Mutation {
    fn default() -> Self {
        Self { angle: 0.04, velocity: 0.04, state: 0.03, limb: 0.05, time: 0.05 }
    }
}
