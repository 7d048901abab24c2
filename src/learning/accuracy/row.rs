//! One row of a table: a setting and what was measured of it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::engine::Engine;
use super::figures::Figures;
use gaitwright_physics::scene::{Accuracy, Feedforward};

/// How the trial of a setting ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RowStatus {
    /// The simulation reached its end.
    Measured,
    /// The simulation broke off, or its error grew beyond any use.
    Diverged,
    /// The setting does not apply here, or takes too long.
    LeftOut,
}

impl RowStatus {
    fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Diverged => "diverged",
            Self::LeftOut => "left_out",
        }
    }
}

/// A setting and the result of its trial.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TableRow {
    /// The method: settings that differ only in how finely they are computed share it.
    pub method: String,
    /// The simulator that computed the steps.
    pub engine: Engine,
    /// The setting; `null` for a method that was left out altogether.
    pub accuracy: Option<Accuracy>,
    /// The feedforward, where it is another than the scenario asks for. Such a setting drives the character
    /// differently: its error is against a truth of its own, and it is neither on the front nor recommended.
    pub feedforward: Option<Feedforward>,
    /// How its trial ended.
    pub status: RowStatus,
    /// Why it diverged or was left out.
    pub because: Option<String>,
    /// What was measured; `null` unless the simulation reached its end.
    pub figures: Option<Figures>,
    /// Whether no other setting that was tried is at least as fast and as exact, and better in one of the two.
    pub front: bool,
}

/// Names of the cells of [`TableRow::cells`].
pub(super) const COLUMNS: [&str; 30] = [
    "method",
    "engine",
    "status",
    "front",
    "error",
    "least_error",
    "lower_quartile",
    "median_error",
    "upper_quartile",
    "worst_error",
    "seconds",
    "evaluations",
    "step",
    "step_tolerance",
    "integrator",
    "coordinates",
    "joint_bias",
    "solver",
    "iterations",
    "tolerance",
    "friction_cone",
    "feedforward",
    "energy_error",
    "momentum_error",
    "penetration",
    "limit_overshoot",
    "joint_separation",
    "residual",
    "unsolved_steps",
    "because",
];

impl TableRow {
    /// What was measured, if the setting simulates the subject itself rather than a variant of it.
    pub fn comparable(&self) -> Option<&Figures> {
        self.figures.as_ref().filter(|_| self.status == RowStatus::Measured && self.feedforward.is_none())
    }

    /// The row as cells of comma-separated values, see [`COLUMNS`]. What does not apply is empty; numbers have as
    /// many digits as give back the same number.
    pub(super) fn cells(&self) -> [String; 30] {
        let figures = self.figures.as_ref();
        let figure = |pick: fn(&Figures) -> f64| figures.map(|own| pick(own).to_string()).unwrap_or_default();
        let maybe = |pick: fn(&Figures) -> Option<f64>| {
            figures.and_then(pick).map(|value| value.to_string()).unwrap_or_default()
        };
        let own = |pick: fn(&Accuracy) -> String| self.accuracy.as_ref().map(pick).unwrap_or_default();
        // Settings that only this simulator has are left empty for another engine.
        let ours = |pick| if self.engine == Engine::Gaitwright { own(pick) } else { String::new() };
        [
            self.method.clone(),
            word(&self.engine),
            self.status.name().to_owned(),
            self.front.to_string(),
            figure(|own| own.error),
            figure(|own| own.spread.least),
            figure(|own| own.spread.lower_quartile),
            figure(|own| own.spread.median),
            figure(|own| own.spread.upper_quartile),
            figure(|own| own.spread.greatest),
            figure(|own| own.seconds),
            maybe(|own| own.evaluations),
            own(|own| own.step.to_string()),
            ours(|own| own.step_tolerance.map(|value| value.to_string()).unwrap_or_default()),
            ours(|own| word(&own.integrator)),
            ours(|own| word(&own.coordinates)),
            ours(|own| word(&own.joint_bias)),
            ours(|own| word(&own.solver.kind)),
            ours(|own| own.solver.iterations.to_string()),
            ours(|own| own.solver.tolerance.to_string()),
            ours(|own| word(&own.friction_cone)),
            self.feedforward.as_ref().map(word).unwrap_or_default(),
            figure(|own| own.energy_error),
            figure(|own| own.momentum_error),
            maybe(|own| own.penetration),
            figure(|own| own.limit_overshoot),
            maybe(|own| own.joint_separation),
            maybe(|own| own.residual),
            figures.and_then(|own| own.unsolved_steps).map(|steps| steps.to_string()).unwrap_or_default(),
            self.because.clone().unwrap_or_default(),
        ]
    }
}

/// The word for `value` in the JSON documents.
fn word<T: Serialize>(value: &T) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(word)) => word,
        Ok(other) => other.to_string(),
        Err(_) => String::new(),
    }
}
