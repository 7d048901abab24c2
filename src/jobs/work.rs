//! What a job is for, with what is kept of each kind.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::repertoire::MotionSummary;
use super::request::Settings;
use gaitwright_learning::accuracy::{AccuracyCheck, Recommendation, StudySubject};
use gaitwright_learning::learn::StopReason;
use gaitwright_physics::motion::Metrics;
use gaitwright_physics::scene::{AccuracyChoice, AskedAccuracy, Decision, Effect};

/// What a job is for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Work {
    /// Learns a motion.
    Learning(Box<LearningRecord>),
    /// Studies what accuracy costs.
    Accuracy(Box<StudyRecord>),
}

/// A job that learns: what is wanted, and what came of it so far.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Learned")]
pub struct LearningRecord {
    /// What was asked for; once the job runs, with the values used in place of those left open.
    #[serde(flatten)]
    pub settings: Settings,
    /// Why the accuracy used was chosen, where a tolerance was asked for; known once the job runs.
    #[serde(default)]
    pub accuracy_choice: Option<AccuracyChoice>,
    /// What became of that tolerance on the motion found.
    #[serde(default)]
    pub accuracy_check: Option<AccuracyCheck>,
    /// Every motion finished so far.
    #[serde(default)]
    pub motions: Vec<MotionSummary>,
    /// Fitness of the best motion so far (see the learning curve).
    pub best_fitness: Option<f64>,
    /// Share of the transitions that came from the cache, 0 to 1.
    pub cache_hit_rate: Option<f64>,
    /// Every effect, whether it is simulated, and why; known once the job runs.
    pub effects: BTreeMap<Effect, Decision>,
    /// Why the learning stopped.
    pub ended_by: Option<StopReason>,
    /// What the motion found is worth; known once the job has ended.
    #[serde(default)]
    pub outcome: Option<MotionOutcome>,
    /// Figures of the motion found, from the continuous check.
    pub metrics: Option<Metrics>,
    /// What came of the run before, while the present one has not begun to learn: its results are still the job's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub earlier: Option<Box<EarlierResults>>,
}

/// What came of an earlier run of a job; each field is that of the job.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EarlierResults {
    /// What became of the tolerance that was asked for.
    pub accuracy_check: Option<AccuracyCheck>,
    /// Every motion that was finished.
    pub motions: Vec<MotionSummary>,
    /// Why the learning stopped.
    pub ended_by: Option<StopReason>,
    /// What the motion found is worth.
    pub outcome: Option<MotionOutcome>,
    /// Figures of the motion found.
    pub metrics: Option<Metrics>,
}

/// What the motion of a job is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MotionOutcome {
    /// It is valid, and natural by every measure.
    Natural,
    /// It is valid, but not natural; `naturalness` in its metrics says by which measures.
    NotNatural,
    /// It cannot be relied on: it did not last to the end of its check, or steps of the check are unsolved.
    NotValid,
    /// There is none.
    NoMotion,
}

impl MotionOutcome {
    /// What a motion with these figures is worth.
    pub fn of(metrics: Option<&Metrics>) -> Self {
        match metrics {
            None => Self::NoMotion,
            Some(metrics) if !metrics.validity.valid => Self::NotValid,
            Some(metrics) if !metrics.natural => Self::NotNatural,
            Some(_) => Self::Natural,
        }
    }
}

/// A job that studies what accuracy costs: what is wanted, and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Studied")]
pub struct StudyRecord {
    /// Errors for which a setting is to be recommended, m.
    pub tolerances: Vec<f64>,
    /// What the settings were tried on; known once the study is done.
    pub subject: Option<StudySubject>,
    /// One for each tolerance; known once the study is done.
    pub recommendations: Vec<Recommendation>,
}

impl LearningRecord {
    /// What is wanted, as it was asked for before an accuracy was chosen for its tolerance: the choice is made
    /// again by whoever takes the job up again, and comes out the same.
    pub(super) fn wanted(&self) -> Settings {
        let mut settings = self.settings.clone();
        if let Some(choice) = &self.accuracy_choice {
            settings.accuracy = AskedAccuracy::Tolerance(choice.tolerance);
        }
        settings
    }

    /// Sets aside what came of an earlier run, until the next one begins to learn.
    pub(super) fn set_aside(&mut self) {
        let results = EarlierResults {
            accuracy_check: self.accuracy_check.take(),
            motions: std::mem::take(&mut self.motions),
            ended_by: self.ended_by.take(),
            outcome: self.outcome.take(),
            metrics: self.metrics.take(),
        };
        // What was set aside before is still what came last.
        if !results.motions.is_empty() || results.ended_by.is_some() {
            self.earlier = Some(Box::new(results));
        }
    }

    /// Takes back what was set aside, if anything was and no run has begun to learn since.
    pub(super) fn take_back(&mut self) {
        let Some(earlier) = self.earlier.take() else { return };
        let EarlierResults { accuracy_check, motions, ended_by, outcome, metrics } = *earlier;
        (self.accuracy_check, self.motions, self.metrics) = (accuracy_check, motions, metrics);
        self.ended_by = ended_by.or(self.ended_by);
        self.outcome = outcome.or_else(|| Some(MotionOutcome::of(self.metrics.as_ref())));
    }
}

impl From<Settings> for Work {
    fn from(settings: Settings) -> Self {
        Self::Learning(Box::new(LearningRecord {
            settings,
            accuracy_choice: None,
            accuracy_check: None,
            motions: Vec::new(),
            best_fitness: None,
            cache_hit_rate: None,
            effects: BTreeMap::new(),
            ended_by: None,
            outcome: None,
            metrics: None,
            earlier: None,
        }))
    }
}
