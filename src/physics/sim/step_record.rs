//! What the steps of a simulation took, and what they left unsolved.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::step_totals::StepTotals;

/// What the steps of a simulation took, and what they left unsolved: counts and greatest values over all steps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct StepRecord {
    /// Greatest residual of a step's complementarity problem, m/s or rad/s (see
    /// [`lcp::residual`](super::lcp::residual())); not of the one of the velocities that correct positions.
    pub greatest_residual: f64,
    /// Steps that went on with forces that do not solve their complementarity problem, or that of the velocities that correct positions:
    /// the solver's budget had ended, a row that has to move cannot be moved, or actuators went to and from their bounds without end.
    pub unsolved_steps: u64,
    /// Steps that were divided into substeps.
    pub divided_steps: u64,
    /// Divided steps in which the shortest substep allowed still created energy, drove a contact in, or missed the error tolerance, and
    /// was accepted.
    pub coarse_steps: u64,
    /// Greatest number of substeps of a step.
    pub greatest_substeps: u64,
    /// Greatest depth of a contact at the beginning of a step or substep, m.
    pub greatest_penetration: f64,
}

impl StepRecord {
    /// Adds a step that came to its end with these `totals`.
    pub(super) fn add(&mut self, totals: &StepTotals) {
        self.greatest_residual = self.greatest_residual.max(totals.residual());
        self.greatest_penetration = self.greatest_penetration.max(totals.depth());
        self.greatest_substeps = self.greatest_substeps.max(totals.substeps());
        self.unsolved_steps += u64::from(totals.is_unsolved());
        self.divided_steps += u64::from(totals.substeps() > 1);
        self.coarse_steps += u64::from(totals.is_coarse());
    }
}
