//! How the errors of a setting are spread over the pieces.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Least value, quartiles and greatest value of a sample.
///
/// A quartile is the straight line between the two values whose ranks are next to its own (definition 7 of Hyndman & Fan
/// 1996, "Sample quantiles in statistical packages").
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ErrorSpread {
    /// The least.
    pub least: f64,
    /// A quarter of the values are below.
    pub lower_quartile: f64,
    /// Half of the values are below.
    pub median: f64,
    /// Three quarters of the values are below.
    pub upper_quartile: f64,
    /// The greatest.
    pub greatest: f64,
}

impl ErrorSpread {
    /// Of `values`; all 0 where there are none.
    pub fn of(values: &[f64]) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = share * sorted.len().saturating_sub(1) as f64;
            let below = sorted.get(rank as usize).copied().unwrap_or(0.0);
            let above = sorted.get(rank as usize + 1).copied().unwrap_or(below);
            below + (above - below) * rank.fract()
        };
        Self {
            least: at(0.0),
            lower_quartile: at(0.25),
            median: at(0.5),
            upper_quartile: at(0.75),
            greatest: at(1.0),
        }
    }
}
