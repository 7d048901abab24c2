//! A problem with a proximal term, whose solution is the next point on the way to a solution of the problem itself.

use super::problem::{Bound, Problem};

/// How many times a proximal step may be prolonged.
const LONGEST_WAY: f64 = 1e9;

/// A problem that differs from the one to be solved by a proximal term, and its solution.
#[derive(Debug, Clone, Default)]
pub(super) struct Nearby {
    /// n × n, row-major.
    pub matrix: Vec<f64>,
    /// n each.
    pub offset: Vec<f64>,
    pub solution: Vec<f64>,
}

impl Nearby {
    /// Becomes `problem` with a proximal term of `share` of its diagonal about `point`.
    pub fn pose(&mut self, problem: &Problem<'_>, point: &[f64], share: f64) {
        let n = problem.rows();
        self.matrix.clear();
        self.matrix.extend_from_slice(problem.matrix);
        self.offset.clear();
        self.offset.extend_from_slice(problem.offset);
        for (row, (offset, force)) in self.offset.iter_mut().zip(point).enumerate() {
            let added = share * problem.matrix[row * (n + 1)];
            self.matrix[row * (n + 1)] += added;
            *offset -= added * force;
        }
    }
}

/// How many times the way from `from` to `to` leads to the first bound of `problem` that is reached beyond `to`, at most
/// [`LONGEST_WAY`]. Forces at their bounds follow them.
pub(super) fn longest_way(problem: &Problem<'_>, from: &[f64], to: &[f64]) -> f64 {
    let mut way = LONGEST_WAY;
    let mut reach = |room: f64, change: f64| {
        if change > 0.0 && room > change {
            way = way.min(room / change);
        }
    };
    let mut row = 0;
    while row < problem.rows() {
        let change = to[row] - from[row];
        match problem.bounds[row] {
            Bound::Free => {}
            Bound::NonNegative => reach(from[row], -change),
            Bound::Box { lower, upper } => {
                reach(from[row] - lower, -change);
                reach(upper - from[row], change);
            }
            Bound::Friction { normal, coefficient } => {
                let (radius, widening) =
                    (coefficient * from[normal], coefficient * (to[normal] - from[normal]));
                if problem.cone {
                    // |t + s Δt| = r + s Δr, a quadratic equation in s.
                    let across = to[row + 1] - from[row + 1];
                    let a = change * change + across * across - widening * widening;
                    let b = from[row] * change + from[row + 1] * across - radius * widening;
                    let c = from[row] * from[row] + from[row + 1] * from[row + 1] - radius * radius;
                    let root = (b * b - a * c).max(0.0).sqrt();
                    let denominator = b + root;
                    // c < 0 inside the cone; the smallest positive s.
                    if c < 0.0 && denominator > 0.0 {
                        reach(-c, denominator);
                    }
                } else {
                    reach(radius + from[row], -change - widening);
                    reach(radius - from[row], change - widening);
                }
            }
        }
        row += problem.block(row);
    }
    way
}
