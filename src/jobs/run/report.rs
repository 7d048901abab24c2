//! The report of a run: everything about a job and what came of it.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::prepared::PreparedRun;
use super::shelve::Shelved;
use crate::jobs::check::{Standing, standing};
use crate::jobs::job::CharacterName;
use crate::jobs::order::Order;
use crate::jobs::repertoire::RepertoireEntry;
use crate::jobs::request::Settings;
use crate::jobs::teaching::Teaching;
use gaitwright_learning::accuracy::AccuracyCheck;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::learn::{Learning, StopReason};
use gaitwright_learning::training::Trained;
use gaitwright_physics::character::Note;
use gaitwright_physics::motion::Metrics;
use gaitwright_physics::scene::{AccuracyChoice, Decision, Effect};

/// The format of a report.
const FORMAT: &str = "gaitwright/report@1";

/// Everything about a job and what came of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Report")]
pub struct TrainingReport {
    /// `gaitwright/report@1`.
    pub format: String,
    /// Version of the program.
    pub version: String,
    /// Name and digest of the character.
    pub character: CharacterName,
    /// Everything repaired, approximated or ignored in the character.
    pub notes: Vec<Note>,
    /// How the character stands.
    pub standing: Standing,
    /// How a character that stands so is taught; `null` in a report of an earlier version.
    #[serde(default)]
    pub teaching: Option<Teaching>,
    /// What was asked for, with the values used in place of those left open.
    #[serde(flatten)]
    pub settings: Settings,
    /// Why the accuracy used was chosen, where a tolerance was asked for.
    #[serde(default)]
    pub accuracy_choice: Option<AccuracyChoice>,
    /// What became of that tolerance on the job's motion; `null` also where nothing was learned.
    #[serde(default)]
    pub accuracy_check: Option<AccuracyCheck>,
    /// Every effect, whether it was simulated, and why.
    pub effects: BTreeMap<Effect, Decision>,
    /// Why the learning stopped.
    pub ended_by: StopReason,
    /// Whether the same job gives the same motion again: not when the clock or somebody ended it.
    pub reproducible: bool,
    /// Generations evaluated.
    pub generations: u32,
    /// Fitness of the job's motion (see the learning curve).
    pub fitness: Option<f64>,
    /// Simulated seconds of the learning.
    pub simulated_seconds: f64,
    /// Simulated seconds saved by the cache.
    pub saved_seconds: f64,
    /// Share of the transitions that came from the cache, 0 to 1.
    pub cache_hit_rate: f64,
    /// Every motion that was learned, in figures.
    #[serde(default)]
    pub motions: Vec<RepertoireEntry>,
    /// Figures of the one that is the job's motion.
    pub metrics: Option<Metrics>,
    /// Its gait.
    pub gait: Option<GaitReport>,
    /// Why there is no motion.
    pub unsuccessful: Option<String>,
}

/// The report of a run that has trained.
pub(super) fn report(
    order: &Order,
    prepared: &PreparedRun,
    trained: &Trained,
    shelved: &Shelved,
    accuracy_check: Option<&AccuracyCheck>,
) -> TrainingReport {
    let (character, setup) = (&order.reading.character, &prepared.setup);
    let last = trained.curve.last();
    let outcome = shelved.outcome();
    TrainingReport {
        format: FORMAT.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        character: CharacterName { name: character.name.clone(), digest: character.digest.clone() },
        notes: order.reading.notes.clone(),
        standing: standing(&setup.model, &setup.stance),
        teaching: Some(prepared.teaching()),
        settings: Settings {
            learning: Learning::from(&setup.parameters),
            accuracy: setup.accuracy.into(),
            ..order.settings.clone()
        },
        accuracy_choice: prepared.accuracy_choice.clone(),
        accuracy_check: accuracy_check.cloned(),
        effects: prepared.plan.decisions.clone(),
        ended_by: trained.ended,
        reproducible: matches!(trained.ended, StopReason::Generations | StopReason::Complete),
        generations: last.map_or(0, |figures| figures.generation + 1),
        fitness: shelved.fitness(),
        simulated_seconds: last.map_or(0.0, |figures| figures.simulated_seconds),
        saved_seconds: last.map_or(0.0, |figures| figures.saved_seconds),
        cache_hit_rate: last.map_or(0.0, |figures| figures.cache_hit_rate),
        motions: shelved.repertoire().motions.clone(),
        unsuccessful: outcome.as_ref().err().map(ToString::to_string),
        metrics: outcome.ok(),
        gait: shelved.gait().cloned(),
    }
}
