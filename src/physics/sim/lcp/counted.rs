//! A solver with a count of what it did.

use super::problem::{Problem, Solution, Solver};

/// How much was solved: a measure of work that does not depend on the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SolverWork {
    /// Complementarity problems: those of forces, of feedforward and of the correction of positions.
    pub problems: u64,
    /// Their rows.
    pub rows: u64,
    /// Newton steps, sweeps or pivots.
    pub iterations: u64,
}

/// A solver with a count of what it did.
#[derive(Debug, Clone)]
pub struct Counted<S> {
    inner: S,
    /// Since it was made.
    pub work: SolverWork,
}

impl<S: Solver> Counted<S> {
    /// Around `inner`.
    pub fn new(inner: S) -> Self {
        Self { inner, work: SolverWork::default() }
    }
}

impl<S: Solver> Solver for Counted<S> {
    fn solve(&mut self, problem: &Problem<'_>, lambda: &mut [f64]) -> Solution {
        let solution = self.inner.solve(problem, lambda);
        self.work.problems += 1;
        self.work.rows += lambda.len() as u64;
        self.work.iterations += u64::from(solution.iterations);
        solution
    }
}
