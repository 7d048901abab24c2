//! The answers, as a document and as comma-separated values.

use std::collections::BTreeMap;

use csv::{Terminator, WriterBuilder};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::arena::{FROUDE, StudyArena};
use super::judged::{JudgedMotion, JudgedRun};
use super::variants::Question;

/// The columns of the comma-separated form.
const COLUMNS: [&str; 18] = [
    "question",
    "variant",
    "seeds",
    "found",
    "natural_cost",
    "natural_cost_least",
    "natural_cost_greatest",
    "speed",
    "cost_of_transport",
    "stride_period",
    "upright_seconds",
    "gaits",
    "natural",
    "simulated_seconds",
    "saved_seconds",
    "cache_hit_rate",
    "improvements",
    "seconds",
];

/// What a study of the learning has shown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LearningTable {
    /// Kind and version of the document.
    pub format: LearningTableFormat,
    /// What every run was asked for.
    pub task: StudiedTask,
    /// What was asked, by its word.
    pub questions: BTreeMap<String, String>,
    /// One a question and variant, in their order.
    pub rows: Vec<VariantRow>,
}

/// The document's kind and version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum LearningTableFormat {
    /// The one described here.
    #[default]
    #[serde(rename = "gaitwright/learning-study@1")]
    V1,
}

/// What every run was asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudiedTask {
    /// Name of the character.
    pub character: String,
    /// Froude number.
    pub froude: f64,
    /// The same as a speed, m/s.
    pub speed: f64,
    /// Runs of each variant.
    pub seeds: u64,
    /// Simulated time of a run, s.
    pub simulated_seconds: f64,
}

/// The runs of a variant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VariantRow {
    /// The question's word.
    pub question: String,
    /// The variant.
    pub variant: String,
    /// Runs in which something was found ([`JudgedRun::best`](super::JudgedRun::best)); whether it stays upright, `upright_seconds`
    /// and `natural_cost` tell.
    pub found: usize,
    /// Over all runs, of which those that found nothing cost more than any other; `null` in place of their figures.
    pub natural_cost: MedianRange,
    /// Median of what was found, m/s.
    pub speed: Option<f64>,
    /// Median of what was found.
    pub cost_of_transport: Option<f64>,
    /// Median of what was found, s.
    pub stride_period: Option<f64>,
    /// Median of what was found, s: of 20 s, or of twelve cycles after the entry where these take longer.
    pub upright_seconds: Option<f64>,
    /// Names of the gaits that were found, and in how many runs.
    pub gaits: BTreeMap<String, usize>,
    /// Runs of which the motion is natural.
    pub natural: usize,
    /// Median, s.
    pub simulated_seconds: f64,
    /// Median, s.
    pub saved_seconds: f64,
    /// Median; `null` where there is no cache.
    pub cache_hit_rate: Option<f64>,
    /// Median computing time of a run, s; not reproducible.
    pub seconds: f64,
    /// One a seed.
    pub runs: Vec<JudgedRun>,
}

/// Median, least and greatest of some runs; `null` where it is that of a run without one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MedianRange {
    /// The one in the middle; of an even number the greater of the two.
    pub median: Option<f64>,
    /// Least.
    pub least: Option<f64>,
    /// Greatest.
    pub greatest: Option<f64>,
}

impl MedianRange {
    /// Of `values`, of which those that are missing count as the greatest.
    pub fn of(values: impl IntoIterator<Item = Option<f64>>) -> Self {
        let mut values: Vec<Option<f64>> = values.into_iter().collect();
        let key = |value: &Option<f64>| value.unwrap_or(f64::INFINITY);
        values.sort_by(|a, b| key(a).total_cmp(&key(b)));
        let at = |index: usize| values.get(index).copied().flatten();
        Self { median: at(values.len() / 2), least: at(0), greatest: at(values.len().saturating_sub(1)) }
    }
}

/// The median of those values that there are.
fn median(values: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    MedianRange::of(values.filter(Option::is_some)).median
}

impl VariantRow {
    /// The row of a variant's runs.
    pub fn new(question: &str, variant: &str, runs: Vec<JudgedRun>) -> Self {
        let best = || runs.iter().filter_map(|run| run.best.as_ref());
        let of = |value: fn(&JudgedMotion) -> Option<f64>| median(best().map(value));
        let all =
            |value: fn(&JudgedRun) -> f64| median(runs.iter().map(|run| Some(value(run)))).unwrap_or(0.0);
        let mut gaits = BTreeMap::new();
        for gait in best().filter_map(|best| best.gait.clone()) {
            *gaits.entry(gait).or_insert(0) += 1;
        }
        Self {
            question: question.to_owned(),
            variant: variant.to_owned(),
            found: best().count(),
            natural_cost: MedianRange::of(
                runs.iter().map(|run| run.best.as_ref().map(|best| best.natural_cost)),
            ),
            speed: of(|best| Some(best.speed)),
            cost_of_transport: of(|best| best.cost_of_transport),
            stride_period: of(|best| best.stride_period),
            upright_seconds: of(|best| Some(best.upright_seconds)),
            gaits,
            natural: best().filter(|best| best.natural).count(),
            simulated_seconds: all(|run| run.simulated_seconds),
            saved_seconds: all(|run| run.saved_seconds),
            cache_hit_rate: median(runs.iter().map(|run| run.cache_hit_rate)),
            seconds: all(|run| run.seconds),
            runs,
        }
    }

    /// What the best motion of a run costs once so much time has been simulated, over all runs.
    pub fn cost_after(&self, simulated: f64) -> MedianRange {
        MedianRange::of(self.runs.iter().map(|run| {
            let known = run.course.iter().take_while(|[at, _]| *at <= simulated);
            known.last().map(|[_, cost]| *cost)
        }))
    }

    fn cells(&self) -> Vec<String> {
        let figure = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        let MedianRange { median, least, greatest } = self.natural_cost;
        let gaits: Vec<String> = self.gaits.iter().map(|(gait, count)| format!("{gait} {count}")).collect();
        vec![
            self.question.clone(),
            self.variant.clone(),
            self.runs.len().to_string(),
            self.found.to_string(),
            figure(median),
            figure(least),
            figure(greatest),
            figure(self.speed),
            figure(self.cost_of_transport),
            figure(self.stride_period),
            figure(self.upright_seconds),
            gaits.join("; "),
            self.natural.to_string(),
            self.simulated_seconds.to_string(),
            self.saved_seconds.to_string(),
            figure(self.cache_hit_rate),
            self.runs.iter().map(|run| run.course.len()).sum::<usize>().to_string(),
            self.seconds.to_string(),
        ]
    }
}

impl LearningTable {
    pub(super) fn new(
        arena: &StudyArena,
        questions: &[Question],
        (seeds, simulated_seconds): (u64, f64),
        rows: Vec<VariantRow>,
    ) -> Self {
        let task = StudiedTask {
            character: arena.subject.model.character.name.clone(),
            froude: FROUDE,
            speed: arena.speed,
            seeds,
            simulated_seconds,
        };
        let questions =
            questions.iter().map(|question| (question.name.to_owned(), question.about.to_owned())).collect();
        Self { format: LearningTableFormat::V1, task, questions, rows }
    }

    /// The rows that answer a question.
    pub fn answers(&self, question: &str) -> Vec<&VariantRow> {
        self.rows.iter().filter(|row| row.question == question).collect()
    }

    /// As comma-separated values (RFC 4180, lines ended by `\n`): a line of column names, then a line a row. Every column
    /// but the last, `seconds`, is the same for equal studies.
    pub fn to_csv(&self) -> String {
        let mut writer = WriterBuilder::new().terminator(Terminator::Any(b'\n')).from_writer(Vec::new());
        // Writing to memory cannot fail, and every record has as many cells as there are names.
        let _ = writer.write_record(COLUMNS);
        for row in &self.rows {
            let _ = writer.write_record(row.cells());
        }
        writer.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
    }
}
