//! Every case with the default settings beside its best ones, as a table.

use std::fmt::Write;

use serde_json::Value;

use super::case::Case;
use super::judge::{CaseMeasurement, CaseVerdict, judge, word};
use crate::accuracy::csv_text::csv_text;
use crate::accuracy::fault::StudyError;
use gaitwright_physics::scene::Accuracy;

/// A case at one step, run with the default settings and with the best ones known for it.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseComparison {
    /// With the default settings.
    pub by_default: CaseVerdict,
    /// With the settings of the case; the same run where those are the default ones.
    pub best: CaseVerdict,
}

/// Runs `case` at `factor` times its step with the default settings, and with its own where those are others.
///
/// # Errors
/// What the scene asks for and the simulator does not do.
pub fn compare(case: &Case, factor: f64) -> Result<CaseComparison, StudyError> {
    let best = judge(case, factor)?;
    let by_default = match case.by_default() {
        Some(plain) => judge(&plain, factor)?,
        None => best.clone(),
    };
    Ok(CaseComparison { by_default, best })
}

/// Columns of the comma-separated values.
const COLUMNS: [&str; 13] = [
    "case",
    "step",
    "quantity",
    "unit",
    "bound",
    "measured_by_default",
    "holds_by_default",
    "status_by_default",
    "best_settings",
    "measured_with_best",
    "holds_with_best",
    "status_with_best",
    "step_seconds_with_best",
];

impl CaseComparison {
    /// Whether the best settings are others than the default ones.
    fn differs(&self) -> bool {
        self.best.accuracy != self.by_default.accuracy
    }

    /// The best settings, as far as they are others than the default ones: `name value` each.
    fn best_settings(&self) -> String {
        let fields = |accuracy: &Accuracy| match serde_json::to_value(accuracy) {
            Ok(Value::Object(fields)) => fields,
            _ => serde_json::Map::new(),
        };
        let (best, plain) = (fields(&self.best.accuracy), fields(&self.by_default.accuracy));
        let others = best.iter().filter(|(name, value)| plain.get(*name) != Some(value));
        let words = others.map(|(name, value)| match value {
            Value::Object(_) => name.clone(),
            Value::String(word) => format!("{name} {word}"),
            value => format!("{name} {value}"),
        });
        words.collect::<Vec<_>>().join("; ")
    }

    /// Each bound with what was measured by default and with the best settings.
    fn rows(&self) -> impl Iterator<Item = (&CaseMeasurement, &CaseMeasurement)> {
        self.by_default.rows.iter().zip(&self.best.rows)
    }

    fn cells(&self) -> impl Iterator<Item = [String; COLUMNS.len()]> + '_ {
        let status = |verdict: &CaseVerdict| verdict.status.replace([',', '\n'], ";");
        self.rows().map(move |(plain, best)| {
            [
                self.best.case.clone(),
                self.best.accuracy.step.to_string(),
                word(&plain.quantity),
                plain.unit.to_owned(),
                format!("{:e}", plain.bound),
                format!("{:e}", plain.measured),
                plain.holds.to_string(),
                status(&self.by_default),
                self.best_settings(),
                format!("{:e}", best.measured),
                best.holds.to_string(),
                status(&self.best),
                self.best.step_seconds.to_string(),
            ]
        })
    }
}

/// As comma-separated values, one line a bound.
pub fn to_csv(comparisons: &[CaseComparison]) -> String {
    csv_text(COLUMNS, comparisons.iter().flat_map(CaseComparison::cells))
}

/// As a table in Markdown: one line a bound, with what was measured at each of the steps, in the order in which they were
/// run. Figures out of bounds are bold.
pub fn to_markdown(comparisons: &[CaseComparison]) -> String {
    let mut text =
        "| case | steps, ms | bound on | at most | default settings | best settings | with these |\n\
                    |---|---|---|---|---|---|---|\n"
            .to_owned();
    for runs in comparisons.chunk_by(|one, other| one.best.case == other.best.case) {
        let [first, ..] = runs else { continue };
        let joined = |cells: Vec<String>| cells.join(", ");
        let steps = joined(runs.iter().map(|run| figure(1000.0 * run.best.accuracy.step)).collect());
        for (index, (row, _)) in first.rows().enumerate() {
            let measured = |pick: fn(&CaseComparison) -> &CaseVerdict| {
                joined(runs.iter().filter_map(|run| pick(run).rows.get(index)).map(shown).collect())
            };
            let (settings, best) = match first.differs() {
                true => (first.best_settings(), measured(|run| &run.best)),
                false => ("the same".to_owned(), String::new()),
            };
            let (case, quantity) = (&first.best.case, word(&row.quantity).replace('_', " "));
            let plain = measured(|run| &run.by_default);
            let bound = figure(row.bound);
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "| `{case}` | {steps} | {quantity} | {bound} {} | {plain} | {settings} | {best} |",
                row.unit
            );
        }
    }
    text
}

/// A measured value, bold where it is out of bounds.
fn shown(row: &CaseMeasurement) -> String {
    let value = figure(row.measured);
    if row.holds { value } else { format!("**{value}**") }
}

/// What is smaller than this is shown as 0, in any unit of the table.
const NOTHING: f64 = 1e-30;

/// `value` to two digits.
fn figure(value: f64) -> String {
    if value.abs() < NOTHING {
        "0".to_owned()
    } else if (1e-2..1e4).contains(&value.abs()) {
        let digits = if value.abs() < 0.1 {
            3
        } else if value.abs() < 10.0 {
            2
        } else {
            0
        };
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
    } else {
        format!("{value:.1e}")
    }
}
