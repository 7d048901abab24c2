//! Where the true states of a problem come from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
