//! Rows e solved directly, and the rest handed on.
//!
//! With the free rows e and the others i, w_e = A_ee λ_e + A_ei λ_i + b_e = 0 gives
//!
//! λ_e = −A_ee⁻¹ (b_e + A_ei λ_i),
//! w_i = (A_ii − A_ie A_ee⁻¹ A_ei) λ_i + b_i − A_ie A_ee⁻¹ b_e,
//!
//! so that what is left is a problem in λ_i alone, with the Schur complement for its matrix (Cottle, Pang & Stone
//! 1992, section 2.3). With L Lᵀ = A_ee and Y = L⁻¹ A_ei that matrix is A_ii − Yᵀ Y. Sweeps of Gauss-Seidel over
//! rows e would need about as many as the mass ratio across them; the factor does not know of it.

use super::problem::{Bound, Problem, Solution, SolveStatus, Solver};
use super::residual::{dot, evaluate, greatest_velocity, is_beyond_numbers};
use super::skyline::{DEPENDENT, Skyline};

/// A residual below this share of the greatest velocity in the problem is rounding.
const ROUNDING: f64 = 1e-13;

/// Share of the velocities in b that rounding errors may be where rows depend on each other. Mass ratios of 10⁶ along a chain
/// leave errors of 10⁻⁹.
const TRUSTED: f64 = 1e-8;

/// The same for rows that contradict each other, whose forces are given up however much other forces leave, and how many times the
/// residual of great forces those of the other solver may leave to be taken instead.
const HOPELESS: f64 = 1e-6;
const YIELDING_LOSS: f64 = 2.0;

/// Solves free rows by a symmetric factor and gives what is left to another solver.
///
/// For symmetric positive semidefinite A. Rows that depend on others (a redundant loop, a row repeated) are
/// passed over; where they contradict the others the status is [`SolveStatus::Singular`], and the forces
/// are those that satisfy the earlier of them. A problem without free rows goes to the other solver as it is.
#[derive(Debug, Clone)]
pub struct Equality<S> {
    inner: S,
    tolerance: f64,
    /// Rows solved here in the order of their factor, and rows left to the other solver.
    eliminated: Vec<usize>,
    kept: Vec<usize>,
    /// n, the place of a kept row among the kept.
    place: Vec<usize>,
    /// Of A_ee.
    factor: Skyline,
    /// Yᵀ, one row of |e| a kept row.
    coupling: Vec<f64>,
    /// L⁻¹ b_e.
    asked: Vec<f64>,
    /// The problem that is left.
    matrix: Vec<f64>,
    offset: Vec<f64>,
    bounds: Vec<Bound>,
    force: Vec<f64>,
    /// |e|.
    correction: Vec<f64>,
    /// n each.
    velocity: Vec<f64>,
    trial: Vec<f64>,
}

impl<S: Solver> Equality<S> {
    /// In front of `inner`; the solution counts as one when its residual is within `tolerance` (m/s or
    /// rad/s) or no more than rounding.
    pub fn new(inner: S, tolerance: f64) -> Self {
        Self {
            inner,
            tolerance,
            eliminated: Vec::new(),
            kept: Vec::new(),
            place: Vec::new(),
            factor: Skyline::default(),
            coupling: Vec::new(),
            asked: Vec::new(),
            matrix: Vec::new(),
            offset: Vec::new(),
            bounds: Vec::new(),
            force: Vec::new(),
            correction: Vec::new(),
            velocity: Vec::new(),
            trial: Vec::new(),
        }
    }

    /// Sorts the rows. A free row that friction takes for its normal force is left to the other solver.
    fn split(&mut self, problem: &Problem<'_>) {
        self.eliminated.clear();
        self.kept.clear();
        self.place.clear();
        self.place.resize(problem.rows(), usize::MAX);
        for bound in problem.bounds {
            if let Bound::Friction { normal, .. } = bound {
                self.place[*normal] = 0;
            }
        }
        for (row, bound) in problem.bounds.iter().enumerate() {
            if *bound == Bound::Free && self.place[row] == usize::MAX {
                self.eliminated.push(row);
            } else {
                self.place[row] = self.kept.len();
                self.kept.push(row);
            }
        }
    }

    /// Makes the problem that is left, to be started at what `lambda` has for it.
    fn reduce(&mut self, problem: &Problem<'_>, lambda: &[f64]) {
        let n = problem.rows();
        let (kept, equal) = (self.kept.len(), self.eliminated.len());
        self.asked.clear();
        self.asked.extend(self.eliminated.iter().map(|row| problem.offset[*row]));
        self.factor.half_solve(&mut self.asked);
        self.coupling.clear();
        for row in &self.kept {
            let begin = self.coupling.len();
            let source = &problem.matrix[row * n..(row + 1) * n];
            self.coupling.extend(self.eliminated.iter().map(|column| source[*column]));
            self.factor.half_solve(&mut self.coupling[begin..]);
        }
        let halves = |index: usize| &self.coupling[index * equal..(index + 1) * equal];
        self.matrix.clear();
        self.matrix.resize(kept * kept, 0.0);
        for index in 0..kept {
            let source = &problem.matrix[self.kept[index] * n..];
            for other in 0..=index {
                let entry = source[self.kept[other]] - dot(halves(index), halves(other));
                self.matrix[index * kept + other] = entry;
                self.matrix[other * kept + index] = entry;
            }
        }
        // A row that the rows e leave no freedom is not moved by what rounding leaves of its entries.
        for index in 0..kept {
            let diagonal = problem.matrix[self.kept[index] * (n + 1)];
            if self.matrix[index * (kept + 1)] <= DEPENDENT * diagonal {
                self.matrix[index * kept..(index + 1) * kept].fill(0.0);
                self.matrix.iter_mut().skip(index).step_by(kept).for_each(|entry| *entry = 0.0);
            }
        }
        self.offset.clear();
        self.bounds.clear();
        self.force.clear();
        for (index, row) in self.kept.iter().enumerate() {
            self.offset.push(problem.offset[*row] - dot(halves(index), &self.asked));
            self.force.push(lambda[*row]);
            self.bounds.push(match problem.bounds[*row] {
                Bound::Friction { normal, coefficient } => {
                    Bound::Friction { normal: self.place[normal], coefficient }
                }
                other => other,
            });
        }
    }

    /// The forces of all rows from those of the kept ones.
    fn recover(&mut self, lambda: &mut [f64]) {
        let equal = self.eliminated.len();
        self.correction.clear();
        self.correction.extend_from_slice(&self.asked);
        for (force, half) in self.force.iter().zip(self.coupling.chunks_exact(equal)) {
            if *force != 0.0 {
                for (sum, entry) in self.correction.iter_mut().zip(half) {
                    *sum += force * entry;
                }
            }
        }
        self.factor.finish(&mut self.correction);
        for (row, force) in self.kept.iter().zip(&self.force) {
            lambda[*row] = *force;
        }
        for (row, force) in self.eliminated.iter().zip(&self.correction) {
            lambda[*row] = -force;
        }
    }

    /// One step of iterative refinement of the rows e of `trial`, whose velocities are at hand.
    fn refine(&mut self) {
        self.correction.clear();
        self.correction.extend(self.eliminated.iter().map(|row| self.velocity[*row]));
        self.factor.half_solve(&mut self.correction);
        self.factor.finish(&mut self.correction);
        for (row, change) in self.eliminated.iter().zip(&self.correction) {
            self.trial[*row] -= change;
        }
    }

    /// The status of forces `lambda` that leave `residual`, where the other solver ended with `inner`.
    fn verdict(
        &mut self,
        problem: &Problem<'_>,
        lambda: &[f64],
        residual: f64,
        inner: SolveStatus,
    ) -> SolveStatus {
        if !residual.is_finite() {
            return SolveStatus::NotFinite;
        }
        if residual <= self.tolerance || inner == SolveStatus::Solved && residual <= problem.enough {
            return SolveStatus::Solved;
        }
        let rounding = match is_beyond_numbers(problem, lambda, self.tolerance, TRUSTED) {
            true => 0.0,
            false => ROUNDING * greatest_velocity(problem, lambda),
        };
        evaluate(problem, lambda, &mut self.velocity);
        let strays = |(index, row): (usize, &usize)| {
            self.factor.is_dependent(index) && self.velocity[*row].abs() > self.tolerance.max(rounding)
        };
        if self.eliminated.iter().enumerate().any(strays) {
            SolveStatus::Singular
        } else if inner == SolveStatus::Solved && residual > rounding {
            SolveStatus::IterationLimit
        } else {
            inner
        }
    }
}

impl<S: Solver> Solver for Equality<S> {
    fn solve(&mut self, problem: &Problem<'_>, lambda: &mut [f64]) -> Solution {
        if !problem.bounds.contains(&Bound::Free) {
            return self.inner.solve(problem, lambda);
        }
        if let Some(status) = problem.refusal(lambda) {
            return Solution::refused(status);
        }
        self.split(problem);
        self.factor.factorise(problem.matrix, problem.rows(), &mut self.eliminated);
        self.reduce(problem, lambda);
        let mut left = Solution { status: SolveStatus::Solved, iterations: 0, residual: 0.0 };
        if !self.kept.is_empty() {
            let problem = Problem {
                matrix: &self.matrix,
                symmetric: true,
                offset: &self.offset,
                bounds: &self.bounds,
                cone: problem.cone,
                enough: problem.enough,
            };
            left = self.inner.solve(&problem, &mut self.force);
            if left.residual.is_nan() && left.status != SolveStatus::Ray {
                return left;
            }
        }
        if self.eliminated.is_empty() {
            lambda.copy_from_slice(&self.force);
            return left;
        }
        self.recover(lambda);
        self.velocity.resize(lambda.len(), 0.0);
        let mut residual = evaluate(problem, lambda, &mut self.velocity);
        if residual > self.tolerance {
            self.trial.clear();
            self.trial.extend_from_slice(lambda);
            self.refine();
            let refined = evaluate(problem, &self.trial, &mut self.velocity);
            if refined < residual {
                residual = refined;
                lambda.copy_from_slice(&self.trial);
            }
        }
        let status = self.verdict(problem, lambda, residual, left.status);
        if status != SolveStatus::Solved && is_beyond_numbers(problem, lambda, self.tolerance, TRUSTED) {
            // Rows that the rows e hardly leave any freedom: the other solver has bounded forces for all of them together.
            self.trial.clear();
            self.trial.resize(lambda.len(), 0.0);
            let whole = self.inner.solve(problem, &mut self.trial);
            let beyond = status == SolveStatus::Singular
                && is_beyond_numbers(problem, lambda, self.tolerance, HOPELESS);
            if whole.residual <= YIELDING_LOSS * residual || whole.residual.is_finite() && beyond {
                lambda.copy_from_slice(&self.trial);
                return Solution { iterations: left.iterations + whole.iterations, ..whole };
            }
        }
        Solution { status, iterations: left.iterations, residual }
    }
}
