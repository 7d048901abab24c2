//! In which directions the root may accelerate.

use crate::model::Model;
use crate::scene::StepPlan;

/// In which directions the root may accelerate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RootFreedom {
    /// In none: the root is fixed to the world.
    Fixed,
    /// In the three translations: its orientation is locked.
    Translating,
    /// In all six.
    Free,
}

impl RootFreedom {
    /// The directions that `plan` leaves the root of `model`.
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        match (model.fixed_base, plan.trunk_rotation_lock) {
            (true, _) => Self::Fixed,
            (false, true) => Self::Translating,
            (false, false) => Self::Free,
        }
    }

    /// Whether momentum is kept in flight: nothing holds the root, and the scene has the velocity-dependent forces without
    /// which momentum is not what physics keeps.
    pub fn keeps_momentum(model: &Model, plan: &StepPlan) -> bool {
        plan.velocity_forces && Self::new(model, plan) == Self::Free
    }
}
