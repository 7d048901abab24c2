//! One Newton step on the natural map: find which rows are at their bounds, and solve for the others.

use multiversion::multiversion;

use super::equations::{Equations, Extent, PROXIMITY};
use super::pieces::Pieces;
use super::problem::Problem;
use super::residual::{evaluate, project, velocities};

/// What came of a step.
#[derive(Debug, Clone, Copy)]
pub(super) enum NewtonStep {
    /// The forces are those of the active set, and leave this residual.
    Taken {
        /// m/s or rad/s.
        residual: f64,
    },
    /// The equations of the active set contradict each other, and forces without bound would not
    /// satisfy them. The forces are unchanged but for the held ones.
    Contradiction,
    /// The elimination found no pivot. The forces are unchanged but for the held ones.
    Singular,
}

/// The scratch memory of the step.
#[derive(Debug, Clone, Default)]
pub(super) struct ActiveSet {
    pieces: Pieces,
    equations: Equations,
}

/// Replaces `lambda`, whose velocities are `velocity`, by the solution of its active set projected
/// onto the bounds, and `velocity` by what belongs to that.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn step(
    active: &mut ActiveSet,
    problem: &Problem<'_>,
    lambda: &mut [f64],
    velocity: &mut [f64],
) -> NewtonStep {
    let ActiveSet { pieces, equations } = active;
    if pieces.classify(problem, lambda, velocity) {
        velocities(problem, lambda, velocity);
    }
    let Some(Extent { asked, gone }) = equations.solve(problem, pieces, velocity) else {
        return NewtonStep::Singular;
    };
    // What the equations lack after the step is the share of the unknowns that was added to them.
    if PROXIMITY * gone > 0.5 * asked {
        return NewtonStep::Contradiction;
    }
    let (changes, turns) = equations.solution();
    pieces.apply(changes, turns, lambda);
    project(problem, lambda);
    NewtonStep::Taken { residual: evaluate(problem, lambda, velocity) }
}
