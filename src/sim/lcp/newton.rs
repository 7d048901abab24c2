//! Newton's method on the natural map, with Gauss-Seidel sweeps where it does not lead on.
//!
//! Once the rows at their bounds are guessed rightly, one Newton step solves the problem to rounding
//! (for circular cones a few, for their rim is curved); and between two time steps the guess seldom changes.
//! A wrong guess corrects itself in most cases (Alart & Curnier 1991; Hintermüller, Ito & Kunisch
//! 2003), but can go in circles. Then sweeps of projected Gauss-Seidel, twice as many each time, bring the
//! next guess nearer.

use super::active::{ActiveSet, Step};
use super::pgs::Sweeper;
use super::residual::{evaluate, project};
use super::{Problem, Solution, Solver, Status};

/// Newton steps in a row that may fail to lessen the residual before sweeps take over.
const PATIENCE: u32 = 3;

/// Semi-smooth Newton method, warm-started, with projected Gauss-Seidel behind it.
#[derive(Debug, Clone)]
pub struct Newton {
    iterations: u32,
    tolerance: f64,
    sweeper: Sweeper,
    active: ActiveSet,
    /// n each.
    velocity: Vec<f64>,
    trial: Vec<f64>,
    before: Vec<f64>,
    start: Vec<f64>,
}

impl Newton {
    /// At most `iterations` sweeps and Newton steps together; fewer when the residual falls to
    /// `tolerance` (m/s or rad/s) before.
    pub fn new(iterations: u32, tolerance: f64) -> Self {
        Self {
            iterations,
            tolerance,
            sweeper: Sweeper::default(),
            active: ActiveSet::default(),
            velocity: Vec::new(),
            trial: Vec::new(),
            before: Vec::new(),
            start: Vec::new(),
        }
    }

    /// Sweeps the present point `count` times, each time only half-way: friction can make whole sweeps
    /// go round in circles. Returns its residual.
    fn sweep(&mut self, problem: &Problem<'_>, count: u32) -> f64 {
        self.sweeper.prepare(problem);
        for _ in 0..count {
            self.before.clear();
            self.before.extend_from_slice(&self.trial);
            self.sweeper.sweep(problem, &mut self.trial);
            for (force, before) in self.trial.iter_mut().zip(&self.before) {
                *force = 0.5 * (*force + before);
            }
        }
        project(problem, &mut self.trial);
        evaluate(problem, &self.trial, &mut self.velocity)
    }
}

impl Solver for Newton {
    fn solve(&mut self, problem: &Problem<'_>, lambda: &mut [f64]) -> Solution {
        if let Some(status) = problem.refusal(lambda) {
            return Solution::refused(status);
        }
        project(problem, lambda);
        self.velocity.resize(problem.rows(), 0.0);
        let mut residual = evaluate(problem, lambda, &mut self.velocity);
        if !residual.is_finite() {
            return Solution::refused(Status::NotFinite);
        }
        self.trial.clear();
        self.trial.extend_from_slice(lambda);
        self.start.clear();
        self.start.extend_from_slice(lambda);
        if residual > self.tolerance {
            self.active.prepare(problem);
        }
        let mut contradiction = false;
        let mut iterations = 0;
        let mut sweeps = 0;
        // `lambda` is the best point so far and `trial` the present one.
        while residual > self.tolerance && iterations < self.iterations {
            if sweeps > 0 {
                let allowed = sweeps.min(self.iterations - iterations);
                iterations += allowed;
                self.trial.copy_from_slice(lambda);
                let swept = self.sweep(problem, allowed);
                // Equal is progress too: the residual of a contradiction hides what the other rows gain.
                if swept <= residual {
                    residual = swept;
                    lambda.copy_from_slice(&self.trial);
                }
            }
            sweeps = if sweeps == 0 { 1 } else { 2 * sweeps };
            let mut patience = if contradiction { 0 } else { PATIENCE };
            while residual > self.tolerance && iterations < self.iterations && patience > 0 {
                iterations += 1;
                match self.active.step(problem, &mut self.trial, &mut self.velocity) {
                    Step::Taken { residual: stepped } if stepped < residual => {
                        residual = stepped;
                        lambda.copy_from_slice(&self.trial);
                    }
                    Step::Taken { residual: stepped } if stepped.is_finite() => patience -= 1,
                    Step::Taken { .. } | Step::Singular => patience = 0,
                    Step::Contradiction => {
                        // Earlier steps may have gone far along the contradiction: from the start again.
                        contradiction = true;
                        patience = 0;
                        lambda.copy_from_slice(&self.start);
                        residual = evaluate(problem, lambda, &mut self.velocity);
                    }
                }
            }
        }
        let status = if residual <= self.tolerance {
            Status::Solved
        } else if contradiction {
            Status::Singular
        } else {
            evaluate(problem, lambda, &mut self.velocity);
            self.sweeper.prepare(problem);
            self.sweeper.verdict(problem, lambda, &self.velocity, residual, self.tolerance)
        };
        Solution { status, iterations, residual }
    }
}
