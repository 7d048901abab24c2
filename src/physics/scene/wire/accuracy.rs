//! How finely a scene is simulated.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::Fault;

/// How finely a scene is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Accuracy {
    /// Time step, s; with `step_tolerance` the longest.
    pub step: f64,
    /// Greatest error that one step may add to a joint angle (rad), a joint position or the root's
    /// position (m): steps are divided until they keep it. `null` takes every step as it is.
    pub step_tolerance: Option<f64>,
    /// Method of integration.
    pub integrator: Integrator,
    /// Solver of the complementarity problem.
    pub solver: SolverChoice,
    /// Coordinates in which the character is simulated.
    pub coordinates: Coordinates,
    /// What the rows of joints ask for: of all in maximal coordinates, of those that close loops in reduced ones.
    pub joint_bias: JointBias,
    /// Shape of the set of admissible friction forces.
    pub friction_cone: FrictionCone,
}

impl Default for Accuracy {
    fn default() -> Self {
        Self {
            step: 0.002,
            step_tolerance: None,
            integrator: Integrator::default(),
            solver: SolverChoice::default(),
            coordinates: Coordinates::default(),
            joint_bias: JointBias::default(),
            friction_cone: FrictionCone::default(),
        }
    }
}

impl Accuracy {
    /// Everything impossible in these settings.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if !(1e-7..=0.1).contains(&self.step) {
            faults.push(Fault::new("/step", "the step must lie between 1e-7 and 0.1 s"));
        }
        if self.step_tolerance.is_some_and(|tolerance| !(1e-12..=1.0).contains(&tolerance)) {
            faults
                .push(Fault::new("/step_tolerance", "the tolerance of a step must lie between 1e-12 and 1"));
        }
        if !(1..=100_000).contains(&self.solver.iterations) {
            faults.push(Fault::new("/solver/iterations", "iterations must lie between 1 and 100000"));
        }
        if !(self.solver.tolerance.is_finite() && self.solver.tolerance >= 0.0) {
            faults
                .push(Fault::new("/solver/tolerance", "the tolerance must be a finite number of at least 0"));
        }
        if self.coordinates == Coordinates::Maximal && self.integrator == Integrator::MoreauJean {
            faults.push(Fault::new(
                "/integrator",
                "maximal coordinates are stepped by semi_implicit_euler only",
            ));
        }
        if self.solver.kind == SolverKind::Lemke && self.friction_cone == FrictionCone::Cone {
            faults.push(Fault::new(
                "/friction_cone",
                "the exact solver lemke works on linear problems: use the friction cone `pyramid` with it",
            ));
        }
        faults
    }
}

/// Method of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// New velocities first, then positions with the new velocities (Tokizaki & Hasegawa eqs. 8-9).
    #[default]
    SemiImplicitEuler,
    /// Moreau and Jean's time stepping with θ = 1/2: forces and contacts at the middle of the step, of
    /// second order where the motion is smooth.
    MoreauJean,
}

/// A solver and its budget.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverChoice {
    /// Which solver.
    pub kind: SolverKind,
    /// Greatest number of Newton steps, sweeps or pivots.
    pub iterations: u32,
    /// Residual, m/s or rad/s, below which an iterative solver stops.
    pub tolerance: f64,
}

impl Default for SolverChoice {
    fn default() -> Self {
        Self { kind: SolverKind::default(), iterations: 50, tolerance: 1e-9 }
    }
}

/// The solvers of the mixed linear complementarity problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverKind {
    /// Newton's method on the natural map, with Gauss-Seidel sweeps, proximal-point steps, pivoting and a splitting method behind it:
    /// exact to rounding in a few iterations.
    #[default]
    Newton,
    /// Projected Gauss-Seidel: iterative, with a budget.
    Pgs,
    /// Lemke's method with lexicographic ties: exact.
    Lemke,
}

/// Coordinates in which the character is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Coordinates {
    /// Joint coordinates on the kinematic tree.
    #[default]
    Reduced,
    /// Six coordinates a body, with joints as rows (Tokizaki & Hasegawa eqs. 5-27).
    Maximal,
}

/// What a joint's rows ask of the new velocities of its two bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JointBias {
    /// J v⁺ = −h J̇ v: what joint coordinates imply, so that both coordinates move alike.
    #[default]
    Consistent,
    /// J v⁺ = 0, as the paper has it: the joint's own turning is left to the next step.
    Paper,
}

/// Shape of the set of admissible friction forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionCone {
    /// The circular cone of Coulomb's law.
    #[default]
    Cone,
    /// A four-sided pyramid along two tangents: a linear complementarity problem.
    Pyramid,
}
