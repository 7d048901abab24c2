//! Which settings are worth their time, and which one to take for a tolerance.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::table::{Engine, Row, Status, Table};
use super::trial::Figures;
use gaitwright_physics::scene::Accuracy;

/// The setting to take for a tolerance.
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

impl Row {
    /// What was measured, if the setting simulates the subject itself rather than a variant of it.
    pub fn comparable(&self) -> Option<&Figures> {
        self.figures.as_ref().filter(|_| self.status == Status::Measured && self.feedforward.is_none())
    }
}

/// Marks the rows that no other row beats in both computing time and error.
pub(super) fn mark(rows: &mut [Row]) {
    let cost = |row: &Row| row.comparable().map(|figures| (figures.seconds, figures.error));
    let costs: Vec<_> = rows.iter().map(cost).collect();
    for (row, own) in rows.iter_mut().zip(&costs) {
        row.front = own.is_some_and(|own| !costs.iter().flatten().any(|other| beats(*other, own)));
    }
}

impl Table {
    /// The cheapest setting of this simulator whose mean error is at most `tolerance`, in the unit of the
    /// subject.
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
        let measured: Vec<_> = ours.filter_map(|row| Some((row, row.comparable()?, row.accuracy?))).collect();
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

/// Whether `one` is at least as fast and as exact as `other`, and better in one of the two.
fn beats(one: (f64, f64), other: (f64, f64)) -> bool {
    one.0 <= other.0 && one.1 <= other.1 && one != other
}
