//! The problem of any scenario: pieces of it, simulated far more finely than any setting that is tried.
//!
//! Contacts make a trajectory chaotic, so that after a while two simulations of it have nothing to do with each
//! other, however fine they are. Settings are therefore compared over short pieces, each started from the same
//! state (Erez, Tassa & Todorov 2015, "Simulation tools for model-based robotics"). The states come from one
//! simulation of the whole scenario; the truth of each piece from a far finer simulation of that piece alone,
//! which makes it affordable.

use std::sync::Arc;

use super::engine::Engine;
use super::fault::{LeftOutReason, StudyError};
use super::measure::Measure;
use super::problem::{AccuracyProblem, Piece};
use super::settings::TrialSettings;
use super::truth::{OtherTruth, Truth};
use crate::scenario::ScenarioSetup;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::Playing;
use gaitwright_physics::scene::{Accuracy, Integrator, SolverChoice, SolverKind};
use gaitwright_physics::sim::{Simulator, State};

/// How a scenario is cut into pieces, and how finely their true ends are computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pieces {
    /// Greatest number of pieces, evenly spread.
    pub count: usize,
    /// Greatest time from the scenario's start over which they are spread, s.
    pub span: f64,
    /// Length of a piece, s; the whole scenario when that is shorter.
    pub length: f64,
    /// Finest step of the settings to be tried, s. The states at which pieces start are computed with it.
    pub finest: f64,
    /// How many times finer the reference is.
    pub finer: f64,
}

impl Default for Pieces {
    fn default() -> Self {
        Self { count: 12, span: 60.0, length: 0.064, finest: 1.25e-4, finer: 64.0 }
    }
}

/// Shortest step of a reference, s: below it rounding errors exceed the remaining error of the method.
const SHORTEST: f64 = 2e-7;

/// Cuts `setup` into pieces and computes their true ends; `None` when `stop` returns true before that is
/// done.
///
/// # Errors
/// Every fault of the scene and the drive; a scenario that cannot be simulated even at the finest setting.
pub fn reference(
    setup: &ScenarioSetup,
    pieces: &Pieces,
    stop: &dyn Fn() -> bool,
) -> Result<Option<(AccuracyProblem, Truth)>, StudyError> {
    let span = setup.duration.min(pieces.span);
    let interval = pieces.length.min(span);
    let count = ((span / interval) as usize).clamp(1, pieces.count.max(1));
    let apart = (span - interval) / (count - 1).max(1) as f64;

    let mut path = ReferenceRun::new(setup, finely(pieces.finest))?;
    let mut starts = vec![setup.start.clone()];
    let mut playing = setup.script.playing(&setup.start.root);
    for _ in 1..count {
        if !path.advance((apart / pieces.finest).round() as usize, &mut playing, stop)? {
            return Ok(None);
        }
        starts.push(path.simulator.state().clone());
    }

    // The difference from the same at twice the step is the uncertainty of the reference itself.
    let step = (pieces.finest / pieces.finer).max(SHORTEST);
    let coarse_steps = (0.5 * interval / step).ceil().max(1.0);
    let accuracy = finely(0.5 * interval / coarse_steps);
    let mut fine = ReferenceRun::new(setup, accuracy)?;
    let mut coarser = ReferenceRun::new(setup, finely(2.0 * accuracy.step))?;
    let steps = [2, 1].map(|times| times * coarse_steps as usize);
    let mut uncertainty = 0.0;
    let mut cut = Vec::with_capacity(count);
    for start in starts {
        for (run, steps) in [&mut fine, &mut coarser].into_iter().zip(steps) {
            run.simulator.set_state(&start);
            // No feedback: what is compared starts in the middle of its motion.
            if !run.advance(steps, &mut None, stop)? {
                return Ok(None);
            }
        }
        let end = fine.simulator.state().clone();
        let apart = (Measure::DISPLACEMENT.of)(&setup.model, coarser.simulator.state(), &end);
        uncertainty += apart / count as f64;
        cut.push(Piece { start, marks: vec![end] });
    }
    let because = format!(
        "{count} pieces of {interval} s, spread over {span} s, each started from the state that the scenario \
         reaches with steps of {} s, and simulated with steps of {:e} s",
        pieces.finest, accuracy.step
    );
    let truth = Truth { because, accuracy: Some(accuracy), uncertainty: Some(uncertainty) };
    Ok(Some((
        AccuracyProblem { setup: setup.clone(), measure: Measure::DISPLACEMENT, interval, pieces: cut },
        truth,
    )))
}

/// `problem` with the ends that `engine` itself gives its pieces at a step of `step` seconds, and how that truth compares
/// with the one before; `None` when `stop` returns true before they are computed.
///
/// # Errors
/// Why the engine cannot simulate it.
pub(super) fn reference_by(
    engine: Engine,
    problem: &AccuracyProblem,
    step: f64,
    stop: &dyn Fn() -> bool,
) -> Result<Option<(AccuracyProblem, OtherTruth)>, LeftOutReason> {
    let at = |step| TrialSettings { engine, accuracy: Accuracy { step, ..Accuracy::default() } };
    let Some(coarser) = problem.ends(&at(2.0 * step), stop)? else { return Ok(None) };
    let Some(fine) = problem.ends(&at(step), stop)? else { return Ok(None) };
    let mut own = problem.clone();
    for (piece, marks) in own.pieces.iter_mut().zip(fine) {
        piece.marks = marks;
    }
    let model = &problem.setup.model;
    let mean = |others: &mut dyn Iterator<Item = &State>| {
        let errors = own.states().zip(others).map(|(state, other)| (problem.measure.of)(model, other, state));
        errors.sum::<f64>() / problem.marks() as f64
    };
    let uncertainty = mean(&mut coarser.iter().flatten());
    let apart = mean(&mut problem.states());
    Ok(Some((own, OtherTruth { engine, step, uncertainty, apart })))
}

/// The most exact setting with this step (s).
fn finely(step: f64) -> Accuracy {
    let solver = SolverChoice { kind: SolverKind::Newton, iterations: 200, tolerance: 1e-12 };
    let second = Accuracy { step, solver, integrator: Integrator::MoreauJean, ..Accuracy::default() };
    if second.faults().is_empty() {
        second
    } else {
        Accuracy { integrator: Integrator::SemiImplicitEuler, ..second }
    }
}

/// A simulation of a scenario, advanced piece by piece.
struct ReferenceRun<'a> {
    setup: &'a ScenarioSetup,
    simulator: Simulator,
    /// s.
    step: f64,
    /// Targets at the beginning and at the end of a step, rad or m, one a joint.
    now: Vec<f64>,
    next: Vec<f64>,
}

impl<'a> ReferenceRun<'a> {
    fn new(setup: &'a ScenarioSetup, accuracy: Accuracy) -> Result<Self, InputError> {
        let plan = Arc::new(setup.plan(&accuracy)?);
        let targets = vec![0.0; setup.model.joint_count()];
        let simulator = Simulator::new(plan, setup.start.clone());
        Ok(Self { setup, simulator, step: accuracy.step, now: targets.clone(), next: targets })
    }

    /// Takes `steps` steps from the present state, with the feedback of what is `playing`; whether they were all taken before `stop`
    /// returned true.
    fn advance(
        &mut self,
        steps: usize,
        playing: &mut Option<Playing>,
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, StudyError> {
        let (script, start) = (&self.setup.script, self.simulator.state().time);
        script.steered_targets(playing, start, &self.simulator.state().root, &mut self.next);
        for index in 1..=steps {
            std::mem::swap(&mut self.now, &mut self.next);
            let (time, root) = (start + index as f64 * self.step, self.simulator.state().root);
            script.steered_targets(playing, time, &root, &mut self.next);
            self.simulator.step(script.command(&self.now, &self.next)).map_err(StudyError::BrokenOff)?;
            if stop() {
                return Ok(false);
            }
        }
        Ok(!stop())
    }
}
