//! A case run and measured against its bounds.

use serde::Serialize;

use super::{Case, Quantity, Run};
use crate::accuracy::{StudyError, prepare};
use crate::scenario::{Ended, Line, NoFiles};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::scene::Accuracy;

/// What came of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Name of the case.
    pub case: String,
    /// The settings it was run with.
    pub accuracy: Accuracy,
    /// `finished`, or `failed:` with cause, time and body.
    pub status: String,
    /// Whether it ran to its end.
    pub finished: bool,
    /// Computing time of the steps, s.
    pub step_seconds: f64,
    /// Every bounded quantity.
    pub rows: Vec<Row>,
}

/// A bound and what was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// What is bounded.
    pub quantity: Quantity,
    /// Its unit.
    pub unit: &'static str,
    /// The most it may be.
    pub bound: f64,
    /// What it was; for a run that failed, until then.
    pub measured: f64,
    /// Whether the bound holds.
    pub holds: bool,
}

impl Verdict {
    /// Whether the case ran to its end within all its bounds.
    pub fn holds(&self) -> bool {
        self.finished && self.rows.iter().all(|row| row.holds)
    }
}

/// The verdicts as comma-separated values, one line a bound.
pub fn to_csv(verdicts: &[Verdict]) -> String {
    let mut text =
        "case,step,step_tolerance,integrator,solver,status,quantity,unit,bound,measured,holds\n".to_owned();
    for verdict in verdicts {
        let accuracy = &verdict.accuracy;
        // The words of the documents.
        let word = |value: serde_json::Result<serde_json::Value>| match value {
            Ok(serde_json::Value::String(word)) => word,
            Ok(serde_json::Value::Object(fields)) => {
                fields.get("of").and_then(|name| name.as_str()).unwrap_or_default().to_owned()
            }
            _ => String::new(),
        };
        let integrator = word(serde_json::to_value(accuracy.integrator));
        let solver = word(serde_json::to_value(accuracy.solver.kind));
        let tolerance = accuracy.step_tolerance.map_or_else(String::new, |value| value.to_string());
        let status = verdict.status.replace([',', '\n'], ";");
        for row in &verdict.rows {
            let quantity = word(serde_json::to_value(&row.quantity));
            text += &format!(
                "{},{},{tolerance},{integrator},{solver},{status},{quantity},{},{:e},{:e},{}\n",
                verdict.case, accuracy.step, row.unit, row.bound, row.measured, row.holds
            );
        }
    }
    text
}

/// Runs `case` at `factor` times its step and measures what is bounded.
///
/// # Errors
/// What the scene asks for and the simulator does not do.
pub fn judge(case: &Case, factor: f64) -> Result<Verdict, StudyError> {
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
    let run = Run { scenario: &scenario, samples: &samples, summary: &summary };
    let row = |quantity: &Quantity, bound: f64| {
        let measured = quantity.of(&run);
        Row { quantity: quantity.clone(), unit: quantity.unit(), bound, measured, holds: measured <= bound }
    };
    Ok(Verdict {
        case: case.name.clone(),
        accuracy: summary.accuracy,
        status: summary.status.clone(),
        finished: ended == Ended::Finished,
        step_seconds: summary.step_seconds,
        rows: case.bounds.iter().map(|bound| row(&bound.quantity, bound.most)).collect(),
    })
}
