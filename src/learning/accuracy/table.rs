//! The results of a study, as a document and as comma-separated values.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::csv_text::csv_text;
use super::front::mark_front;
use super::row::{COLUMNS, TableRow};
use super::truth::{OtherTruth, Truth};

/// The results of every setting that was tried.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Kind and version of the document.
    pub format: TableFormat,
    /// The problem that the settings were tried on.
    pub subject: StudySubject,
    /// Where the true states come from.
    pub truth: Truth,
    /// The truths of other engines, which their own errors are against; none where the exact solution is known.
    #[serde(default)]
    pub others: Vec<OtherTruth>,
    /// One a setting, in the order of the sweep.
    pub rows: Vec<TableRow>,
}

/// The document's kind and version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum TableFormat {
    /// The one described here.
    #[default]
    #[serde(rename = "gaitwright/accuracy@1")]
    V1,
}

/// The problem that settings were tried on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudySubject {
    /// The scenario's file, or the scene's name.
    pub name: String,
    /// Name of the character.
    pub character: String,
    /// What the column `error` measures.
    pub error: String,
    /// The unit of the columns `error` to `worst_error`.
    pub unit: String,
    /// Number of states that were compared with the true ones.
    pub compared: usize,
    /// Simulated time of each setting, s.
    pub seconds: f64,
}

impl Table {
    /// The table of `rows`, with those marked that are on the front.
    pub fn new(
        subject: StudySubject,
        truth: Truth,
        others: Vec<OtherTruth>,
        mut rows: Vec<TableRow>,
    ) -> Self {
        mark_front(&mut rows);
        Self { format: TableFormat::V1, subject, truth, others, rows }
    }

    /// As comma-separated values (RFC 4180, lines ended by `\n`): a line of column names, then a line for each row.
    /// What does not apply is empty; numbers are written with as many digits as give back the same number.
    pub fn to_csv(&self) -> String {
        csv_text(COLUMNS, self.rows.iter().map(TableRow::cells))
    }
}
