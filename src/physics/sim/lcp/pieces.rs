//! The piece of the natural map that each row of a problem lies on.
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
//! What is left is one square linear system, with no more unknowns than rows (see `equations.rs`).

use super::problem::{Bound, Problem};
use super::residual::{asked_end, norm, reaches_beyond, row_scale, tangent_scale};

/// Friction that follows its normal force.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sliding {
    pub(super) rows: [usize; 2],
    pub(super) normal: usize,
    pub(super) coefficient: f64,
    /// e, a unit vector; of a pyramid's row ±1 and 0.
    direction: [f64; 2],
    /// How e may rotate.
    pub(super) turn: Option<Turn>,
}

/// The unknown that rotates a direction of sliding.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    /// τ, a unit vector.
    across: [f64; 2],
    /// |w_t| / (μ λ_n), added to the diagonal.
    pub(super) bend: f64,
    /// μ λ_n, the radius at which the unknown is a length of arc.
    radius: f64,
}

impl Sliding {
    /// What `numbers`, one for every row, are along e.
    #[inline(always)] // part of the kernels
    pub(super) fn along(&self, numbers: &[f64]) -> f64 {
        self.product(self.direction, numbers)
    }

    /// What they are along τ; 0 where e cannot rotate.
    #[inline(always)] // part of the kernels
    pub(super) fn across(&self, numbers: &[f64]) -> f64 {
        self.turn.map_or(0.0, |turn| self.product(turn.across, numbers))
    }

    #[inline(always)] // part of the kernels
    fn product(&self, direction: [f64; 2], numbers: &[f64]) -> f64 {
        let [first, second] = self.rows;
        direction[0] * numbers[first] + direction[1] * numbers[second]
    }

    /// Adds to `effects` what the friction along e that a unit of the normal force brings about does to the velocities of all rows.
    #[inline(always)] // part of the kernels
    pub(super) fn add_effects_along(&self, problem: &Problem<'_>, effects: &mut [f64]) {
        let [x, y] = self.direction.map(|part| self.coefficient * part);
        let [first, second] = self.lines(problem);
        for (effect, (first, second)) in effects.iter_mut().zip(first.iter().zip(second)) {
            *effect += x * first + y * second;
        }
    }

    /// Puts what a unit force along τ does to the velocities of all rows into `effects`; nothing where e cannot rotate.
    #[inline(always)] // part of the kernels
    pub(super) fn effects_across(&self, problem: &Problem<'_>, effects: &mut [f64]) {
        let Some(Turn { across: [x, y], .. }) = self.turn else { return };
        let [first, second] = self.lines(problem);
        for (effect, (first, second)) in effects.iter_mut().zip(first.iter().zip(second)) {
            *effect = x * first + y * second;
        }
    }

    /// The rows of A, which are its columns where it is symmetric.
    #[inline(always)] // part of the kernels
    fn lines<'a>(&self, problem: &Problem<'a>) -> [&'a [f64]; 2] {
        let n = problem.rows();
        self.rows.map(|row| &problem.matrix[row * n..(row + 1) * n])
    }
}

/// The pieces of all rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Pieces {
    /// n, whether the row's force is unknown.
    pub(super) free: Vec<bool>,
    pub(super) sliding: Vec<Sliding>,
}

impl Pieces {
    /// Puts every row on its piece and moves held and sliding forces there; whether one moved.
    #[inline(always)] // part of the kernels
    pub(super) fn classify(&mut self, problem: &Problem<'_>, lambda: &mut [f64], velocity: &[f64]) -> bool {
        let n = problem.rows();
        self.sliding.clear();
        self.free.resize(n, false);
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
                    let closing = coefficient > 0.0 && self.free[normal];
                    for (tangent, force) in lambda.iter_mut().enumerate().skip(row).take(block) {
                        self.free[tangent] = closing;
                        if !closing {
                            moved |= place(force, 0.0);
                        }
                    }
                } else if block == 2 {
                    moved |= self.guess_disc(problem, row, radius, lambda, velocity);
                } else if self.free[normal] {
                    moved |= self.guess_pyramid(problem, row, radius, lambda, velocity);
                } else {
                    moved |= self.guess_row(problem, row, (-radius, radius), lambda, velocity);
                }
            }
            row += block;
        }
        moved
    }

    /// A row with a fixed interval: free inside it, held at its ends.
    #[inline(always)] // part of the kernels
    fn guess_row(
        &mut self,
        problem: &Problem<'_>,
        row: usize,
        interval: (f64, f64),
        lambda: &mut [f64],
        velocity: &[f64],
    ) -> bool {
        let end = end(problem, row, interval, lambda, velocity);
        self.free[row] = end.is_none();
        end.is_some_and(|end| place(&mut lambda[row], end))
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
        let end = end(problem, row, (-radius, radius), lambda, velocity);
        self.free[row] = end.is_none();
        let Some(end) = end else { return false };
        let direction = [end.signum(), 0.0];
        self.sliding.push(Sliding { rows: [row; 2], normal, coefficient, direction, turn: None });
        place(&mut lambda[row], end)
    }

    /// Both rows of a circular cone.
    #[inline(always)] // part of the kernels
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
        let sticks = !reaches_beyond(aim, scale * radius);
        self.free[row..row + 2].fill(sticks);
        if sticks {
            return false;
        }
        let reach = norm(aim);
        let direction = [aim[0] / reach, aim[1] / reach];
        let across = [-direction[1], direction[0]];
        let backward = -(direction[0] * velocity[row] + direction[1] * velocity[row + 1]);
        let turn = Some(Turn { across, bend: backward.max(0.0) / radius, radius });
        self.sliding.push(Sliding { rows: [row, row + 1], normal, coefficient, direction, turn });
        let [first, second] = direction.map(|each| radius * each);
        place(&mut lambda[row], first) | place(&mut lambda[row + 1], second)
    }

    /// Adds `changes` to the forces `lambda` (n each, 0 where a force is not unknown) and lets sliding friction follow, whose
    /// directions rotate by `turns`.
    #[inline(always)] // part of the kernels
    pub(super) fn apply(&self, changes: &[f64], turns: &[f64], lambda: &mut [f64]) {
        for (force, change) in lambda.iter_mut().zip(changes) {
            *force += change;
        }
        for (sliding, arc) in self.sliding.iter().zip(turns) {
            let reach = sliding.coefficient * lambda[sliding.normal].max(0.0);
            let mut direction = sliding.direction;
            if let Some(Turn { across, radius, .. }) = sliding.turn {
                for (along, across) in direction.iter_mut().zip(across) {
                    *along += arc * across / radius;
                }
                let length = norm(direction);
                direction = direction.map(|each| each / length);
            }
            let [first, second] = sliding.rows;
            if second != first {
                lambda[second] = reach * direction[1];
            }
            lambda[first] = reach * direction[0];
        }
    }
}

/// The end of the interval that the force of `row` is held at, if it is.
#[inline(always)] // part of the kernels
fn end(
    problem: &Problem<'_>,
    row: usize,
    (lower, upper): (f64, f64),
    lambda: &[f64],
    velocity: &[f64],
) -> Option<f64> {
    let scale = row_scale(problem, row);
    if problem.matrix[row * (problem.rows() + 1)] <= 0.0 {
        return asked_end(velocity[row], lower, upper);
    }
    if velocity[row] >= scale * (lambda[row] - lower) {
        Some(lower)
    } else if velocity[row] <= scale * (lambda[row] - upper) {
        Some(upper)
    } else {
        None
    }
}

/// Sets a force; whether that changed it.
fn place(force: &mut f64, value: f64) -> bool {
    let moved = *force != value;
    *force = value;
    moved
}
