//! The mixed linear complementarity problem, what a solve reports, and what a solver is.

/// What the force of a row may be, and what its velocity must then do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// Any force; w = 0 (rows e, unsaturated rows s).
    Free,
    /// λ ≥ 0, w ≥ 0, λ w = 0 (rows c: contact normals, joint limits).
    NonNegative,
    /// lower ≤ λ ≤ upper; w ≥ 0 at the lower end, w ≤ 0 at the upper, w = 0 between (saturated
    /// rows s, dry friction). Either end may be infinite.
    Box {
        /// Least force, N or N m.
        lower: f64,
        /// Greatest force, N or N m.
        upper: f64,
    },
    /// First tangential row of a contact; the row after it is the second and carries the same bound.
    /// |λ_t| ≤ coefficient · max(λ_normal, 0): as a disc over both rows (cone) or for each row alone
    /// (pyramid); where it is reached, the force opposes the sliding velocity.
    Friction {
        /// Index of the row of the contact's normal force, which is itself no friction row.
        normal: usize,
        /// Coefficient of friction, finite and not negative.
        coefficient: f64,
    },
}

/// Find λ such that w = A λ + b satisfies every row's bound.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// A, n × n, row-major. The simulator's are symmetric and positive semidefinite, with unit
    /// (m/s)/N and the like.
    pub matrix: &'a [f64],
    /// Whether A is symmetric, which spares a solver half the work. Where it is said to be and is not, another problem is
    /// solved.
    pub symmetric: bool,
    /// b, n, m/s or rad/s.
    pub offset: &'a [f64],
    /// n.
    pub bounds: &'a [Bound],
    /// Friction as a circular cone; otherwise as a pyramid.
    pub cone: bool,
    /// Residual, m/s or rad/s, that counts as solved where the solver's own tolerance takes more than Newton steps from the forces at
    /// hand; 0 where that tolerance alone counts.
    pub enough: f64,
}

impl Problem<'_> {
    /// Number of rows, n.
    pub fn rows(&self) -> usize {
        self.bounds.len()
    }

    /// How many rows from `row` on are bounded together: the two tangential rows of a circular cone,
    /// else the row alone.
    pub(super) fn block(&self, row: usize) -> usize {
        if self.cone && self.bounds[row].is_friction() { 2 } else { 1 }
    }

    /// Why this is no problem that a solver could start on with `lambda`: lengths and bounds alone,
    /// for the numbers of A and b show in the first product.
    pub(super) fn refusal(&self, lambda: &[f64]) -> Option<SolveStatus> {
        let n = self.rows();
        if self.matrix.len() != n * n || self.offset.len() != n || lambda.len() != n {
            return Some(SolveStatus::Malformed);
        }
        let mut row = 0;
        while row < n {
            match self.bounds[row] {
                Bound::Free | Bound::NonNegative => {}
                Bound::Box { lower, upper } => {
                    if lower.is_nan() || upper.is_nan() {
                        return Some(SolveStatus::NotFinite);
                    }
                    if lower > upper || lower == f64::INFINITY || upper == f64::NEG_INFINITY {
                        return Some(SolveStatus::Malformed);
                    }
                }
                Bound::Friction { normal, coefficient } => {
                    if !coefficient.is_finite() {
                        return Some(SolveStatus::NotFinite);
                    }
                    let paired = self.bounds.get(row + 1) == Some(&self.bounds[row]);
                    let pressed = matches!(self.bounds.get(normal), Some(bound) if !bound.is_friction());
                    if !paired || !pressed || coefficient < 0.0 {
                        return Some(SolveStatus::Malformed);
                    }
                    row += 1;
                }
            }
            row += 1;
        }
        None
    }
}

impl Bound {
    pub(super) fn is_friction(&self) -> bool {
        matches!(self, Self::Friction { .. })
    }

    /// The interval of a row's force while the other forces stay; of a friction row, that of the pyramid.
    pub(in crate::sim) fn interval(&self, lambda: &[f64]) -> (f64, f64) {
        match *self {
            Self::Free => (f64::NEG_INFINITY, f64::INFINITY),
            Self::NonNegative => (0.0, f64::INFINITY),
            Self::Box { lower, upper } => (lower, upper),
            Self::Friction { normal, coefficient } => {
                let radius = coefficient * lambda[normal].max(0.0);
                (-radius, radius)
            }
        }
    }
}

/// How a solve ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solution {
    /// Whether λ solves the problem, and if not, why.
    pub status: SolveStatus,
    /// Sweeps, Newton steps or pivots used.
    pub iterations: u32,
    /// Of the returned λ, m/s or rad/s, see [`residual`](super::residual()).
    pub residual: f64,
}

impl Solution {
    pub(super) fn refused(status: SolveStatus) -> Self {
        Self { status, iterations: 0, residual: f64::NAN }
    }
}

/// Whether a solve found a solution, and if not, why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveStatus {
    /// The residual is within the tolerance.
    Solved,
    /// The budget ended first.
    IterationLimit,
    /// The pivoting ended on a ray: no solution found (infeasible, or outside the class the method handles).
    Ray,
    /// A row cannot be moved (zero or negative diagonal, or an equality that contradicts the others)
    /// although its bound asks for it.
    Singular,
    /// A number of the problem or of the solution is not finite.
    NotFinite,
    /// The solver does not handle this kind of problem (a circular cone in a linear method).
    Unsupported,
    /// The lengths disagree, or a bound is none: an empty box, a negative coefficient, a friction row
    /// without its second row or without a normal row.
    Malformed,
}

/// A method that solves a [`Problem`].
///
/// A solver owns its scratch memory, which grows to the largest problem seen and is then only reused.
/// What it leaves depends on the problem and the start alone, never on earlier solves.
pub trait Solver {
    /// Solves `problem` from the start `lambda` (n, N or N m) and leaves the solution there.
    ///
    /// The forces left satisfy their bounds whatever the status, but for [`SolveStatus::Malformed`] and
    /// [`SolveStatus::NotFinite`], which leave nothing of use.
    fn solve(&mut self, problem: &Problem<'_>, lambda: &mut [f64]) -> Solution;
}
