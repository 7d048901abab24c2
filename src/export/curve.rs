//! The learning curve as CSV and JSON.

use std::fmt::Write;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gaitwright_learning::learn::Generation;

/// A learning curve as a document.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Kind and version of the document.
    pub format: CurveFormat,
    /// One point a generation, in order.
    pub points: Vec<Generation>,
}

/// The document's kind and version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum CurveFormat {
    /// The one described here.
    #[default]
    #[serde(rename = "gaitwright/curve@1")]
    V1,
}

impl Curve {
    /// The curve through `points`.
    pub fn new(points: &[Generation]) -> Self {
        Self { format: CurveFormat::V1, points: points.to_vec() }
    }

    /// As comma-separated values (RFC 4180 with `\n`): a line of names, then a line a generation.
    /// Numbers are written with as many digits as give back the same number. Every column but the last,
    /// `elapsed`, is the same for equal jobs.
    pub fn to_csv(&self) -> String {
        let mut csv = String::from(
            "generation,best,mean,spread,cache_hit_rate,simulated_seconds,saved_seconds,elapsed\n",
        );
        for point in &self.points {
            let Generation {
                generation,
                best,
                mean,
                spread,
                cache_hit_rate,
                simulated_seconds,
                saved_seconds,
                elapsed,
            } = point;
            // Writing to a string cannot fail.
            let _ = writeln!(
                csv,
                "{generation},{best},{mean},{spread},{cache_hit_rate},{simulated_seconds},{saved_seconds},{elapsed}"
            );
        }
        csv
    }
}
