//! In which directions the root may accelerate.

use crate::model::Model;
use crate::scene::StepPlan;

/// In which directions the root may accelerate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RootFreedom {
    /// In none.
    Fixed,
    /// It keeps its orientation.
    Translating,
    /// In all.
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
}
