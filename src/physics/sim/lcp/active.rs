//! One Newton step on the natural map: find which rows are at their bounds, and solve for the others.
//!
//! The natural map is piecewise smooth. About a point (λ, w) each row lies on one of its pieces:
//!
//! - *held*: its force is a number (an end of its bound, or friction without a normal force);
//! - *free*: its force is unknown and its velocity is zero (also both rows of a sticking contact);
//! - *sliding*: its force follows the unknown normal force, λ_t = μ λ_n e. For a pyramid e = ±1 and that is
//!   all. For a circular cone e is a direction that may rotate: with τ perpendicular to e, the unknown s
//!   moves the force by s τ, and its equation is that the velocity across e vanishes, τ · w_t = 0.
//!   As τ rotates by s / (μ λ_n) with it, the derivative of that equation by s is
//!   τ · B τ + |w_t| / (μ λ_n), with B the block of the two rows.
//!
//! What is left is one square linear system, with no more unknowns than rows. It is scaled to a unit
//! diagonal, so that mass ratios do not spoil it, and a share [`PROXIMITY`] of the identity is added: rows that
//! depend on each other (a box on four points) leave many solutions, and the one nearest to the start is
//! taken. The steps then are those of the proximal-point method (Rockafellar 1976), whose limit does
//! not depend on that share.

use super::residual::{evaluate, norm, project, reaches_beyond, row_scale, tangent_scale};
use multiversion::multiversion;

use super::problem::{Bound, Problem};
use super::symmetric::Symmetric;
use super::{linear, symmetric};

/// Large against rounding (1e-16), small against the least eigenvalue that matters of a scaled matrix.
const PROXIMITY: f64 = 1e-10;

/// An unknown and its equation: the combination of one or two rows. It changes the forces of the rows by
/// its value times the weights, and asks that the same combination of their velocities vanish.
#[derive(Debug, Clone, Copy)]
struct Unknown {
    rows: [usize; 2],
    weights: [f64; 2],
    /// Added to the diagonal: contribution of the rotation of the sliding direction.
    bend: f64,
}

/// Friction that follows its normal force.
#[derive(Debug, Clone, Copy)]
struct Sliding {
    rows: [usize; 2],
    normal: usize,
    coefficient: f64,
    /// e, a unit vector; of a pyramid's row ±1 and 0.
    direction: [f64; 2],
    /// The unknown that rotates e, and the radius μ λ_n at which its value is a length of arc.
    rotation: Option<(usize, f64)>,
}

/// What the equations of an active set ask for and how far their solution goes, both scaled to a unit diagonal.
#[derive(Debug, Clone, Copy)]
struct Extent {
    /// The greatest magnitude on the right-hand side.
    asked: f64,
    /// The greatest of an unknown.
    gone: f64,
}

/// What came of a step.
#[derive(Debug, Clone, Copy)]
pub(super) enum NewtonStep {
    /// The forces are those of the active set, and leave this residual.
    Taken {
        /// m/s or rad/s.
        residual: f64,
    },
    /// The equations of the active set contradict each other, and forces without bound would not
    /// satisfy them. The forces are unchanged but for the held ones.
    Contradiction,
    /// The elimination found no pivot. The forces are unchanged but for the held ones.
    Singular,
}

/// The scratch memory of the step.
#[derive(Debug, Clone, Default)]
pub(super) struct ActiveSet {
    unknowns: Vec<Unknown>,
    /// n, the unknown that is the row's force, if it is one.
    unknown_of: Vec<Option<usize>>,
    sliding: Vec<Sliding>,
    /// n, combination of rows of A.
    combined: Vec<f64>,
    /// See [`linear::solve`].
    system: Vec<f64>,
    /// In ascending order, the rows whose forces are unknown.
    chosen: Vec<usize>,
    /// [`row_stiffness`] of each of them.
    scales: Vec<f64>,
    direct: Symmetric,
    /// The value of every unknown.
    solution: Vec<f64>,
}

/// Replaces `lambda`, whose velocities are `velocity`, by the solution of its active set projected
/// onto the bounds, and `velocity` by what belongs to that.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn step(
    active: &mut ActiveSet,
    problem: &Problem<'_>,
    lambda: &mut [f64],
    velocity: &mut [f64],
) -> NewtonStep {
    if active.classify(problem, lambda, velocity) {
        evaluate(problem, lambda, velocity);
    }
    // Sliding friction answers to its normal force, but not the other way round.
    let symmetric = problem.symmetric && active.sliding.is_empty();
    let extent = if symmetric { active.solve_symmetric(problem, velocity) } else { None };
    let symmetric = extent.is_some();
    let Some(Extent { asked, gone }) = extent.or_else(|| active.solve(problem, velocity)) else {
        return NewtonStep::Singular;
    };
    // What the equations lack after the step is the share of the unknowns that was added to them.
    if PROXIMITY * gone > 0.5 * asked {
        return NewtonStep::Contradiction;
    }
    if symmetric {
        active.apply_symmetric(lambda)
    } else {
        active.apply(lambda)
    }
    project(problem, lambda);
    NewtonStep::Taken { residual: evaluate(problem, lambda, velocity) }
}

impl ActiveSet {
    /// Solves the equations of the active set; `None` when elimination found no pivot.
    #[inline(always)] // part of the kernels
    fn solve(&mut self, problem: &Problem<'_>, velocity: &[f64]) -> Option<Extent> {
        let m = self.unknowns.len();
        // Padding need not be cleared: nothing depends on it.
        self.system.resize(m * linear::width(m), 0.0);
        let asked = self.assemble(problem, velocity);
        linear::solve(&mut self.system, m)?;
        self.solution.clear();
        self.solution.extend(self.system.chunks_exact(linear::width(m)).map(|entries| entries[m]));
        Some(Extent { asked, gone: self.solution.iter().fold(0.0, |gone, value| gone.max(value.abs())) })
    }

    /// The same where every unknown is the force of one row. Elimination without a search for pivots does the same in
    /// every scale, so that only the share of the identity is scaled. `None` when a pivot is not positive.
    #[inline(always)] // part of the kernels
    fn solve_symmetric(&mut self, problem: &Problem<'_>, velocity: &[f64]) -> Option<Extent> {
        let n = problem.rows();
        let Self { unknowns, unknown_of, chosen, scales, direct, .. } = self;
        chosen.clear();
        if unknowns.len() == n {
            chosen.extend(0..n);
        } else {
            chosen.extend((0..n).filter(|row| unknown_of[*row].is_some()));
        }
        scales.clear();
        scales.extend(chosen.iter().map(|row| row_stiffness(problem, *row)));
        direct.gather(problem.matrix, n, chosen, |index| PROXIMITY * scales[index]);
        let mut asked = 0.0_f64;
        for ((side, row), scale) in direct.side_mut().iter_mut().zip(&*chosen).zip(&*scales) {
            let wrong = velocity[*row];
            *side = -wrong;
            asked = asked.max(wrong.powi(2) / scale);
        }
        symmetric::solve(direct)?;
        let gone = direct.side().iter().zip(&*scales).map(|(value, scale)| value.powi(2) * scale);
        Some(Extent { asked: asked.sqrt(), gone: gone.fold(0.0, f64::max).sqrt() })
    }

    /// Adds the solution of [`solve_symmetric`](Self::solve_symmetric) to `lambda`.
    #[inline(always)] // part of the kernels
    fn apply_symmetric(&self, lambda: &mut [f64]) {
        for (value, row) in self.direct.side().iter().zip(&self.chosen) {
            lambda[*row] += value;
        }
    }

    /// Puts every row on its piece and moves held and sliding forces there; whether one moved.
    #[inline(always)] // part of the kernels
    fn classify(&mut self, problem: &Problem<'_>, lambda: &mut [f64], velocity: &[f64]) -> bool {
        let n = problem.rows();
        self.unknowns.clear();
        self.sliding.clear();
        self.unknown_of.clear();
        self.unknown_of.resize(n, None);
        let mut moved = false;
        for (row, bound) in problem.bounds.iter().enumerate() {
            if !bound.is_friction() {
                moved |= self.guess_row(problem, row, bound.interval(lambda), lambda, velocity);
            }
        }
        let mut row = 0;
        while row < n {
            let block = problem.block(row);
            if let Bound::Friction { normal, coefficient } = problem.bounds[row] {
                let radius = coefficient * lambda[normal].max(0.0);
                if radius == 0.0 {
                    // A contact that is about to close has no direction of sliding yet.
                    let closing = coefficient > 0.0 && self.unknown_of[normal].is_some();
                    for (tangent, force) in lambda.iter_mut().enumerate().skip(row).take(block) {
                        if closing {
                            self.free(tangent);
                        } else {
                            moved |= place(force, 0.0);
                        }
                    }
                } else if block == 2 {
                    moved |= self.guess_disc(problem, row, radius, lambda, velocity);
                } else if self.unknown_of[normal].is_none() {
                    moved |= self.guess_row(problem, row, (-radius, radius), lambda, velocity);
                } else {
                    moved |= self.guess_pyramid(problem, row, radius, lambda, velocity);
                }
            }
            row += block;
        }
        moved
    }

    /// A row with a fixed interval: free inside it, held at its ends.
    fn guess_row(
        &mut self,
        problem: &Problem<'_>,
        row: usize,
        (lower, upper): (f64, f64),
        lambda: &mut [f64],
        velocity: &[f64],
    ) -> bool {
        let scale = row_scale(problem, row);
        if velocity[row] >= scale * (lambda[row] - lower) {
            place(&mut lambda[row], lower)
        } else if velocity[row] <= scale * (lambda[row] - upper) {
            place(&mut lambda[row], upper)
        } else {
            self.free(row);
            false
        }
    }

    /// A row of a pyramid whose normal force is unknown.
    fn guess_pyramid(
        &mut self,
        problem: &Problem<'_>,
        row: usize,
        radius: f64,
        lambda: &mut [f64],
        velocity: &[f64],
    ) -> bool {
        let Bound::Friction { normal, coefficient } = problem.bounds[row] else { return false };
        let scale = row_scale(problem, row);
        let sign = if velocity[row] >= scale * (lambda[row] + radius) {
            -1.0
        } else if velocity[row] <= scale * (lambda[row] - radius) {
            1.0
        } else {
            self.free(row);
            return false;
        };
        let direction = [sign, 0.0];
        self.sliding.push(Sliding { rows: [row; 2], normal, coefficient, direction, rotation: None });
        place(&mut lambda[row], sign * radius)
    }

    /// Both rows of a circular cone.
    fn guess_disc(
        &mut self,
        problem: &Problem<'_>,
        row: usize,
        radius: f64,
        lambda: &mut [f64],
        velocity: &[f64],
    ) -> bool {
        let Bound::Friction { normal, coefficient } = problem.bounds[row] else { return false };
        let scale = tangent_scale(problem, row);
        let aim = [scale * lambda[row] - velocity[row], scale * lambda[row + 1] - velocity[row + 1]];
        if !reaches_beyond(aim, scale * radius) {
            self.free(row);
            self.free(row + 1);
            return false;
        }
        let reach = norm(aim);
        let direction = [aim[0] / reach, aim[1] / reach];
        let across = [-direction[1], direction[0]];
        let backward = -(direction[0] * velocity[row] + direction[1] * velocity[row + 1]);
        let rows = [row, row + 1];
        let rotation = Some((self.unknowns.len(), radius));
        self.unknowns.push(Unknown { rows, weights: across, bend: backward.max(0.0) / radius });
        self.sliding.push(Sliding { rows, normal, coefficient, direction, rotation });
        let [first, second] = direction.map(|each| radius * each);
        place(&mut lambda[row], first) | place(&mut lambda[row + 1], second)
    }

    /// Makes the force of `row` an unknown.
    fn free(&mut self, row: usize) {
        self.unknown_of[row] = Some(self.unknowns.len());
        self.unknowns.push(Unknown { rows: [row; 2], weights: [1.0, 0.0], bend: 0.0 });
    }

    /// Scales every unknown to a unit diagonal and fills the augmented system. Returns the greatest
    /// magnitude on its right-hand side.
    #[inline(always)] // part of the kernels
    fn assemble(&mut self, problem: &Problem<'_>, velocity: &[f64]) -> f64 {
        let n = problem.rows();
        let Self { unknowns, unknown_of, sliding, combined, system, .. } = self;
        let m = unknowns.len();
        for unknown in &mut *unknowns {
            let scale = stiffness(problem, unknown);
            let root = scale.sqrt();
            unknown.weights = unknown.weights.map(|weight| weight / root);
            unknown.bend /= scale;
        }
        combined.resize(n, 0.0);
        let combined = combined.as_mut_slice();
        let width = linear::width(m);
        let mut asked = 0.0_f64;
        for (index, (equation, entries)) in unknowns.iter().zip(system.chunks_exact_mut(width)).enumerate() {
            let [first, second] = equation.rows.map(|row| &problem.matrix[row * n..(row + 1) * n]);
            let [p, q] = equation.weights;
            for (entry, a) in combined.iter_mut().zip(first) {
                *entry = p * a;
            }
            if q != 0.0 {
                for (entry, a) in combined.iter_mut().zip(second) {
                    *entry += q * a;
                }
            }
            for (entry, unknown) in entries.iter_mut().zip(&*unknowns) {
                *entry = combined[unknown.rows[0]] * unknown.weights[0];
            }
            for sliding in &*sliding {
                let [x, y] = sliding.rows.map(|row| combined[row]);
                if let Some((rotation, _)) = sliding.rotation {
                    entries[rotation] += y * unknowns[rotation].weights[1];
                }
                if let Some(normal) = unknown_of[sliding.normal] {
                    let along = x * sliding.direction[0] + y * sliding.direction[1];
                    entries[normal] += sliding.coefficient * along * unknowns[normal].weights[0];
                }
            }
            entries[index] += equation.bend + PROXIMITY;
            let wrong = p * velocity[equation.rows[0]] + q * velocity[equation.rows[1]];
            asked = asked.max(wrong.abs());
            entries[m] = -wrong;
        }
        asked
    }

    /// Adds the solution to `lambda` and lets sliding friction follow.
    #[inline(always)] // part of the kernels
    fn apply(&self, lambda: &mut [f64]) {
        for (row, unknown) in self.unknown_of.iter().enumerate() {
            if let Some(index) = *unknown {
                lambda[row] += self.solution[index] * self.unknowns[index].weights[0];
            }
        }
        for sliding in &self.sliding {
            let radius = sliding.coefficient * lambda[sliding.normal].max(0.0);
            let mut direction = sliding.direction;
            if let Some((index, arm)) = sliding.rotation {
                for (along, weight) in direction.iter_mut().zip(self.unknowns[index].weights) {
                    *along += self.solution[index] * weight / arm;
                }
                let length = norm(direction);
                direction = direction.map(|each| each / length);
            }
            let [first, second] = sliding.rows;
            if second != first {
                lambda[second] = radius * direction[1];
            }
            lambda[first] = radius * direction[0];
        }
    }
}

/// The diagonal that an unknown would have, and where that is not positive the greatest entry of its row.
fn stiffness(problem: &Problem<'_>, unknown: &Unknown) -> f64 {
    let n = problem.rows();
    let at = |i: usize, j: usize| {
        unknown.weights[i] * unknown.weights[j] * problem.matrix[unknown.rows[i] * n + unknown.rows[j]]
    };
    let mut diagonal = at(0, 0) + unknown.bend;
    if unknown.weights[1] != 0.0 {
        diagonal += at(0, 1) + at(1, 0) + at(1, 1);
    }
    if diagonal > 0.0 {
        return diagonal;
    }
    greatest(problem, unknown.rows[0])
}

/// [`stiffness`] of the force of one row.
fn row_stiffness(problem: &Problem<'_>, row: usize) -> f64 {
    let diagonal = problem.matrix[row * (problem.rows() + 1)];
    if diagonal > 0.0 { diagonal } else { greatest(problem, row) }
}

/// The greatest entry of a row, or 1 where there is none.
fn greatest(problem: &Problem<'_>, row: usize) -> f64 {
    let n = problem.rows();
    let entries = &problem.matrix[row * n..(row + 1) * n];
    let greatest = entries.iter().fold(0.0_f64, |greatest, entry| greatest.max(entry.abs()));
    if greatest > 0.0 { greatest } else { 1.0 }
}

/// Sets a force; whether that changed it.
fn place(force: &mut f64, value: f64) -> bool {
    let moved = *force != value;
    *force = value;
    moved
}
