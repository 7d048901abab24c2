//! A mixed problem with friction pyramids as a standard one: w = M z + q, w ≥ 0, z ≥ 0, w · z = 0.
//!
//! - λ ≥ 0 is its own z; a box is λ = base ± z from one of its ends, and when the other end is finite
//!   too, a multiplier ν ≥ 0 on the room left: w_z = ± w + ν, 0 ≤ room − z ⟂ ν.
//! - A row of a pyramid is λ_t = z₊ − z₋ with the multiplier γ ≥ 0 of its rim: w₊ = w_t + γ,
//!   w₋ = −w_t + γ, 0 ≤ μ λ_n − z₊ − z₋ ⟂ γ. The matrix that comes of it is copositive for a positive
//!   semidefinite A, which Lemke's method needs (Anitescu & Potra 1997, with one
//!   multiplier per tangent instead of one per contact).
//! - Free forces are eliminated from their own equations by complete pivoting.
//! - Every force is scaled by 1/√A_ii, which gives M a unit diagonal whatever the mass ratio.

use super::problem::{Bound, Problem, SolveStatus};

/// A pivot below this share of the unit diagonal is a rounding error: its equation depends on the others.
const DEPENDENT: f64 = 1e-13;

/// A nonnegative or free variable that moves a force.
#[derive(Debug, Clone, Copy)]
struct Force {
    row: usize,
    /// λ_row grows by this much for each unit of the variable, N.
    factor: f64,
}

/// A nonnegative variable on the room that is left to one or two others.
#[derive(Debug, Clone, Copy)]
struct Multiplier {
    /// Those others; twice the same when it is one.
    forces: [usize; 2],
    room: f64,
    /// The variable of the normal force that widens the room, and by how much each unit does.
    normal: Option<(usize, f64)>,
}

/// The lifted problem. Variables stand in the order: free forces, nonnegative forces, multipliers.
#[derive(Debug, Clone, Default)]
pub(super) struct Standard {
    forces: Vec<Force>,
    multipliers: Vec<Multiplier>,
    /// n, λ where every variable is zero, N.
    base: Vec<f64>,
    /// n, the variable of a row that has a single one.
    variable_of: Vec<Option<usize>>,
    /// Of `forces`, how many are free.
    free: usize,
    /// Of each free force, the row of `table` that gives it.
    solved_by: Vec<Option<usize>>,
    /// Each row gives a variable's w (of a solved free force, the force itself) from all variables; the
    /// last column is the constant.
    table: Vec<f64>,
}

impl Standard {
    /// Lifts `problem`.
    ///
    /// # Errors
    /// [`SolveStatus::Unsupported`] for a circular cone, for friction under a normal force that may be
    /// negative, and for free forces that only other rows could determine (A not positive semidefinite).
    pub(super) fn lift(&mut self, problem: &Problem<'_>) -> Result<(), SolveStatus> {
        self.place_variables(problem)?;
        self.fill(problem);
        self.eliminate()
    }

    /// Number of variables of the standard problem.
    pub(super) fn size(&self) -> usize {
        self.width() - 1 - self.free
    }

    /// Row `index` of M and its entry of q.
    pub(super) fn row(&self, index: usize) -> (&[f64], f64) {
        let start = (self.free + index) * self.width();
        let row = &self.table[start + self.free..start + self.width()];
        (&row[..row.len() - 1], row[row.len() - 1])
    }

    /// Whether an equality was left out because it depends on the others, rightly or not.
    pub(super) fn has_dependent_rows(&self) -> bool {
        self.solved_by.iter().any(Option::is_none)
    }

    /// The forces that belong to the solution `z` of the standard problem.
    pub(super) fn recover(&self, z: &[f64], lambda: &mut [f64]) {
        lambda.copy_from_slice(&self.base);
        let (free, nonnegative) = self.forces.split_at(self.free);
        for (force, value) in nonnegative.iter().zip(z) {
            lambda[force.row] += force.factor * value;
        }
        for (force, solved_by) in free.iter().zip(&self.solved_by) {
            if let Some(row) = *solved_by {
                let row = &self.table[row * self.width()..(row + 1) * self.width()];
                let known = &row[self.free..self.width() - 1];
                let sum: f64 = known.iter().zip(z).map(|(coefficient, value)| coefficient * value).sum();
                lambda[force.row] += force.factor * (sum + row[self.width() - 1]);
            }
        }
    }

    fn width(&self) -> usize {
        self.forces.len() + self.multipliers.len() + 1
    }

    fn place_variables(&mut self, problem: &Problem<'_>) -> Result<(), SolveStatus> {
        let n = problem.rows();
        self.forces.clear();
        self.multipliers.clear();
        self.base.clear();
        self.base.resize(n, 0.0);
        self.variable_of.clear();
        self.variable_of.resize(n, None);
        for (row, bound) in problem.bounds.iter().enumerate() {
            if bound.interval(&self.base) == (f64::NEG_INFINITY, f64::INFINITY) {
                self.forces.push(Force { row, factor: unit(problem, row) });
            }
        }
        self.free = self.forces.len();
        for (row, bound) in problem.bounds.iter().enumerate() {
            match *bound {
                Bound::NonNegative => self.place_interval(problem, row, 0.0, f64::INFINITY),
                Bound::Box { lower, upper } => self.place_interval(problem, row, lower, upper),
                Bound::Free | Bound::Friction { .. } => {}
            }
        }
        for (row, bound) in problem.bounds.iter().enumerate() {
            if let Bound::Friction { normal, coefficient } = *bound {
                self.place_pyramid(problem, row, normal, coefficient)?;
            }
        }
        Ok(())
    }

    /// A force within an interval that has at least one end.
    fn place_interval(&mut self, problem: &Problem<'_>, row: usize, lower: f64, upper: f64) {
        let unit = unit(problem, row);
        // From the end nearer to zero, so that a generous bound costs no digits.
        let (base, factor) = if lower.abs() <= upper.abs() { (lower, unit) } else { (upper, -unit) };
        if !base.is_finite() {
            return;
        }
        self.base[row] = base;
        if lower == upper {
            return;
        }
        let variable = self.forces.len();
        self.variable_of[row] = Some(variable);
        self.forces.push(Force { row, factor });
        let room = (upper - lower) / unit;
        if room.is_finite() {
            self.multipliers.push(Multiplier { forces: [variable; 2], room, normal: None });
        }
    }

    fn place_pyramid(
        &mut self,
        problem: &Problem<'_>,
        row: usize,
        normal: usize,
        coefficient: f64,
    ) -> Result<(), SolveStatus> {
        let pushing = match problem.bounds[normal] {
            Bound::NonNegative => true,
            Bound::Box { lower, .. } => lower >= 0.0,
            Bound::Free | Bound::Friction { .. } => false,
        };
        if problem.cone || !pushing {
            return Err(SolveStatus::Unsupported);
        }
        if coefficient > 0.0 {
            let unit = unit(problem, row);
            let plus = self.forces.len();
            self.forces.push(Force { row, factor: unit });
            self.forces.push(Force { row, factor: -unit });
            let room = coefficient * self.base[normal] / unit;
            let widen = |variable: usize| (variable, coefficient * self.forces[variable].factor / unit);
            let normal = self.variable_of[normal].map(widen);
            self.multipliers.push(Multiplier { forces: [plus, plus + 1], room, normal });
        }
        Ok(())
    }

    fn fill(&mut self, problem: &Problem<'_>) {
        let n = problem.rows();
        let width = self.width();
        let first_multiplier = self.forces.len();
        self.table.clear();
        self.table.resize((width - 1) * width, 0.0);
        for (force, row) in self.forces.iter().zip(self.table.chunks_exact_mut(width)) {
            let matrix = &problem.matrix[force.row * n..(force.row + 1) * n];
            for (entry, other) in row.iter_mut().zip(&self.forces) {
                *entry = force.factor * matrix[other.row] * other.factor;
            }
            let still: f64 = matrix.iter().zip(&self.base).map(|(entry, base)| entry * base).sum();
            row[width - 1] = force.factor * (still + problem.offset[force.row]);
        }
        for (index, multiplier) in self.multipliers.iter().enumerate() {
            let own = first_multiplier + index;
            for force in multiplier.forces {
                self.table[force * width + own] = 1.0;
                self.table[own * width + force] = -1.0;
            }
            if let Some((variable, slope)) = multiplier.normal {
                self.table[own * width + variable] = slope;
            }
            self.table[own * width + width - 1] = multiplier.room;
        }
    }

    /// Solves the equations w = 0 of the free forces for them, as far as they are independent.
    fn eliminate(&mut self) -> Result<(), SolveStatus> {
        let width = self.width();
        let free = self.free;
        self.solved_by.clear();
        self.solved_by.resize(free, None);
        for _ in 0..free {
            let Some((pivot_row, pivot_column)) = self.greatest_pivot() else { break };
            self.solved_by[pivot_column] = Some(pivot_row);
            let pivot = self.table[pivot_row * width + pivot_column];
            let (before, rest) = self.table.split_at_mut(pivot_row * width);
            let (solved, after) = rest.split_at_mut(width);
            solved[pivot_column] = 0.0;
            for entry in solved.iter_mut() {
                *entry /= -pivot;
            }
            for row in before.chunks_exact_mut(width).chain(after.chunks_exact_mut(width)) {
                let factor = row[pivot_column];
                row[pivot_column] = 0.0;
                for (entry, lead) in row.iter_mut().zip(solved.iter()) {
                    *entry += factor * lead;
                }
            }
        }
        for row in (0..free).filter(|row| !self.solved_by.contains(&Some(*row))) {
            let others = &self.table[row * width + free..(row + 1) * width - 1];
            if others.iter().any(|entry| entry.abs() > DEPENDENT.sqrt()) {
                return Err(SolveStatus::Unsupported);
            }
        }
        Ok(())
    }

    /// The greatest entry of the free equations and forces not yet solved, unless it is a rounding error.
    fn greatest_pivot(&self) -> Option<(usize, usize)> {
        let mut greatest = DEPENDENT;
        let mut place = None;
        for row in (0..self.free).filter(|row| !self.solved_by.contains(&Some(*row))) {
            for column in (0..self.free).filter(|column| self.solved_by[*column].is_none()) {
                let entry = self.table[row * self.width() + column].abs();
                if entry > greatest {
                    greatest = entry;
                    place = Some((row, column));
                }
            }
        }
        place
    }
}

/// The force that makes a row unit velocity times the root of its diagonal: 1/√A_ii, or 1 where A_ii is
/// not positive.
fn unit(problem: &Problem<'_>, row: usize) -> f64 {
    let diagonal = problem.matrix[row * (problem.rows() + 1)];
    if diagonal > 0.0 { 1.0 / diagonal.sqrt() } else { 1.0 }
}
