//! How positions are corrected by the rows.

use crate::model::DofKind;
use crate::scene::StepPlan;

/// How much of a violation is corrected in a step; in one of Moreau and Jean's half of that, because its positions move along these
/// velocities for half of it.
pub(in crate::sim) const SHARE_PER_STEP: f64 = 0.2;

/// Greatest speeds at which penetrating contacts are pushed apart and violated limits are corrected, and those at which open
/// loops are closed, in lengths ℓ and in rad per time τ of the character ([`CharacterUnits`](crate::scene::CharacterUnits)).
const SEPARATION: [f64; 2] = [0.4, 0.1];
const CLOSING: [f64; 2] = [4.0, 0.5];

/// Greatest speeds at which positions are corrected; 0 where they are not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Recovery {
    /// m/s.
    pub translation: f64,
    /// rad/s.
    pub rotation: f64,
}

impl Recovery {
    /// Not at all.
    pub const NONE: Self = Self { translation: 0.0, rotation: 0.0 };

    /// At any speed.
    pub const UNBOUNDED: Self = Self { translation: f64::INFINITY, rotation: f64::INFINITY };

    /// Of contacts and limits.
    pub fn of_unilateral(plan: &StepPlan) -> Self {
        Self::within(SEPARATION, plan)
    }

    /// Of loops.
    pub fn of_loops(plan: &StepPlan) -> Self {
        Self::within(CLOSING, plan)
    }

    fn within([lengths, angle]: [f64; 2], plan: &StepPlan) -> Self {
        if plan.stabilization {
            Self { translation: lengths * plan.units.speed(), rotation: angle / plan.units.time }
        } else {
            Self::NONE
        }
    }

    /// Along a joint of this kind.
    pub fn along(self, dof: DofKind) -> f64 {
        match dof {
            DofKind::Revolute => self.rotation,
            DofKind::Prismatic => self.translation,
        }
    }
}

/// The bias of a row that keeps a gap from becoming negative: with w + bias ≥ 0 the new velocities may close a gap
/// `gap` ≥ 0 within the step, but not more.
pub(super) fn gap_bias(gap: f64, step: f64) -> f64 {
    gap.max(0.0) / step
}

/// Speed at which a violated gap opens while positions move: a fifth of the violation each step, but never
/// faster than `fastest`, so that a character that starts deep in the ground rises instead of jumping.
pub(super) fn gap_recovery(gap: f64, step: f64, fastest: f64) -> f64 {
    (SHARE_PER_STEP * (-gap).max(0.0) / step).min(fastest)
}
