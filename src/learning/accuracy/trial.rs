//! One setting tried on a problem.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::fault::{Divergence, LeftOutReason};
use super::figures::{Figures, TrialOutcome};
use super::problem::{AccuracyProblem, Piece};
use super::rapier::Unsupported;
use super::settings::TrialSettings;
use super::spread::ErrorSpread;
use super::stepper::Stepper;
use gaitwright_physics::scene::StepPlan;
use gaitwright_physics::sim::{Failure, State, energy, momentum};

/// An error beyond this, in m or rad, is no inaccuracy any more: the simulation has diverged.
const LOST: f64 = 100.0;

/// Trials that compute new velocities more often than this for a simulated second are broken off, 1/s.
const MOST_EVALUATIONS: u64 = 50_000;

impl AccuracyProblem {
    /// Simulates every piece with `settings`, timed `repeats` times (not at all for 0); `None` when `stop` returns
    /// true before that is done.
    pub fn try_out(
        &self,
        settings: &TrialSettings,
        repeats: u32,
        stop: &dyn Fn() -> bool,
    ) -> Option<TrialOutcome> {
        let plan = match self.setup.plan(&self.divided(&settings.accuracy)) {
            Ok(plan) => Arc::new(plan),
            Err(error) => return Some(TrialOutcome::LeftOut(LeftOutReason::Plan(error))),
        };
        let mut trial = match Trial::new(self, plan, settings) {
            Ok(trial) => trial,
            Err(missing) => return Some(TrialOutcome::LeftOut(missing.into())),
        };
        let mut sum = Sum::ZERO;
        let mut computing = Duration::ZERO;
        for piece in &self.pieces {
            trial.prepare_targets(piece);
            match trial.measure(piece, &mut sum, stop) {
                Ok(true) => {}
                Ok(false) => return None,
                Err(outcome) => return Some(*outcome),
            }
            let mut shortest = None;
            for _ in 0..repeats {
                match trial.time(piece, stop) {
                    Ok(None) => return None,
                    Ok(Some(time)) => shortest = Some(shortest.map_or(time, |own: Duration| own.min(time))),
                    Err(divergence) => return Some(TrialOutcome::Diverged(divergence)),
                }
            }
            computing += shortest.unwrap_or_default();
        }
        Some(TrialOutcome::Measured(sum.figures(self, computing)))
    }
}

impl AccuracyProblem {
    /// The states at the marks of every piece as `settings` give them, piece by piece; `None` when `stop` returns true
    /// before they are all there.
    ///
    /// # Errors
    /// Why the setting does not apply, or cannot be simulated.
    pub(super) fn ends(
        &self,
        settings: &TrialSettings,
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<Vec<Vec<State>>>, LeftOutReason> {
        let plan = Arc::new(self.setup.plan(&self.divided(&settings.accuracy)).map_err(LeftOutReason::Plan)?);
        let mut trial = Trial::new(self, plan, settings)?;
        let mut ends = Vec::with_capacity(self.pieces.len());
        for piece in &self.pieces {
            trial.prepare_targets(piece);
            trial.stepper.restart(&piece.start)?;
            let mut marks = Vec::with_capacity(piece.marks.len());
            for index in 0..trial.steps * piece.marks.len() {
                if stop() {
                    return Ok(None);
                }
                trial.step(index).map_err(|failure| LeftOutReason::NoReference(failure.into()))?;
                if (index + 1) % trial.steps == 0 {
                    marks.push(trial.stepper.state().clone());
                }
            }
            ends.push(marks);
        }
        Ok(Some(ends))
    }
}

/// A simulation of the pieces of a problem with one setting.
struct Trial<'a> {
    problem: &'a AccuracyProblem,
    plan: Arc<StepPlan>,
    stepper: Stepper,
    /// Number of steps from mark to mark.
    steps: usize,
    /// Targets at the beginning of every step of a piece and at the end of the last, rad or m: (steps + 1) × joints.
    targets: Vec<f64>,
}

impl<'a> Trial<'a> {
    fn new(
        problem: &'a AccuracyProblem,
        plan: Arc<StepPlan>,
        settings: &TrialSettings,
    ) -> Result<Self, Unsupported> {
        let stepper = Stepper::new(settings.engine, &problem.setup, &plan)?;
        let steps = problem.steps(settings.accuracy.step);
        Ok(Self { problem, plan, stepper, steps, targets: Vec::new() })
    }

    /// Fills `targets` for a piece, so that looking them up is not timed.
    fn prepare_targets(&mut self, piece: &Piece) {
        let (joints, step) = (self.problem.setup.model.joint_count(), self.plan.step());
        let count = self.steps * piece.marks.len() + 1;
        self.targets.resize(count * joints, 0.0);
        if joints == 0 {
            return;
        }
        for (index, targets) in self.targets.chunks_exact_mut(joints).enumerate() {
            self.problem.setup.script.targets(piece.start.time + index as f64 * step, targets);
        }
    }

    fn step(&mut self, index: usize) -> Result<(), Failure> {
        let joints = self.problem.setup.model.joint_count();
        let (now, next) = self.targets[index * joints..(index + 2) * joints].split_at(joints);
        self.stepper.step(self.problem.setup.script.command(now, next))
    }

    /// Simulates a piece, compares every mark with the truth and adds the figures to `sum`. Returns whether the end
    /// was reached before `stop` returned true.
    ///
    /// # Errors
    /// The outcome of the trial where it cannot be measured.
    fn measure(
        &mut self,
        piece: &Piece,
        sum: &mut Sum,
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, Box<TrialOutcome>> {
        self.stepper.restart(&piece.start).map_err(diverged)?;
        let before = self.stepper.unsolved_steps();
        let seconds = self.problem.interval * piece.marks.len() as f64;
        let allowed = (MOST_EVALUATIONS as f64 * seconds) as u64;
        let AccuracyProblem { setup, measure, .. } = self.problem;
        for (number, truth) in piece.marks.iter().enumerate() {
            for index in number * self.steps..(number + 1) * self.steps {
                if stop() {
                    return Ok(false);
                }
                self.step(index).map_err(diverged)?;
                sum.add_step(&self.stepper, &setup.model.limits);
                if self.stepper.evaluations().is_some_and(|count| count > allowed) {
                    let reason = LeftOutReason::TooCostly(MOST_EVALUATIONS);
                    return Err(Box::new(TrialOutcome::LeftOut(reason)));
                }
            }
            let state = self.stepper.state();
            let error = (measure.of)(&setup.model, state, truth);
            if error.is_nan() || error > LOST {
                return Err(diverged(Divergence::Lost { error, unit: measure.unit, time: truth.time }));
            }
            sum.errors.push(error);
            let total = |of| {
                let energy = energy(&setup.model, &self.plan, of);
                energy.kinetic + energy.potential
            };
            sum.energy += (total(state) - total(truth)).abs();
            let linear = |of| momentum(&setup.model, of).linear;
            sum.momentum += (linear(state) - linear(truth)).norm();
        }
        let unsolved = self.stepper.unsolved_steps().zip(before).map(|(after, before)| after - before);
        sum.unsolved = sum.unsolved.zip(unsolved).map(|(sum, own)| sum + own);
        sum.evaluations = sum.evaluations.zip(self.stepper.evaluations()).map(|(sum, own)| sum + own);
        Ok(true)
    }

    /// Computing time of the steps of a piece; `None` when `stop` returns true before its end.
    fn time(&mut self, piece: &Piece, stop: &dyn Fn() -> bool) -> Result<Option<Duration>, Divergence> {
        self.stepper.restart(&piece.start)?;
        let steps = self.steps * piece.marks.len();
        let started = Instant::now();
        for index in 0..steps {
            // Reads a flag, which takes no time beside a step.
            if stop() {
                return Ok(None);
            }
            self.step(index)?;
        }
        Ok(Some(started.elapsed()))
    }
}

fn diverged(cause: impl Into<Divergence>) -> Box<TrialOutcome> {
    Box::new(TrialOutcome::Diverged(cause.into()))
}

/// Sums and extremes over the pieces, in the units of [`Figures`].
struct Sum {
    /// One a mark.
    errors: Vec<f64>,
    energy: f64,
    momentum: f64,
    evaluations: Option<u64>,
    penetration: Option<f64>,
    overshoot: f64,
    separation: Option<f64>,
    residual: Option<f64>,
    unsolved: Option<u64>,
}

impl Sum {
    const ZERO: Self = Self {
        errors: Vec::new(),
        energy: 0.0,
        momentum: 0.0,
        evaluations: Some(0),
        penetration: None,
        overshoot: 0.0,
        separation: None,
        residual: None,
        unsolved: Some(0),
    };

    /// Adds the extremes of the last step, of which its state alone does not tell.
    fn add_step(&mut self, stepper: &Stepper, limits: &[Option<[f64; 2]>]) {
        let outside = |(limit, angle): (&Option<[f64; 2]>, &f64)| {
            limit.map_or(0.0, |[lower, upper]| (lower - angle).max(angle - upper))
        };
        let overshoot = limits.iter().zip(&stepper.state().angles).map(outside);
        self.overshoot = overshoot.fold(self.overshoot, f64::max);
        let Some(simulator) = stepper.own() else { return };
        let depth = simulator.contacts().map(|contact| contact.depth).fold(0.0, f64::max);
        let greater = |sum: &mut Option<f64>, value: f64| *sum = Some(sum.unwrap_or(0.0).max(value));
        greater(&mut self.penetration, depth);
        greater(&mut self.separation, simulator.joint_separation());
        greater(&mut self.residual, simulator.residual());
    }

    /// The figures of a trial whose steps took `computing` altogether.
    fn figures(self, problem: &AccuracyProblem, computing: Duration) -> Figures {
        let (marks, seconds) = (problem.marks() as f64, problem.seconds());
        Figures {
            error: self.errors.iter().sum::<f64>() / marks,
            spread: ErrorSpread::of(&self.errors),
            seconds: computing.as_secs_f64() / seconds,
            evaluations: self.evaluations.map(|count| count as f64 / seconds),
            energy_error: self.energy / marks,
            momentum_error: self.momentum / marks,
            penetration: self.penetration,
            limit_overshoot: self.overshoot,
            joint_separation: self.separation,
            residual: self.residual,
            unsolved_steps: self.unsolved,
        }
    }
}
