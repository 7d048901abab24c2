//! The rows of a step and how their problem was solved.

use super::detection::ContactDetection;
use crate::scene::{SolverChoice, SolverKind, StepPlan};
use crate::sim::lcp::{Counted, Equality, Lemke, Newton, Pgs, Problem, Solution, SolveStatus, Solver};
use crate::sim::restitution;
use crate::sim::rows::Rows;
use crate::sim::rows::without_impact::WithoutImpact;
use crate::sim::step_control::MAX_RECOVERY_ERROR;

/// The rows of a step and their solution. N is the number of rows.
#[derive(Debug, Clone)]
pub struct RowProblem {
    /// N rows and their problem. (rows, solve)
    pub rows: Rows,
    /// J: whether the lower and the upper end of the range have rows. (rows, crosses_limit)
    pub near_limit: Vec<[bool; 2]>,
    /// The half-solved impulse of all rows. (respond, recovery)
    pub half: Vec<f64>,
    /// Residual of the solution, m/s or rad/s. (solve)
    pub residual: f64,
    /// Whether the forces or those that correct positions do not solve their problem. (solve, solve_recovery)
    pub unsolved: bool,
    /// The solver that the plan chose. (new)
    pub solver: Counted<Equality<ChosenSolver>>,
    /// N forces kept while others are solved for, N or N m. (solve, solve_recovery)
    kept: Vec<f64>,
    /// The step without its impacts. (solve)
    without: WithoutImpact,
}

/// The solver that the plan chose.
#[derive(Debug, Clone)]
pub enum ChosenSolver {
    /// See [`Newton`].
    Newton(Box<Newton>),
    /// See [`Pgs`].
    Pgs(Pgs),
    /// See [`Lemke`].
    Lemke(Box<Lemke>),
}

impl ChosenSolver {
    fn new(choice: &SolverChoice) -> Self {
        match choice.kind {
            SolverKind::Newton => Self::Newton(Box::new(Newton::new(choice.iterations, choice.tolerance))),
            SolverKind::Pgs => Self::Pgs(Pgs::new(choice.iterations, choice.tolerance)),
            SolverKind::Lemke => Self::Lemke(Box::new(Lemke::new(choice.iterations))),
        }
    }
}

impl Solver for ChosenSolver {
    fn solve(&mut self, problem: &Problem<'_>, force: &mut [f64]) -> Solution {
        match self {
            Self::Newton(newton) => newton.solve(problem, force),
            Self::Pgs(pgs) => pgs.solve(problem, force),
            Self::Lemke(lemke) => lemke.solve(problem, force),
        }
    }
}

impl RowProblem {
    /// No rows; there is room for them in `rows`, each of `width` half-solved numbers at most, in which `joints` joints and up to
    /// `kept` rows have a part, and up to `lasting` whether anything strikes or not.
    pub fn new(
        plan: &StepPlan,
        rows: Rows,
        (width, joints): (usize, usize),
        (kept, lasting): (usize, usize),
    ) -> Self {
        let choice = &plan.accuracy.solver;
        let lasting = if plan.restitution.is_some() { lasting } else { 0 };
        Self {
            rows,
            near_limit: vec![[false; 2]; joints],
            half: vec![0.0; width],
            residual: 0.0,
            unsolved: false,
            solver: Counted::new(Equality::new(ChosenSolver::new(choice), choice.tolerance)),
            kept: Vec::with_capacity(kept),
            without: WithoutImpact::new(lasting, kept),
        }
    }

    /// Solves the rows' problem for a step of `step` seconds; the rows of the contacts of `detection` come first.
    pub fn solve(&mut self, plan: &StepPlan, detection: &ContactDetection, step: f64) -> SolveStatus {
        (self.residual, self.unsolved) = (0.0, false);
        if self.rows.is_empty() {
            return SolveStatus::Solved;
        }
        self.rows.assemble(step);
        let (problem, force) = self.rows.problem(plan.circular_friction());
        let mut solution = self.solver.solve(&problem, force);
        if self.rows.has_rebounds() {
            let Self { rows, solver, kept, without, .. } = self;
            let rebounding = detection.candidates.iter().filter(|candidate| candidate.rebound > 0.0);
            let restitution = rebounding.map(|it| it.material.restitution).fold(0.0, f64::max);
            let cone = plan.circular_friction();
            solution = restitution::bound(rows, solver, cone, restitution, solution, (kept, without));
        }
        self.residual = solution.residual;
        self.unsolved = solution.status != SolveStatus::Solved;
        solution.status
    }

    /// Solves the problem of the velocities along which positions move, and leaves the half-solved impulse of its
    /// forces in `half`; the rows keep those of the step. Its forces leave no velocity, so that what the solver leaves of it
    /// counts by how far it moves a position, and many dependent rows are not worth solving to the last digit.
    pub fn solve_recovery(&mut self, plan: &StepPlan, step: f64) -> SolveStatus {
        self.kept.clone_from(&self.rows.force);
        self.rows.ask_for_recovery(true);
        let enough = MAX_RECOVERY_ERROR * plan.units.length / step;
        let (problem, force) = self.rows.problem(plan.circular_friction());
        let solution = self.solver.solve(&Problem { enough, ..problem }, force);
        self.rows.impulse(step, &mut self.half);
        self.rows.ask_for_recovery(false);
        self.rows.force.clone_from(&self.kept);
        let astray = solution.residual.is_nan() || solution.residual > enough;
        self.unsolved |= solution.status != SolveStatus::Solved && astray;
        solution.status
    }

    /// Marks the ends of the ranges `limits` that joints at `angles` would cross in `step` seconds at the velocities `rates`;
    /// whether one of them had no row.
    pub fn mark_crossed_limits(
        &mut self,
        limits: &[[f64; 2]],
        angles: &[f64],
        rates: &[f64],
        step: f64,
    ) -> bool {
        let mut again = false;
        let joints = limits.iter().zip(angles).zip(rates).zip(&mut self.near_limit);
        for ((([lower, upper], angle), rate), near) in joints {
            let end = angle + step * rate;
            for (near, crossed) in near.iter_mut().zip([end < *lower, end > *upper]) {
                again |= crossed & !*near;
                *near |= crossed;
            }
        }
        again
    }
}
