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
use gaitwright_learning::learn::{Generation, Learning, StopReason};
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
    /// Why the learning stopped; `null` while it goes on.
    pub ended_by: Option<StopReason>,
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
    /// Why there is no motion; `null` also while the learning goes on.
    pub unsuccessful: Option<String>,
}

/// How far a run has come.
pub(super) struct Reached<'a> {
    /// Why the learning stopped, once it has.
    pub(super) ended: Option<StopReason>,
    /// The last point of its curve.
    pub(super) last: Option<&'a Generation>,
    /// What became of the tolerance that was asked for.
    pub(super) accuracy_check: Option<&'a AccuracyCheck>,
}

/// The report of a run.
pub(super) fn report(
    (order, prepared): (&Order, &PreparedRun),
    shelved: &Shelved,
    reached: Reached<'_>,
) -> TrainingReport {
    let (character, setup) = (&order.reading.character, &prepared.setup);
    let Reached { ended, last, accuracy_check } = reached;
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
        ended_by: ended,
        reproducible: matches!(ended, Some(StopReason::Generations | StopReason::Complete)),
        generations: last.map_or(0, |figures| figures.generation + 1),
        fitness: shelved.fitness(),
        simulated_seconds: last.map_or(0.0, |figures| figures.simulated_seconds),
        saved_seconds: last.map_or(0.0, |figures| figures.saved_seconds),
        cache_hit_rate: last.map_or(0.0, |figures| figures.cache_hit_rate),
        motions: shelved.repertoire().motions.clone(),
        unsuccessful: outcome.as_ref().err().filter(|_| ended.is_some()).map(ToString::to_string),
        metrics: outcome.ok(),
        gait: shelved.gait().cloned(),
    }
}
