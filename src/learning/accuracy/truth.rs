//! Where the true states of a problem come from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::engine::Engine;
use gaitwright_physics::scene::Accuracy;

/// Where the true states of a problem come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// A description in words.
    pub because: String,
    /// The setting of the reference simulation; `null` for an exact solution.
    pub accuracy: Option<Accuracy>,
    /// Error of the reference at twice its step against itself, in the unit of the errors: a smaller
    /// error cannot be distinguished from 0. `null` for an exact solution.
    pub uncertainty: Option<f64>,
}

/// The truth of another engine: its own finest simulation of the same pieces from the same states. Engines differ in their
/// laws of contact, of friction and of drives, so that none converges to what another does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OtherTruth {
    /// Which engine.
    pub engine: Engine,
    /// Its step, s.
    pub step: f64,
    /// Error of the same at twice the step against itself, in the unit of the errors.
    pub uncertainty: f64,
    /// Mean distance of its states from the true ones of this simulator, in the unit of the errors.
    pub apart: f64,
}
