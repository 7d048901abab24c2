//! The cheapest settings for a tolerance, chosen by a short study of the very scenario that asks for them.
//!
//! The choice must not depend on how busy the machine is, or the same job would not give the same motion twice.
//! Settings are therefore compared by work, not by computing time: by how often new velocities are computed for a
//! simulated second. A setting that leaves a step of them unsolved is not chosen, whatever its error.

use std::sync::Arc;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::engine::Engine;
use super::fault::StudyError;
use super::figures::{Figures, TrialOutcome};
use super::reference::{Pieces, reference};
use super::settings::TrialSettings;
use super::spread::ErrorSpread;
use super::truth::Truth;
use crate::scenario::{Files, PreparedScenario, Scenario, ScenarioSetup, Script};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{Body, DofKind, Model};
use gaitwright_physics::motion::{Player, TargetLimits, shape};
use gaitwright_physics::scene::{Accuracy, AccuracyChoice, AskedAccuracy, Integrator, Scene, usual_step};
use gaitwright_physics::stance::Stance;

/// The steps to choose from, in usual steps of the character ([`usual_step`]), the longest first.
const STEPS: [f64; 6] = [4.0, 2.0, 1.0, 0.5, 0.25, AskedAccuracy::FINEST];

/// The tolerance that goes with each of them under error control, rad or m.
const STEP_TOLERANCES: [f64; 6] = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];

/// How the scenario is cut into the pieces that the settings are tried on, with times in usual steps.
const PIECES: Pieces =
    Pieces { count: 6, span: 2000.0, length: 32.0, finest: AskedAccuracy::FINEST, finer: 32.0 };

/// How far the joints sway to either side in the motion of [`swaying`], rad or sizes of the character, for how long each time, and
/// for how long in all, in usual steps.
const SWAY: f64 = 0.1;
const SWAY_TIME: f64 = 125.0;
const SWAYING: f64 = 1000.0;

/// The settings for what `setup` asks for: those asked for, or the cheapest within the tolerance asked for, with
/// the reason. `None` when `stop` returns true before they are found.
///
/// # Errors
/// Every fault of the scene and the drive; a scenario that cannot be simulated even at the finest setting; a
/// tolerance that nothing here can keep.
pub fn settle(
    setup: &ScenarioSetup,
    asked: &AskedAccuracy,
    stop: &dyn Fn() -> bool,
) -> Result<Option<(Accuracy, Option<AccuracyChoice>)>, StudyError> {
    let tolerance = match *asked {
        AskedAccuracy::Tolerance(tolerance) => tolerance,
        AskedAccuracy::Settings(_) | AskedAccuracy::StepBySize(_) => {
            return Ok(asked.settings(setup.model.size).map(|accuracy| (accuracy, None)));
        }
    };
    let step = usual_step(setup.model.size);
    let Some((problem, truth)) = reference(setup, &pieces(step), stop)? else { return Ok(None) };
    let mut most_exact = f64::INFINITY;
    let mut cheapest: Option<(f64, Accuracy, f64)> = None;
    for accuracy in candidates(step) {
        let settings = TrialSettings { engine: Engine::Gaitwright, accuracy };
        let Some(outcome) = problem.try_out(&settings, 0, stop) else { return Ok(None) };
        let TrialOutcome::Measured(figures) = outcome else { continue };
        let Figures { error, evaluations: Some(work), .. } = figures else { continue };
        if !figures.is_solved() {
            continue;
        }
        most_exact = most_exact.min(error);
        if error <= tolerance && cheapest.is_none_or(|(least, _, own)| (work, error) < (least, own)) {
            cheapest = Some((work, accuracy, error));
        }
    }
    let certain = truth.uncertainty.is_none_or(|uncertainty| uncertainty <= tolerance);
    match cheapest.filter(|_| certain) {
        Some((work, accuracy, error)) => {
            let because = because(&truth, step, work);
            Ok(Some((accuracy, Some(AccuracyChoice { tolerance, error, because }))))
        }
        None => Err(out_of_reach(most_exact, &truth).into()),
    }
}

/// What became of a tolerance on the motion that was learned with the settings chosen for it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracyCheck {
    /// The tolerance asked for, m.
    pub tolerance: f64,
    /// Mean error of the settings on pieces of the learned motion, m; `null` where the simulation broke off.
    pub error: Option<f64>,
    /// How the errors are spread over the pieces, m.
    pub spread: Option<ErrorSpread>,
    /// Whether the mean error is within the tolerance, and every step was solved.
    pub holds: bool,
    /// What it was tried on, and what came of it.
    pub because: String,
}

/// Tries `accuracy`, which was chosen for `tolerance` (m) on another motion, on that of `setup`; `None` when `stop`
/// returns true before that is done.
///
/// # Errors
/// Every fault of the scene and the drive.
pub fn check(
    setup: &ScenarioSetup,
    accuracy: &Accuracy,
    tolerance: f64,
    stop: &dyn Fn() -> bool,
) -> Result<Option<AccuracyCheck>, InputError> {
    let without = |because| AccuracyCheck { tolerance, error: None, spread: None, holds: false, because };
    let pieces = Pieces { span: setup.duration, ..pieces(usual_step(setup.model.size)) };
    let (problem, truth) = match reference(setup, &pieces, stop) {
        Ok(Some(found)) => found,
        Ok(None) => return Ok(None),
        Err(StudyError::Input(error)) => return Err(error),
        Err(error @ StudyError::BrokenOff(_)) => return Ok(Some(without(error.to_string()))),
    };
    let settings = TrialSettings { engine: Engine::Gaitwright, accuracy: *accuracy };
    Ok(problem.try_out(&settings, 0, stop).map(|outcome| match outcome {
        TrialOutcome::Measured(figures) => {
            let mut because = format!("tried on the motion that was learned: {}", truth.because);
            if let Some(unsolved @ 1..) = figures.unsolved_steps {
                because.push_str(&format!("; {unsolved} steps were left unsolved"));
            }
            AccuracyCheck {
                tolerance,
                error: Some(figures.error),
                holds: figures.error <= tolerance && figures.is_solved(),
                spread: Some(figures.spread),
                because,
            }
        }
        TrialOutcome::Diverged(divergence) => without(divergence.to_string()),
        TrialOutcome::LeftOut(reason) => without(reason.to_string()),
    }))
}

/// [`PIECES`] of a character with this usual `step`, s.
fn pieces(step: f64) -> Pieces {
    let Pieces { span, length, finest, .. } = PIECES;
    Pieces { span: span * step, length: length * step, finest: finest * step, ..PIECES }
}

/// The settings to choose from for a character with this `usual` step, s.
fn candidates(usual: f64) -> impl Iterator<Item = Accuracy> {
    let methods = [Integrator::SemiImplicitEuler, Integrator::MoreauJean];
    let whole = move |step| Accuracy { step: step * usual, ..Accuracy::default() };
    let divided = move |(step, tolerance)| Accuracy { step_tolerance: Some(tolerance), ..whole(step) };
    let controlled = STEPS.into_iter().zip(STEP_TOLERANCES).map(divided);
    let settings = STEPS.into_iter().map(whole).chain(controlled);
    let with = move |settings| methods.map(|integrator| Accuracy { integrator, ..settings });
    settings.flat_map(with).filter(|accuracy| accuracy.faults().is_empty())
}

fn because(truth: &Truth, step: f64, work: f64) -> String {
    format!(
        "of both methods of integration, at steps from {} to {} s and under error control, this takes the least \
         work within the tolerance: {work:.0} evaluations for a simulated second; tried on this very scene: {}",
        STEPS[0] * step,
        STEPS[5] * step,
        truth.because,
    )
}

fn out_of_reach(most_exact: f64, truth: &Truth) -> InputError {
    let known = truth.uncertainty.unwrap_or(0.0);
    let reason = format!(
        "no setting to choose from keeps this tolerance: the most exact errs by {most_exact:.1e} m, and the \
         reference is certain to {known:.1e} m; give the settings themselves"
    );
    InputError::impossible("/accuracy/tolerance", reason)
}

/// Makes a scenario ready to run, its settings chosen first where it asks for a tolerance.
///
/// # Errors
/// Those of [`Scenario::set_up`] and of [`settle`].
pub fn prepare(scenario: &Scenario, files: &impl Files) -> Result<PreparedScenario, StudyError> {
    prepare_until(scenario, files, &|| false)
}

/// The same until `stop` returns true: settings that have not been chosen by then have their defaults.
///
/// # Errors
/// As [`prepare`].
pub fn prepare_until(
    scenario: &Scenario,
    files: &impl Files,
    stop: &dyn Fn() -> bool,
) -> Result<PreparedScenario, StudyError> {
    let setup = scenario.set_up(files)?;
    let settled = settle(&setup, &scenario.accuracy, stop)?;
    let (accuracy, choice) = settled.unwrap_or_default();
    Ok(PreparedScenario::new(setup, &accuracy, choice, scenario.sample_every)?)
}

/// A character that stands in `scene` and sways in every joint: a motion on which settings can be tried before the
/// character has learned any.
pub fn swaying(model: &Arc<Model>, stance: &Stance, scene: &Scene) -> ScenarioSetup {
    let leaning_to = |sign: f64| -> Vec<f64> {
        let leaning = |((angle, limit), body): ((&f64, &Option<[f64; 2]>), &Body)| {
            let sway = match body.dof {
                DofKind::Revolute => SWAY,
                DofKind::Prismatic => SWAY * model.size,
            };
            let target = angle + sign * sway;
            limit.map_or(target, |[lower, upper]| target.max(lower).min(upper))
        };
        stance.angles.iter().zip(&model.limits).zip(&model.bodies[1..]).map(leaning).collect()
    };
    let mut postures = [leaning_to(1.0), leaning_to(-1.0)].map(|angles| {
        let rest = vec![0.0; angles.len()];
        (angles, rest)
    });
    let mut shaped: Vec<_> =
        postures.iter_mut().map(|(angles, rates)| (angles.as_mut_slice(), rates.as_mut_slice())).collect();
    let limits = TargetLimits::of(&model.character);
    let step = usual_step(model.size);
    let time = shape(&stance.angles, &mut shaped, 0, SWAY_TIME * step, &limits);
    let cycle = postures.iter().map(|(angles, rates)| (angles.as_slice(), rates.as_slice()));
    let player = Player::from_postures(&stance.angles, [], cycle, time);
    ScenarioSetup {
        model: model.clone(),
        scene: scene.clone(),
        gains: Some(stance.gains.clone()),
        start: stance.state.clone(),
        script: Script::Track(player),
        duration: SWAYING * step,
    }
}
