//! What came of a sweep, as a document and as comma-separated values.

use std::fmt::Write;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::front;
use super::trial::Figures;
use gaitwright_physics::scene::{Accuracy, Feedforward};

/// What came of every setting that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Kind and version of the document.
    pub format: TableFormat,
    /// What the settings were tried on.
    pub subject: Subject,
    /// Where the true states come from.
    pub truth: Truth,
    /// One a setting, in the order of the sweep.
    pub rows: Vec<Row>,
}

/// The document's kind and version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum TableFormat {
    /// The one described here.
    #[default]
    #[serde(rename = "gaitwright/accuracy@1")]
    V1,
}

/// What settings were tried on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Subject {
    /// The scenario's file, or the scene's name.
    pub name: String,
    /// Name of the character.
    pub character: String,
    /// What the column `error` measures.
    pub error: String,
    /// The unit of the columns `error` and `worst_error`.
    pub unit: String,
    /// Number of states that were compared with the true ones.
    pub compared: usize,
    /// Simulated time of each setting, s.
    pub seconds: f64,
}

/// Where true states come from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// In words.
    pub because: String,
    /// The setting of the reference simulation; `null` for an exact solution.
    pub accuracy: Option<Accuracy>,
    /// Error of the reference at twice its step against itself, in the unit of the errors: what is smaller
    /// cannot be told from 0. `null` for an exact solution.
    pub uncertainty: Option<f64>,
}

/// Who computes the steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Engine {
    /// This simulator.
    Gaitwright,
    /// rapier3d's multibody engine.
    Rapier,
}

/// How the trial of a setting went.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// To its end.
    Measured,
    /// The simulation broke off, or lost the character.
    Diverged,
    /// The setting does not apply here.
    LeftOut,
}

impl Status {
    fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Diverged => "diverged",
            Self::LeftOut => "left_out",
        }
    }
}

/// A setting and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// The method: settings that differ only in how finely they are computed share it.
    pub method: String,
    /// Who computed.
    pub engine: Engine,
    /// The setting; `null` for a method that was left out altogether.
    pub accuracy: Option<Accuracy>,
    /// The feedforward, where it is another than the scenario asks for. Such a setting drives the character
    /// otherwise: its error is against a truth of its own, and it is neither on the front nor recommended.
    pub feedforward: Option<Feedforward>,
    /// How it went.
    pub status: Status,
    /// Why it diverged or was left out.
    pub because: Option<String>,
    /// What was measured; `null` unless it went to its end.
    pub figures: Option<Figures>,
    /// Whether nothing else that was tried is both as fast and as exact.
    pub front: bool,
}

/// Columns of the comma-separated values.
const COLUMNS: &str = "method,engine,status,front,error,worst_error,seconds,evaluations,step,step_tolerance,integrator,\
    coordinates,joint_bias,solver,iterations,tolerance,friction_cone,feedforward,energy_error,momentum_error,\
    penetration,limit_overshoot,joint_separation,residual,because";

impl Table {
    /// The table of `rows`, with those marked that are on the front.
    pub fn new(subject: Subject, truth: Truth, mut rows: Vec<Row>) -> Self {
        front::mark(&mut rows);
        Self { format: TableFormat::V1, subject, truth, rows }
    }

    /// As comma-separated values (RFC 4180 with `\n`): a line of names, then a line a row. What does not apply
    /// is empty; numbers are written with as many digits as give back the same number.
    pub fn to_csv(&self) -> String {
        let mut csv = format!("{COLUMNS}\n");
        for row in &self.rows {
            let cells = row.cells();
            // Writing to a string cannot fail.
            let _ = writeln!(csv, "{}", cells.map(|cell| quoted(&cell)).join(","));
        }
        csv
    }
}

impl Row {
    fn cells(&self) -> [String; 25] {
        let figures = self.figures.as_ref();
        let figure = |pick: fn(&Figures) -> f64| figures.map(|own| pick(own).to_string()).unwrap_or_default();
        let maybe = |pick: fn(&Figures) -> Option<f64>| {
            figures.and_then(pick).map(|value| value.to_string()).unwrap_or_default()
        };
        let own = |pick: fn(&Accuracy) -> String| self.accuracy.as_ref().map(pick).unwrap_or_default();
        // What only this simulator has says nothing about another engine.
        let ours = |pick| if self.engine == Engine::Gaitwright { own(pick) } else { String::new() };
        [
            self.method.clone(),
            word(&self.engine),
            self.status.name().to_owned(),
            self.front.to_string(),
            figure(|own| own.error),
            figure(|own| own.worst_error),
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
            self.because.clone().unwrap_or_default(),
        ]
    }
}

/// A value's word in the documents.
fn word<T: Serialize>(value: &T) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(word)) => word,
        Ok(other) => other.to_string(),
        Err(_) => String::new(),
    }
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}
