//! A step without its impacts: what motors, joints, loops and locks do where nothing strikes.

use super::assembly::Rows;
use crate::sim::lcp::{Bound, Problem, Solver};

/// The forces of the rows that act in a step whether there is an [impact](super::RowOwner::is_impact) or not, in the absence of
/// those that are one.
///
/// The row of a motor may hold more than its motor: damper, spring and, in maximal coordinates, rotor of the joint, which push back in
/// an impact as any link does. What it gives here is its own; the rest is an answer to the impact.
#[derive(Debug, Clone, Default)]
pub struct WithoutImpact {
    /// These rows among all.
    rows: Vec<usize>,
    /// Their own problem, of which `force` is the solution.
    matrix: Vec<f64>,
    offset: Vec<f64>,
    bounds: Vec<Bound>,
    force: Vec<f64>,
    /// One a row of all: the force of such a row, 0 for all others, N or N m.
    pub forces: Vec<f64>,
}

impl WithoutImpact {
    /// Room for `lasting` such rows among `all`.
    pub fn new(lasting: usize, all: usize) -> Self {
        Self {
            rows: Vec::with_capacity(lasting),
            matrix: Vec::with_capacity(lasting * lasting),
            offset: Vec::with_capacity(lasting),
            bounds: Vec::with_capacity(lasting),
            force: Vec::with_capacity(lasting),
            forces: Vec::with_capacity(all),
        }
    }

    /// Solves the problem of such rows among `rows`, from the forces that they have.
    pub fn solve(&mut self, rows: &Rows, solver: &mut impl Solver) {
        self.rows.clear();
        self.rows.extend((0..rows.len()).filter(|&row| !rows.owner[row].is_impact()));
        self.offset.clear();
        self.offset.extend(self.rows.iter().map(|&row| rows.offset[row]));
        self.bounds.clear();
        self.bounds.extend(self.rows.iter().map(|&row| rows.bounds[row]));
        self.force.clear();
        self.force.extend(self.rows.iter().map(|&row| rows.force[row]));
        self.matrix.clear();
        for &row in &self.rows {
            self.matrix.extend(self.rows.iter().map(|&other| rows.entry(row, other)));
        }
        if !self.rows.is_empty() {
            let Self { matrix, offset, bounds, force, .. } = self;
            let problem = Problem { matrix, symmetric: true, offset, bounds, cone: false, enough: 0.0 };
            solver.solve(&problem, force);
        }
        self.forces.clear();
        self.forces.resize(rows.len(), 0.0);
        for (&row, &force) in self.rows.iter().zip(&self.force) {
            self.forces[row] = force;
        }
    }
}
