//! The alternating direction method of multipliers, which comes near a solution where Newton's method goes in circles.
//!
//! Coulomb's law is no minimisation, but with the shift s = μ |w_t| of each contact's normal velocity it becomes one (De Saxcé &
//! Feng 1998): λ minimises λᵀ A λ / 2 + (b + s)ᵀ λ over the set K that the bounds leave, cones and intervals. The method takes the
//! quadratic part and the bounds in turns (Boyd, Parikh, Chu, Peleato & Eckstein 2011, section 3.1), each time with the
//! shift of the velocities so far (Carpentier, Montaut & Le Lidec 2024):
//!
//! (A + ρ D) x = ρ D y − u − b − s,  y = P_K(x + u / (ρ D)),  u ← u + ρ D (x − y),
//!
//! where −u tends to w + s. D is A's diagonal but for the rows of a contact, which have one number together, so that the projection P_K is
//! the nearest point. Rows may depend on each other and A's diagonal may vanish. The penalty ρ balances how far x and y are apart
//! against how far y still moves, both by their own magnitudes.

use super::problem::{Bound, Problem};
use super::residual::{between, norm};
use super::skyline::Skyline;

/// Iterations after which the penalty may change.
const ADAPTED_EVERY: u32 = 10;

/// The penalty is changed when one part of the error is this many times the other, by no more than the greatest change at a
/// time and within its range.
const IMBALANCE: f64 = 3.0;
const GREATEST_CHANGE: f64 = 10.0;
const PENALTIES: [f64; 2] = [1e-8, 1e8];

/// The least entry of D, as a share of the greatest.
const LEAST_SCALE: f64 = 1e-12;

/// The iteration; n rows.
#[derive(Debug, Clone, Default)]
pub(super) struct Splitting {
    /// n × n, A + ρ D, and its factor with the order of its rows.
    matrix: Vec<f64>,
    factor: Skyline,
    order: Vec<usize>,
    /// n each: D, y, its last value, u, x, and the right-hand side in the factor's order.
    scale: Vec<f64>,
    point: Vec<f64>,
    last: Vec<f64>,
    dual: Vec<f64>,
    unbounded: Vec<f64>,
    side: Vec<f64>,
    /// ρ.
    penalty: f64,
    count: u32,
}

impl Splitting {
    /// Begins at `lambda`, whose velocities are `velocity`.
    pub(super) fn begin(&mut self, problem: &Problem<'_>, lambda: &[f64], velocity: &[f64]) {
        let n = problem.rows();
        let diagonal = |row: usize| problem.matrix[row * (n + 1)];
        let greatest = (0..n).map(diagonal).fold(f64::MIN_POSITIVE, f64::max);
        self.scale.clear();
        self.scale.extend((0..n).map(|row| diagonal(row).max(LEAST_SCALE * greatest)));
        let Self { scale, dual, .. } = self;
        dual.clear();
        dual.extend(velocity.iter().map(|w| -w));
        each_contact(problem, |normal, coefficient, row| {
            let same = (scale[row] * scale[row + 1]).sqrt().max(scale[normal]);
            (scale[normal], scale[row], scale[row + 1]) = (same, same, same);
            dual[normal] -= coefficient * norm([velocity[row], velocity[row + 1]]);
        });
        self.point.clear();
        self.point.extend_from_slice(lambda);
        self.unbounded.clear();
        self.unbounded.resize(n, 0.0);
        self.penalty = 1.0;
        self.count = 0;
        self.factorise(problem);
    }

    /// y, which satisfies the bounds.
    pub(super) fn point(&self) -> &[f64] {
        &self.point
    }

    /// Iterates `count` times.
    pub(super) fn iterate(&mut self, problem: &Problem<'_>, count: u32) {
        for _ in 0..count {
            self.minimise(problem);
            self.last.clone_from(&self.point);
            for row in 0..problem.rows() {
                let weight = self.penalty * self.scale[row];
                self.dual[row] += weight * self.unbounded[row];
                self.point[row] = self.dual[row] / weight;
            }
            project_onto_cones(problem, &mut self.point);
            for row in 0..problem.rows() {
                self.dual[row] -= self.penalty * self.scale[row] * self.point[row];
            }
            self.count += 1;
            if self.count.is_multiple_of(ADAPTED_EVERY) {
                self.adapt(problem);
            }
        }
    }

    fn factorise(&mut self, problem: &Problem<'_>) {
        let n = problem.rows();
        self.matrix.clear();
        self.matrix.extend_from_slice(problem.matrix);
        for (diagonal, scale) in self.matrix.iter_mut().step_by(n + 1).zip(&self.scale) {
            *diagonal += self.penalty * scale;
        }
        self.order.clear();
        self.order.extend(0..n);
        self.factor.factorise(&self.matrix, n, &mut self.order);
    }

    /// x.
    fn minimise(&mut self, problem: &Problem<'_>) {
        let Self { scale, point, dual, unbounded, penalty, .. } = self;
        for (row, side) in unbounded.iter_mut().enumerate() {
            *side = *penalty * scale[row] * point[row] - dual[row] - problem.offset[row];
        }
        each_contact(problem, |normal, coefficient, row| {
            unbounded[normal] -= coefficient * norm([dual[row], dual[row + 1]]);
        });
        self.side.clear();
        self.side.extend(self.order.iter().map(|row| self.unbounded[*row]));
        self.factor.half_solve(&mut self.side);
        self.factor.finish(&mut self.side);
        for (row, x) in self.order.iter().zip(&self.side) {
            self.unbounded[*row] = *x;
        }
    }

    /// Changes the penalty where one part of the error outweighs the other.
    fn adapt(&mut self, problem: &Problem<'_>) {
        let (mut apart, mut force, mut moved, mut velocity) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        for row in 0..problem.rows() {
            let (x, y) = (self.unbounded[row], self.point[row]);
            apart = apart.max((x - y).abs());
            force = force.max(x.abs().max(y.abs()));
            moved = moved.max(self.penalty * self.scale[row] * (y - self.last[row]).abs());
            velocity = velocity.max(self.dual[row].abs());
        }
        let ratio = (apart * velocity) / (moved * force);
        if ratio.is_finite() && ratio > 0.0 && !(1.0 / IMBALANCE..IMBALANCE).contains(&ratio) {
            let change = ratio.sqrt().clamp(1.0 / GREATEST_CHANGE, GREATEST_CHANGE);
            self.penalty = between(self.penalty * change, PENALTIES[0], PENALTIES[1]);
            self.factorise(problem);
        }
    }
}

/// Calls `take` with the normal row, the coefficient and the first tangential row of every contact.
fn each_contact(problem: &Problem<'_>, mut take: impl FnMut(usize, f64, usize)) {
    let mut row = 0;
    while row < problem.rows() {
        if let Bound::Friction { normal, coefficient } = problem.bounds[row] {
            take(normal, coefficient, row);
            row += 1;
        }
        row += 1;
    }
}

/// Moves every force to the nearest that its bound allows, of a contact all three together.
fn project_onto_cones(problem: &Problem<'_>, force: &mut [f64]) {
    each_contact(problem, |normal, coefficient, row| {
        let tangent = [force[row], force[row + 1]];
        let (along, push) = (norm(tangent), force[normal]);
        if along > coefficient * push {
            // The nearest point of the cone's surface, or its tip.
            let to = ((push + coefficient * along) / (1.0 + coefficient * coefficient)).max(0.0);
            let shrink = if along > 0.0 { coefficient * to / along } else { 0.0 };
            force[normal] = to;
            [force[row], force[row + 1]] = tangent.map(|each| shrink * each);
        }
    });
    for (force, bound) in force.iter_mut().zip(problem.bounds) {
        match *bound {
            Bound::NonNegative => *force = force.max(0.0),
            Bound::Box { lower, upper } => *force = between(*force, lower, upper),
            Bound::Free | Bound::Friction { .. } => {}
        }
    }
}
