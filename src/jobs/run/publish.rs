//! What a run leaves behind when it has learned: motion, gait, curve, report, the end of the recording.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::RunError;
use super::perform::CheckedMotion;
use super::prepared::PreparedRun;
use crate::export::{Curve, Performance, Recording, gait_diagram, motion};
use crate::jobs::check::{Standing, standing};
use crate::jobs::files::Artefact;
use crate::jobs::job::CharacterName;
use crate::jobs::order::Order;
use crate::jobs::request::Settings;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::learn::{Behaviour, Cancel, Learned, Learning, StopReason};
use gaitwright_physics::character::Note;
use gaitwright_physics::motion::{Metrics, Motion, Provenance};
use gaitwright_physics::playback::Trace;
use gaitwright_physics::scene::{AccuracyChoice, Decision, Effect};

/// The format of a report.
const FORMAT: &str = "gaitwright/report@1";

/// Time between two samples of a recorded motion, s.
pub(super) const RECORDED: f64 = 0.02;

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
    /// What was asked for, with the values used in place of those left open.
    #[serde(flatten)]
    pub settings: Settings,
    /// Why the accuracy used was chosen, where a tolerance was asked for.
    #[serde(default)]
    pub accuracy_choice: Option<AccuracyChoice>,
    /// Every effect, whether it was simulated, and why.
    pub effects: BTreeMap<Effect, Decision>,
    /// Why the learning stopped.
    pub ended_by: StopReason,
    /// Whether the same job gives the same motion again: not when the clock or somebody ended it.
    pub reproducible: bool,
    /// Generations evaluated.
    pub generations: u32,
    /// Fitness of the published behaviour, m/s along the task's direction less its costs.
    pub fitness: Option<f64>,
    /// Simulated seconds of the learning.
    pub simulated_seconds: f64,
    /// Simulated seconds saved by the cache.
    pub saved_seconds: f64,
    /// Share of the transitions that came from the cache, 0 to 1.
    pub cache_hit_rate: f64,
    /// Figures of the motion found.
    pub metrics: Option<Metrics>,
    /// Its gait.
    pub gait: Option<GaitReport>,
    /// Why there is no motion.
    pub unsuccessful: Option<String>,
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOutcome {
    /// Why the learning stopped.
    pub ended: StopReason,
    /// Figures of the motion found, or why there is none.
    pub motion: Result<Metrics, Unsuccessful>,
    /// s of the wall clock spent checking and writing.
    pub checking_seconds: f64,
}

/// Why a run that came to its end has no motion to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsuccessful {
    /// It was cancelled while the standing pose or an accuracy was looked for.
    #[error("called off before the learning began")]
    NotBegun,
    /// No behaviour passed the learner's acceptance test.
    #[error("nothing was learned that keeps the character upright; more time or generations may help")]
    NothingLearned,
    /// It was cancelled, and the check took longer than it may then take.
    #[error("called off before it was checked what was learned")]
    NotChecked,
    /// The character fell in the check.
    #[error("the character fell before it had gone round its loop once")]
    Fell,
    /// It stayed where it was, or went the other way.
    #[error(
        "the character does not travel along the direction that was asked for; more time or generations may help"
    )]
    DoesNotTravel,
}

/// How long a run that is cancelled may still take to check what it found.
pub(super) struct CancelLimit<'a> {
    cancel: &'a Cancel,
    longest: Duration,
    /// When the cancellation was first noticed.
    since: OnceLock<Instant>,
}

impl<'a> CancelLimit<'a> {
    /// On `cancel`, and at most `longest`.
    pub(super) fn new(cancel: &'a Cancel, longest: Duration) -> Self {
        Self { cancel, longest, since: OnceLock::new() }
    }

    /// Whether the run was cancelled.
    fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// Whether that was too long ago.
    fn is_over(&self) -> bool {
        self.is_cancelled() && self.since.get_or_init(Instant::now).elapsed() >= self.longest
    }
}

/// Checks what was learned, and writes everything that is to be left in `folder`.
pub(super) fn publish(
    order: &Order,
    prepared: &PreparedRun,
    learned: &Learned,
    mut recording: Recording,
    folder: &Path,
    limit: &CancelLimit<'_>,
) -> Result<RunOutcome, RunError> {
    let start = Instant::now();
    Artefact::Curve.publish(folder, Curve::new(&learned.curve).to_csv().as_bytes())?;
    let found = match &learned.best {
        None => Err(Unsuccessful::NothingLearned),
        Some(behaviour) => {
            let player = prepared.player(behaviour);
            let check = prepared.motion_check(&player);
            let mut checked = check.run(&|| limit.is_over())?;
            if limit.is_over() {
                Err(Unsuccessful::NotChecked)
            } else {
                if checked.travels && !limit.is_cancelled() {
                    let threads = prepared.setup.threads;
                    checked.validity.trials =
                        check.trials(&checked.trace, threads, &|| limit.is_cancelled())?;
                }
                recording.motion(behaviour.generation, &thinned(&checked.trace))?;
                let motion = document(order, prepared, behaviour, &checked);
                let motion = motion.ok_or(Unsuccessful::Fell);
                let travels = checked.travels.then_some(checked.gait).ok_or(Unsuccessful::DoesNotTravel);
                motion.and_then(|motion| Ok((motion, travels?)))
            }
        }
    };
    if let Ok((motion, gait)) = &found {
        Artefact::Motion.publish(folder, motion.to_json()?.as_bytes())?;
        Artefact::Gait.publish(folder, &json(gait)?)?;
        Artefact::Diagram.publish(folder, gait_diagram(gait)?.as_bytes())?;
    } else {
        // Those of an earlier run of the same job.
        for artefact in [Artefact::Motion, Artefact::Gait, Artefact::Diagram] {
            artefact.remove(folder)?;
        }
    }
    let (motion, gait) = match found {
        Ok((motion, gait)) => (Ok(motion.metrics), Some(gait)),
        Err(reason) => (Err(reason), None),
    };
    let report = report(order, prepared, learned, &motion, gait);
    Artefact::Report.publish(folder, &json(&report)?)?;
    recording.job(&describe(order, prepared, Some(&report)))?;
    recording.finish()?;
    let checking_seconds = start.elapsed().as_secs_f64();
    Ok(RunOutcome { ended: learned.ended, motion, checking_seconds })
}

fn document(
    order: &Order,
    prepared: &PreparedRun,
    behaviour: &Behaviour,
    checked: &CheckedMotion,
) -> Option<Motion> {
    let setup = &prepared.setup;
    let value = |value: Result<serde_json::Value, serde_json::Error>| value.unwrap_or_default();
    let provenance = Provenance {
        program: env!("CARGO_PKG_NAME").to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        seed: Some(setup.seed),
        learning: value(serde_json::to_value(Learning::from(&setup.parameters))),
        task: value(serde_json::to_value(&setup.task)),
        accuracy: setup.accuracy,
        effects: prepared.plan.decisions.clone(),
    };
    motion(&Performance {
        character: &order.reading.character,
        joints: &setup.model.joint_names,
        standing: &setup.stance.angles,
        behaviour,
        trace: &checked.trace,
        gait: &checked.gait,
        validity: &checked.validity,
        scene: &setup.scene,
        drive: &setup.stance.gains,
        provenance: &provenance,
    })
}

fn report(
    order: &Order,
    prepared: &PreparedRun,
    learned: &Learned,
    motion: &Result<Metrics, Unsuccessful>,
    gait: Option<GaitReport>,
) -> TrainingReport {
    let (character, setup) = (&order.reading.character, &prepared.setup);
    let last = learned.curve.last();
    TrainingReport {
        format: FORMAT.to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        character: CharacterName { name: character.name.clone(), digest: character.digest.clone() },
        notes: order.reading.notes.clone(),
        standing: standing(&setup.model, &setup.stance),
        settings: Settings {
            learning: Learning::from(&setup.parameters),
            accuracy: setup.accuracy.into(),
            ..order.settings.clone()
        },
        accuracy_choice: prepared.accuracy_choice.clone(),
        effects: prepared.plan.decisions.clone(),
        ended_by: learned.ended,
        reproducible: learned.ended == StopReason::Generations,
        generations: last.map_or(0, |figures| figures.generation + 1),
        fitness: learned.best.as_ref().map(|behaviour| behaviour.fitness),
        simulated_seconds: last.map_or(0.0, |figures| figures.simulated_seconds),
        saved_seconds: last.map_or(0.0, |figures| figures.saved_seconds),
        cache_hit_rate: last.map_or(0.0, |figures| figures.cache_hit_rate),
        metrics: motion.as_ref().ok().cloned(),
        gait,
        unsuccessful: motion.as_ref().err().map(Unsuccessful::to_string),
    }
}

/// The trace with samples as far apart as a viewer needs them.
fn thinned(trace: &Trace) -> Trace {
    let interval = match trace.samples.as_slice() {
        [first, second, ..] => second.time - first.time,
        _ => RECORDED,
    };
    let stride = (RECORDED / interval).round().max(1.0) as usize;
    Trace { samples: trace.samples.iter().step_by(stride).cloned().collect(), ..trace.clone() }
}

/// What a job is about, and what came of it once there is a report, as Markdown.
pub(super) fn describe(order: &Order, prepared: &PreparedRun, report: Option<&TrainingReport>) -> String {
    let (character, setup) = (&order.reading.character, &prepared.setup);
    let mut text = format!("# {}\n\n", character.name);
    if let Some(report) = report {
        text += &outcome(report);
    }
    let time = 1000.0 * setup.parameters.transition_time;
    text += &format!(
        "{:.2} kg, {} joints, seed {}, transitions of {time:.0} ms\n\n| effect | | because |\n|---|---|---|\n",
        setup.model.mass,
        setup.model.joint_count(),
        setup.seed,
    );
    for (effect, decision) in &prepared.plan.decisions {
        let state = if decision.on { "on" } else { "off" };
        text += &format!("| {} | {state} | {} |\n", effect.name(), decision.because);
    }
    text
}

fn outcome(report: &TrainingReport) -> String {
    match (&report.metrics, &report.unsuccessful) {
        (Some(metrics), _) => format!(
            "**{:.2} m/s**, upright for {:.1} s, gait {}, after {} generations\n\n",
            metrics.speed,
            metrics.upright_seconds,
            metrics.gait.as_deref().unwrap_or("without a name"),
            report.generations,
        ),
        (None, Some(reason)) => format!("{reason}\n\n"),
        (None, None) => String::new(),
    }
}

fn json<T: Serialize>(document: &T) -> Result<Vec<u8>, RunError> {
    Ok(serde_json::to_vec_pretty(document).map_err(std::io::Error::from)?)
}
