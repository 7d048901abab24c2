//! Running a case and measuring it against its bounds.

use serde::Serialize;

use super::case::Case;
use super::quantity::{CaseRun, Quantity};
use crate::accuracy::choice::prepare;
use crate::accuracy::fault::StudyError;
use crate::scenario::{Line, NoFiles, ScenarioEnd};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::scene::Accuracy;

/// The result of running a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseVerdict {
    /// Name of the case.
    pub case: String,
    /// The settings it was run with.
    pub accuracy: Accuracy,
    /// As in [`Summary`](crate::scenario::Summary::status).
    pub status: String,
    /// Whether it ran to its end.
    pub finished: bool,
    /// Computing time of the steps, s.
    pub step_seconds: f64,
    /// Every bounded quantity.
    pub rows: Vec<CaseMeasurement>,
}

/// A bound and what was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseMeasurement {
    /// What is bounded.
    pub quantity: Quantity,
    /// Its unit.
    pub unit: &'static str,
    /// The most it may be.
    pub bound: f64,
    /// The measured value; for a run that failed, over the time until then.
    pub measured: f64,
    /// Whether the bound holds.
    pub holds: bool,
}

impl CaseVerdict {
    /// Whether the case ran to its end within all its bounds.
    pub fn holds(&self) -> bool {
        self.finished && self.rows.iter().all(|row| row.holds)
    }
}

/// The word for `value` in the JSON documents; of a quantity, its name without its parameters.
pub(super) fn word<T: Serialize>(value: &T) -> String {
    match serde_json::to_value(value) {
        Ok(serde_json::Value::String(word)) => word,
        Ok(serde_json::Value::Object(fields)) => {
            fields.get("of").and_then(|name| name.as_str()).unwrap_or_default().to_owned()
        }
        _ => String::new(),
    }
}

/// Runs `case` at `factor` times its step and measures what is bounded.
///
/// # Errors
/// What the scene asks for and the simulator does not do.
pub fn judge(case: &Case, factor: f64) -> Result<CaseVerdict, StudyError> {
    let scenario = case.at(factor);
    let mut samples = Vec::new();
    let mut end = None;
    let ended = prepare(&scenario, &NoFiles)?.run(|line| {
        match line {
            Line::Sample(sample) => samples.push(*sample),
            Line::End { summary } => end = Some(summary),
        }
        true
    });
    let Some(summary) = end else {
        return Err(InputError::impossible("", "the simulation ended without a summary").into());
    };
    let run = CaseRun { scenario: &scenario, samples: &samples, summary: &summary };
    let row = |quantity: &Quantity, bound: f64| {
        let measured = quantity.of(&run);
        CaseMeasurement {
            quantity: quantity.clone(),
            unit: quantity.unit(),
            bound,
            measured,
            holds: measured <= bound,
        }
    };
    Ok(CaseVerdict {
        case: case.name.clone(),
        accuracy: summary.accuracy,
        status: summary.status.clone(),
        finished: ended == ScenarioEnd::Finished,
        step_seconds: summary.step_seconds,
        rows: case.bounds.iter().map(|bound| row(&bound.quantity, bound.most)).collect(),
    })
}
