//! The simulators that are compared.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The simulator that computes the steps of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// This simulator.
    Gaitwright,
    /// rapier3d's multibody engine.
    Rapier,
}
