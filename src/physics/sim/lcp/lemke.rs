//! Lemke's method: complementary pivoting on the lifted problem, exact but for rounding.
//!
//! An artificial variable z₀, added to every row with a positive weight (the covering vector d), makes
//! the start feasible; then the complement of the variable that left the basis enters, until z₀ leaves
//! (a solution) or nothing can leave (a ray) (Cottle, Pang & Stone 1992, section 4.4). Ties of
//! the ratio test are broken lexicographically over the inverse of the basis, so that no basis comes twice
//! (ibid. section 4.9). For copositive-plus matrices, and with friction for the copositive ones of
//! [`standard`](super::standard), a ray means that there is no solution.
//!
//! With d = (1, …, 1) there are problems that take 2ⁿ pivots (Murty 1988, chapter 6). They rely on the
//! regular weights; the ones here are spread by the golden ratio, and take about n.
//!
//! Wherever the pivoting ends, Newton steps from there remove its rounding errors, and the residual of
//! the problem itself decides whether that is a solution.

use super::active::{self, ActiveSet, NewtonStep};
use super::problem::{Bound, Problem, Solution, SolveStatus, Solver};
use super::residual::{NEGLIGIBLE, evaluate, greatest_velocity, is_beyond_numbers, project};
use super::standard::Standard;

/// An entry of the scaled tableau below this is no pivot.
const PIVOT: f64 = 1e-11;

/// Ratios that differ by less than this share of them are tied.
const TIE: f64 = 1e-12;

/// A residual below this share of the greatest velocity in the problem is rounding.
const ROUNDING: f64 = 1e-10;

/// Newton steps that rid the solution of the pivoting's rounding errors.
const REFINEMENTS: u32 = 3;

/// Lemke's method with lexicographic ties, for problems without circular cones.
///
/// It does not use the start, and its cost does not depend on the mass ratio. It suits small problems:
/// a pivot of a problem lifted to m variables costs 2 m² operations.
#[derive(Debug, Clone)]
pub struct Lemke {
    iterations: u32,
    standard: Standard,
    tableau: Tableau,
    /// Of the solution of the lifted problem.
    z: Vec<f64>,
    refinement: ActiveSet,
    /// n each.
    velocity: Vec<f64>,
    trial: Vec<f64>,
    /// Those of [`Lemke::solve_standard`].
    bounds: Vec<Bound>,
}

impl Lemke {
    /// At most `iterations` pivots.
    pub fn new(iterations: u32) -> Self {
        Self {
            iterations,
            standard: Standard::default(),
            tableau: Tableau::default(),
            z: Vec::new(),
            refinement: ActiveSet::default(),
            velocity: Vec::new(),
            trial: Vec::new(),
            bounds: Vec::new(),
        }
    }

    /// Solves w = M z + q, w ≥ 0, z ≥ 0, w · z = 0 for `z`, with `matrix` M (n × n, row-major, of any
    /// kind) and `offset` q (n).
    pub fn solve_standard(&mut self, matrix: &[f64], offset: &[f64], z: &mut [f64]) -> Solution {
        let mut bounds = std::mem::take(&mut self.bounds);
        bounds.clear();
        bounds.resize(offset.len(), Bound::NonNegative);
        let solution = self.solve(
            &Problem { matrix, symmetric: false, offset, bounds: &bounds, cone: false, enough: 0.0 },
            z,
        );
        self.bounds = bounds;
        solution
    }

    /// Newton steps on the natural map at the solution's active set: the solution anew from the
    /// problem's own numbers. Returns the residual and whether it is no more than rounding.
    fn refine(&mut self, problem: &Problem<'_>, lambda: &mut [f64]) -> (f64, bool) {
        project(problem, lambda);
        self.velocity.resize(lambda.len(), 0.0);
        let mut residual = evaluate(problem, lambda, &mut self.velocity);
        let rounding = ROUNDING * greatest_velocity(problem, lambda);
        self.trial.clear();
        self.trial.extend_from_slice(lambda);
        for _ in 0..REFINEMENTS {
            let NewtonStep::Taken { residual: refined } =
                active::step(&mut self.refinement, problem, &mut self.trial, &mut self.velocity)
            else {
                break;
            };
            if refined < residual && refined <= rounding {
                residual = refined;
                lambda.copy_from_slice(&self.trial);
            }
        }
        (residual, residual <= rounding && !is_beyond_numbers(problem, lambda, 0.0, NEGLIGIBLE))
    }
}

impl Solver for Lemke {
    fn solve(&mut self, problem: &Problem<'_>, lambda: &mut [f64]) -> Solution {
        if let Some(status) = problem.refusal(lambda) {
            return Solution::refused(status);
        }
        if !problem.matrix.iter().chain(problem.offset).all(|number| number.is_finite()) {
            return Solution::refused(SolveStatus::NotFinite);
        }
        lambda.fill(0.0);
        project(problem, lambda);
        if let Err(status) = self.standard.lift(problem) {
            return Solution::refused(status);
        }
        let (end, iterations) = self.tableau.solve(&self.standard, self.iterations, &mut self.z);
        self.standard.recover(&self.z, lambda);
        let (residual, exact) = self.refine(problem, lambda);
        let status = if exact {
            SolveStatus::Solved
        } else if !residual.is_finite() {
            SolveStatus::NotFinite
        } else if end == SolveStatus::Solved || self.standard.has_dependent_rows() {
            SolveStatus::Singular
        } else {
            end
        };
        Solution { status, iterations, residual }
    }
}

/// The weight of z₀ in a row, between 1 and 2.
fn cover(row: usize) -> f64 {
    /// 1 less than the golden ratio, whose multiples spread most evenly over the unit interval.
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    1.0 + ((row + 1) as f64 * GOLDEN).fract()
}

/// The equations I w − M z − d z₀ = q, multiplied by the inverse of the present basis.
#[derive(Debug, Clone, Default)]
struct Tableau {
    /// Variables of the problem, m.
    size: usize,
    /// m × (2 m + 2), row-major. Columns: w, z, z₀, q.
    entries: Vec<f64>,
    /// m, the column of the basic variable of each row.
    basis: Vec<usize>,
    /// Rows that still tie for leaving.
    tied: Vec<usize>,
}

impl Tableau {
    /// Pivots at most `limit` times; leaves the basic solution in `z`.
    fn solve(&mut self, standard: &Standard, limit: u32, z: &mut Vec<f64>) -> (SolveStatus, u32) {
        self.load(standard);
        let m = self.size;
        let artificial = 2 * m;
        let mut status = SolveStatus::Solved;
        let mut pivots = 0;
        if let Some(mut row) = self.most_violated() {
            let mut entering = artificial;
            status = SolveStatus::IterationLimit;
            while pivots < limit {
                let leaving = self.pivot(row, entering);
                pivots += 1;
                if leaving == artificial {
                    status = SolveStatus::Solved;
                    break;
                }
                entering = if leaving < m { leaving + m } else { leaving - m };
                let Some(next) = self.ratio_test(entering) else {
                    status = SolveStatus::Ray;
                    break;
                };
                row = next;
            }
        }
        z.clear();
        z.resize(m, 0.0);
        for (row, &variable) in self.basis.iter().enumerate() {
            if (m..artificial).contains(&variable) {
                z[variable - m] = self.entries[(row + 1) * self.width() - 1].max(0.0);
            }
        }
        (status, pivots)
    }

    fn width(&self) -> usize {
        2 * self.size + 2
    }

    fn load(&mut self, standard: &Standard) {
        self.size = standard.size();
        self.basis.clear();
        self.basis.extend(0..self.size);
        self.entries.clear();
        for index in 0..self.size {
            let (row, q) = standard.row(index);
            self.entries.extend((0..self.size).map(|column| if column == index { 1.0 } else { 0.0 }));
            self.entries.extend(row.iter().map(|entry| -entry));
            self.entries.extend([-cover(index), q]);
        }
    }

    /// The row that z₀ replaces first: the least q/d, of equals the last, which makes every row
    /// lexicographically positive. None when q ≥ 0, and z = 0 is a solution.
    fn most_violated(&self) -> Option<usize> {
        let mut least = 0.0;
        let mut place = None;
        for (row, entries) in self.entries.chunks_exact(self.width()).enumerate() {
            let ratio = entries[self.width() - 1] / cover(row);
            if ratio < 0.0 && ratio <= least {
                least = ratio;
                place = Some(row);
            }
        }
        place
    }

    /// Brings `entering` into the basis at `row`; returns the variable that leaves it.
    fn pivot(&mut self, row: usize, entering: usize) -> usize {
        let width = self.width();
        let (before, rest) = self.entries.split_at_mut(row * width);
        let (leader, after) = rest.split_at_mut(width);
        let inverse = 1.0 / leader[entering];
        for entry in leader.iter_mut() {
            *entry *= inverse;
        }
        leader[entering] = 1.0;
        for entries in before.chunks_exact_mut(width).chain(after.chunks_exact_mut(width)) {
            let factor = entries[entering];
            if factor != 0.0 {
                for (entry, lead) in entries.iter_mut().zip(leader.iter()) {
                    *entry -= factor * lead;
                }
                entries[entering] = 0.0;
            }
        }
        std::mem::replace(&mut self.basis[row], entering)
    }

    /// The row whose basic variable reaches zero first as `entering` grows, z₀ before others, else the
    /// lexicographically least; none on a ray.
    fn ratio_test(&mut self, entering: usize) -> Option<usize> {
        let width = self.width();
        let m = self.size;
        let at = |row: usize, column: usize| self.entries[row * width + column];
        self.tied.clear();
        self.tied.extend((0..m).filter(|&row| at(row, entering) > PIVOT));
        for column in std::iter::once(width - 1).chain(0..m) {
            let ratio = |row: usize| at(row, column) / at(row, entering);
            let least = self.tied.iter().map(|&row| ratio(row)).fold(f64::INFINITY, f64::min);
            self.tied.retain(|&row| ratio(row) <= least + TIE * least.abs().max(f64::MIN_POSITIVE));
            if column == width - 1
                && let Some(&row) = self.tied.iter().find(|&&row| self.basis[row] == 2 * m)
            {
                return Some(row);
            }
            if self.tied.len() <= 1 {
                break;
            }
        }
        self.tied.first().copied()
    }
}
