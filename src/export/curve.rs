//! The learning curve as CSV and JSON.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gaitwright_learning::learn::Generation;

/// The columns of the comma-separated form.
const COLUMNS: [&str; 9] = [
    "generation",
    "best",
    "mean",
    "spread",
    "cache_hit_rate",
    "simulated_seconds",
    "saved_seconds",
    "gait",
    "elapsed",
];

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
        let mut csv = csv::Writer::from_writer(Vec::new());
        // Writing to memory cannot fail.
        let _ = csv.write_record(COLUMNS);
        for point in &self.points {
            let Generation {
                generation,
                gait,
                best,
                mean,
                spread,
                cache_hit_rate,
                simulated_seconds,
                saved_seconds,
                elapsed,
            } = point;
            let figures = [best, mean, spread, cache_hit_rate, simulated_seconds, saved_seconds];
            let mut fields = vec![generation.to_string()];
            fields.extend(figures.map(f64::to_string));
            fields.extend([gait.clone().unwrap_or_default(), elapsed.to_string()]);
            let _ = csv.write_record(fields);
        }
        String::from_utf8(csv.into_inner().unwrap_or_default()).unwrap_or_default()
    }
}
