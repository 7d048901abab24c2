//! The recommended setting for a tolerance.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::engine::Engine;
use super::table::Table;
use gaitwright_physics::scene::Accuracy;

/// The recommended setting for a tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Recommendation {
    /// The error that is accepted, in the unit of the subject.
    pub tolerance: f64,
    /// The cheapest setting whose error is within the tolerance, as a scenario or a job takes it; `null`
    /// when none is.
    pub accuracy: Option<Accuracy>,
    /// Its mean error, in the unit of the subject.
    pub error: Option<f64>,
    /// Its computing time for a simulated second, s.
    pub seconds: Option<f64>,
    /// Why this one, or why none.
    pub because: String,
}

impl Table {
    /// The cheapest setting of this simulator whose mean error is at most `tolerance`, in the unit of the
    /// subject, and that left no step unsolved.
    pub fn recommend(&self, tolerance: f64) -> Recommendation {
        let none =
            |because| Recommendation { tolerance, accuracy: None, error: None, seconds: None, because };
        let unit = &self.subject.unit;
        if let Some(uncertainty) = self.truth.uncertainty
            && tolerance < uncertainty
        {
            let because = format!("the reference itself is only certain to {uncertainty:.1e} {unit}");
            return none(because);
        }
        let ours = self.rows.iter().filter(|row| row.engine == Engine::Gaitwright);
        let comparable = ours.filter_map(|row| Some((row, row.comparable()?, row.accuracy?)));
        let measured: Vec<_> = comparable.filter(|(_, figures, _)| figures.is_solved()).collect();
        let within = measured.iter().filter(|(_, figures, _)| figures.error <= tolerance);
        let cheapest = within.min_by(|(_, own, _), (_, other, _)| {
            own.seconds.total_cmp(&other.seconds).then(own.error.total_cmp(&other.error))
        });
        match cheapest {
            Some((row, figures, accuracy)) => Recommendation {
                tolerance,
                accuracy: Some(*accuracy),
                error: Some(figures.error),
                seconds: Some(figures.seconds),
                because: format!(
                    "the cheapest of the {} settings within {tolerance:e} {unit}: {}",
                    measured.iter().filter(|(_, figures, _)| figures.error <= tolerance).count(),
                    row.method
                ),
            },
            None => {
                let best = measured.iter().map(|(_, figures, _)| figures.error).fold(f64::INFINITY, f64::min);
                none(format!(
                    "no setting that was tried is within it; the most exact errs by {best:.1e} {unit}"
                ))
            }
        }
    }
}
