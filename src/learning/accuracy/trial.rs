//! One setting tried on a problem.

use std::sync::Arc;
use std::time::{Duration, Instant};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::engine::Stepper;
use super::problem::{Piece, Problem};
use super::sweep::Point;
use gaitwright_physics::scene::StepPlan;
use gaitwright_physics::sim::{energy, momentum};

/// What was measured of a setting. Means and extremes are over everything that was compared with the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// Mean error, in the unit of the subject.
    pub error: f64,
    /// Greatest error, in the unit of the subject.
    pub worst_error: f64,
    /// Computing time of the steps alone for a simulated second, s: of every piece the shortest of several
    /// repeats.
    pub seconds: f64,
    /// How often new velocities were computed for a simulated second, a measure of work that no machine disturbs;
    /// `null` where the engine does not tell.
    pub evaluations: Option<f64>,
    /// Mean difference of the energy from the true one, J.
    pub energy_error: f64,
    /// Mean difference of the linear momentum from the true one, kg m/s.
    pub momentum_error: f64,
    /// Greatest penetration, m; `null` where the engine does not tell.
    pub penetration: Option<f64>,
    /// Greatest distance of a joint from its range of motion, rad or m.
    pub limit_overshoot: f64,
    /// Greatest distance (m) or angle (rad) by which the two bodies of a joint or of a closed loop are apart: in
    /// joint coordinates only loops can be; `null` where the engine does not tell.
    pub joint_separation: Option<f64>,
    /// Greatest residual of the complementarity problem, m/s or rad/s; `null` where the engine has none.
    pub residual: Option<f64>,
}

/// What came of a setting.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It went to its end.
    Measured(Figures),
    /// The simulation broke off, or lost the character; why.
    Diverged(String),
    /// It does not apply to this problem; why.
    LeftOut(String),
}

/// An error beyond this, in m or rad, is no inaccuracy any more.
const LOST: f64 = 100.0;

/// Settings that compute new velocities more often than this for a simulated second are not tried to their end.
const MOST_EVALUATIONS: u64 = 50_000;

impl Problem {
    /// Tries `point`, timed `repeats` times (not at all for 0); `None` when `stop` says so before it
    /// is done.
    pub fn try_out(&self, point: &Point, repeats: u32, stop: &dyn Fn() -> bool) -> Option<Outcome> {
        let plan = match self.setup.plan(&self.divided(&point.accuracy)) {
            Ok(plan) => Arc::new(plan),
            Err(error) => return Some(Outcome::LeftOut(error.to_string())),
        };
        let mut trial = match Trial::new(self, plan, point) {
            Ok(trial) => trial,
            Err(reason) => return Some(Outcome::LeftOut(reason)),
        };
        let mut sum = Sum::NOTHING;
        let mut computing = Duration::ZERO;
        for piece in &self.pieces {
            trial.rehearse(piece);
            match trial.measure(piece, &mut sum, stop) {
                Ok(true) => {}
                Ok(false) => return None,
                Err(outcome) => return Some(outcome),
            }
            let mut shortest = None;
            for _ in 0..repeats {
                match trial.time(piece, stop) {
                    Ok(None) => return None,
                    Ok(Some(time)) => shortest = Some(shortest.map_or(time, |own: Duration| own.min(time))),
                    Err(reason) => return Some(Outcome::Diverged(reason)),
                }
            }
            computing += shortest.unwrap_or_default();
        }
        Some(Outcome::Measured(sum.figures(self, computing)))
    }
}

/// A setting at work.
struct Trial<'a> {
    problem: &'a Problem,
    plan: Arc<StepPlan>,
    stepper: Stepper,
    /// Steps from mark to mark.
    steps: usize,
    /// Targets at the beginning of every step of a piece, and at the end of the last.
    targets: Vec<f64>,
}

impl<'a> Trial<'a> {
    fn new(problem: &'a Problem, plan: Arc<StepPlan>, point: &Point) -> Result<Self, String> {
        let stepper = Stepper::new(point.engine, &problem.setup, &plan)?;
        let steps = problem.steps(point.accuracy.step);
        Ok(Self { problem, plan, stepper, steps, targets: Vec::new() })
    }

    /// Looks up the targets of a piece, so that doing so is not timed.
    fn rehearse(&mut self, piece: &Piece) {
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

    fn step(&mut self, index: usize) -> Result<(), String> {
        let joints = self.problem.setup.model.joint_count();
        let (now, next) = self.targets[index * joints..(index + 2) * joints].split_at(joints);
        self.stepper.step(self.problem.setup.script.command(now, next))
    }

    /// Goes through a piece and compares every mark with the truth; whether it got to the end before `stop`
    /// said so.
    ///
    /// # Errors
    /// What became of the setting instead.
    fn measure(&mut self, piece: &Piece, sum: &mut Sum, stop: &dyn Fn() -> bool) -> Result<bool, Outcome> {
        self.stepper.restart(&piece.start).map_err(Outcome::Diverged)?;
        let seconds = self.problem.interval * piece.marks.len() as f64;
        let allowed = (MOST_EVALUATIONS as f64 * seconds) as u64;
        let Problem { setup, measure, .. } = self.problem;
        for (number, truth) in piece.marks.iter().enumerate() {
            for index in number * self.steps..(number + 1) * self.steps {
                if stop() {
                    return Ok(false);
                }
                self.step(index).map_err(Outcome::Diverged)?;
                sum.watch(&self.stepper, &setup.model.limits);
                if self.stepper.evaluations().is_some_and(|count| count > allowed) {
                    return Err(Outcome::LeftOut(format!(
                        "takes more than {MOST_EVALUATIONS} evaluations a second"
                    )));
                }
            }
            let state = self.stepper.state();
            let error = (measure.of)(&setup.model, state, truth);
            if error.is_nan() || error > LOST {
                let reason = format!("off by {error:.3e} {} at {} s", measure.unit, truth.time);
                return Err(Outcome::Diverged(reason));
            }
            sum.error += error;
            sum.worst = sum.worst.max(error);
            let total = |of| {
                let energy = energy(&setup.model, &self.plan, of);
                energy.kinetic + energy.potential
            };
            sum.energy += (total(state) - total(truth)).abs();
            let linear = |of| momentum(&setup.model, of).linear;
            sum.momentum += (linear(state) - linear(truth)).norm();
        }
        sum.evaluations = sum.evaluations.zip(self.stepper.evaluations()).map(|(sum, own)| sum + own);
        Ok(true)
    }

    /// Computing time of the steps of a piece; `None` when `stop` says so before its end.
    fn time(&mut self, piece: &Piece, stop: &dyn Fn() -> bool) -> Result<Option<Duration>, String> {
        self.stepper.restart(&piece.start)?;
        let steps = self.steps * piece.marks.len();
        let started = Instant::now();
        for index in 0..steps {
            // A look at a flag: nothing beside a step.
            if stop() {
                return Ok(None);
            }
            self.step(index)?;
        }
        Ok(Some(started.elapsed()))
    }
}

/// What adds up over the pieces.
struct Sum {
    error: f64,
    worst: f64,
    energy: f64,
    momentum: f64,
    evaluations: Option<u64>,
    penetration: Option<f64>,
    overshoot: f64,
    separation: Option<f64>,
    residual: Option<f64>,
}

impl Sum {
    const NOTHING: Self = Self {
        error: 0.0,
        worst: 0.0,
        energy: 0.0,
        momentum: 0.0,
        evaluations: Some(0),
        penetration: None,
        overshoot: 0.0,
        separation: None,
        residual: None,
    };

    /// Takes in what the last step shows beside its state.
    fn watch(&mut self, stepper: &Stepper, limits: &[Option<[f64; 2]>]) {
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

    fn figures(self, problem: &Problem, computing: Duration) -> Figures {
        let (marks, seconds) = (problem.marks() as f64, problem.seconds());
        Figures {
            error: self.error / marks,
            worst_error: self.worst,
            seconds: computing.as_secs_f64() / seconds,
            evaluations: self.evaluations.map(|count| count as f64 / seconds),
            energy_error: self.energy / marks,
            momentum_error: self.momentum / marks,
            penetration: self.penetration,
            limit_overshoot: self.overshoot,
            joint_separation: self.separation,
            residual: self.residual,
        }
    }
}
