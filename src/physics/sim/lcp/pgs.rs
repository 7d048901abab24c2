//! Projected Gauss-Seidel: row after row, the force that gives this row what its bound asks for.
//!
//! Each sweep visits the rows in order. A row with bounds lo ≤ λ ≤ hi takes
//! λ ← clamp(λ − w/A_ii, lo, hi) (Cottle, Pang & Stone 1992, section 5.2). The two tangential rows of a
//! circular cone are solved together, for the normal force of the moment (see
//! [`Tangents::solve`]). So friction follows the normal force within a sweep, and the limit obeys
//! Coulomb's law although that law is no minimisation.

use super::problem::{Bound, Problem, Solution, SolveStatus, Solver};
use super::residual::{asked_end, between, dot, error, evaluate, norm, onto_rim, project, within_disc};

/// A row whose diagonal is below this share of the greatest one cannot be moved: what it holds are
/// rounding errors of the others.
const IMMOBILE: f64 = 1e-16;

/// Projected Gauss-Seidel, warm-started, with a budget of sweeps.
///
/// Without friction it converges for symmetric positive semidefinite A whenever there is a solution
/// (Luo & Tseng 1992), at a linear rate that worsens with the mass ratio; with friction it mostly does.
#[derive(Debug, Clone)]
pub struct Pgs {
    iterations: u32,
    tolerance: f64,
    sweeper: Sweeper,
    /// n, scratch of the residual.
    velocity: Vec<f64>,
}

impl Pgs {
    /// At most `iterations` sweeps; fewer when the residual falls to `tolerance` (m/s or rad/s) before.
    pub fn new(iterations: u32, tolerance: f64) -> Self {
        Self { iterations, tolerance, sweeper: Sweeper::default(), velocity: Vec::new() }
    }
}

impl Solver for Pgs {
    fn solve(&mut self, problem: &Problem<'_>, lambda: &mut [f64]) -> Solution {
        if let Some(status) = problem.refusal(lambda) {
            return Solution::refused(status);
        }
        project(problem, lambda);
        self.velocity.resize(problem.rows(), 0.0);
        let mut residual = evaluate(problem, lambda, &mut self.velocity);
        if !residual.is_finite() {
            return Solution::refused(SolveStatus::NotFinite);
        }
        let mut iterations = 0;
        if residual > self.tolerance {
            self.sweeper.prepare(problem);
        }
        while residual > self.tolerance && iterations < self.iterations {
            let change = self.sweeper.sweep(problem, lambda);
            iterations += 1;
            // What the sweep corrected is about the residual it found, and costs nothing to know.
            if change <= self.tolerance || iterations == self.iterations || !change.is_finite() {
                project(problem, lambda);
                residual = evaluate(problem, lambda, &mut self.velocity);
            }
        }
        let status = self.sweeper.verdict(problem, lambda, &self.velocity, residual, self.tolerance);
        Solution { status, iterations, residual }
    }
}

/// One sweep over the rows, with what it needs of a problem's matrix computed once.
#[derive(Debug, Clone, Default)]
pub(super) struct Sweeper {
    /// n, 1/A_ii, or 0 for a row that cannot be moved. For the pair of a circular cone: 1/det B, or 0
    /// where the block is not positive definite, and then 1/tr B, or 0 where neither row can be moved.
    inverse: Vec<f64>,
}

impl Sweeper {
    /// Reads the diagonal of `problem`; to be called before the first sweep over it.
    pub(super) fn prepare(&mut self, problem: &Problem<'_>) {
        let n = problem.rows();
        let greatest = problem.matrix.iter().step_by(n + 1).copied().fold(0.0, f64::max);
        let least = IMMOBILE * greatest;
        let invert = |diagonal: f64| if diagonal > least { 1.0 / diagonal } else { 0.0 };
        self.inverse.clear();
        let mut row = 0;
        while row < n {
            let diagonal = problem.matrix[row * (n + 1)];
            if problem.block(row) == 2 {
                let [xx, xy, yx, yy] = tangent_block(problem, row);
                let determinant = xx * yy - xy * yx;
                let definite = determinant > 1e-12 * xx * yy && xx > least && yy > least;
                self.inverse.push(if definite { 1.0 / determinant } else { 0.0 });
                self.inverse.push(invert(xx + yy));
                row += 2;
            } else {
                self.inverse.push(invert(diagonal));
                row += 1;
            }
        }
    }

    /// Visits every row once. Returns the greatest velocity that a force was changed for, m/s or rad/s.
    pub(super) fn sweep(&self, problem: &Problem<'_>, lambda: &mut [f64]) -> f64 {
        let n = problem.rows();
        let mut greatest = 0.0_f64;
        let mut rows = problem.matrix.chunks_exact(n.max(1)).enumerate();
        let mut poison = 0.0;
        while let Some((row, entries)) = rows.next() {
            let bound = &problem.bounds[row];
            let old = lambda[row];
            let w = dot(entries, lambda) + problem.offset[row];
            let change = match *bound {
                Bound::Friction { normal, coefficient } if problem.cone => {
                    let Some((_, second)) = rows.next() else { break };
                    let tangents = Tangents {
                        block: [entries[row], entries[row + 1], second[row], second[row + 1]],
                        inverse: [self.inverse[row], self.inverse[row + 1]],
                        radius: coefficient * lambda[normal].max(0.0),
                        force: [old, lambda[row + 1]],
                        velocity: [w, dot(second, lambda) + problem.offset[row + 1]],
                    };
                    let new = tangents.solve();
                    [lambda[row], lambda[row + 1]] = new;
                    let moved = norm([new[0] - old, new[1] - tangents.force[1]]);
                    entries[row].max(second[row + 1]) * moved
                }
                _ => {
                    let (lower, upper) = bound.interval(lambda);
                    let new = match self.inverse[row] {
                        0.0 => asked_end(w, lower, upper).unwrap_or_else(|| between(old, lower, upper)),
                        inverse => between(old - w * inverse, lower, upper),
                    };
                    lambda[row] = new;
                    entries[row] * (new - old).abs()
                }
            };
            poison += change * 0.0;
            greatest = greatest.max(change);
        }
        greatest + poison
    }

    /// The status of a solve that ended with `lambda`, its velocities and its residual.
    pub(super) fn verdict(
        &self,
        problem: &Problem<'_>,
        lambda: &[f64],
        velocity: &[f64],
        residual: f64,
        tolerance: f64,
    ) -> SolveStatus {
        if residual <= tolerance {
            return SolveStatus::Solved;
        }
        if !residual.is_finite() {
            return SolveStatus::NotFinite;
        }
        let mut row = 0;
        while row < self.inverse.len() {
            let block = problem.block(row);
            let immobile = self.inverse[row + block - 1] == 0.0;
            if immobile && error(problem, row, lambda, velocity) > tolerance {
                return SolveStatus::Singular;
            }
            row += block;
        }
        SolveStatus::IterationLimit
    }
}

/// The diagonal block of the two tangential rows from `row` on, row-major.
fn tangent_block(problem: &Problem<'_>, row: usize) -> [f64; 4] {
    let n = problem.rows();
    let at = |i: usize, j: usize| problem.matrix[(row + i) * n + row + j];
    [at(0, 0), at(0, 1), at(1, 0), at(1, 1)]
}

/// The friction of one contact with a circular cone, while every other force stays.
struct Tangents {
    /// B, 2 × 2, row-major, (m/s)/N.
    block: [f64; 4],
    /// 1/det B and 1/tr B, 0 where they do not serve.
    inverse: [f64; 2],
    /// μ λ_n, N.
    radius: f64,
    /// N.
    force: [f64; 2],
    /// With that force, m/s.
    velocity: [f64; 2],
}

impl Tangents {
    /// The force within the disc that stops the sliding, else one on its rim against the sliding.
    ///
    /// Sliding is B x + g = −κ x with |x| = radius and κ > 0, where g is the velocity without friction.
    /// κ is taken from the force and the velocity of the moment, −w · x / radius², but at least
    /// |g| / radius − tr B, which it cannot be below; and x(κ) = −(B + κ I)⁻¹ g is scaled to the rim. Sweep by
    /// sweep both converge, and where they do, w = −κ x.
    fn solve(&self) -> [f64; 2] {
        let [xx, xy, yx, yy] = self.block;
        let [force, w] = [self.force, self.velocity];
        let [over_determinant, over_trace] = self.inverse;
        if over_determinant == 0.0 {
            return within_disc([force[0] - w[0] * over_trace, force[1] - w[1] * over_trace], self.radius);
        }
        let stick = [
            force[0] - (yy * w[0] - xy * w[1]) * over_determinant,
            force[1] - (xx * w[1] - yx * w[0]) * over_determinant,
        ];
        if norm(stick) <= self.radius {
            return stick;
        }
        // Its square would be zero.
        if self.radius < 1e-150 {
            return [0.0; 2];
        }
        let g = [w[0] - xx * force[0] - xy * force[1], w[1] - yx * force[0] - yy * force[1]];
        let least = (norm(g) / self.radius - xx - yy).max(0.0);
        let kappa = least.max(-(w[0] * force[0] + w[1] * force[1]) / (self.radius * self.radius));
        let [p, q] = [xx + kappa, yy + kappa];
        let over = 1.0 / (p * q - xy * yx);
        let x = [(xy * g[1] - q * g[0]) * over, (yx * g[0] - p * g[1]) * over];
        onto_rim(x, norm(x), self.radius)
    }
}
