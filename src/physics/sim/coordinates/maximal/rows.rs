//! The rows that hold the bodies together.

use super::MaximalCoordinates;
use super::response;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::rows::joint::Coupling;
use crate::sim::rows::{Recovery, RowOwner, Rows, joint, lock};
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_data::StepData;

impl MaximalCoordinates {
    /// Adds the rows that hold joint `joint` together.
    pub(super) fn joint(&self, data: &StepData<'_>, rows: &mut Rows, joint: usize) {
        let bodies = &data.work.placed.bodies;
        let coupling = Coupling::of_joint(data.model, bodies, joint);
        // The next step may correct the separation of this one at once, at any speed.
        let recovery = if data.plan.stabilization { Recovery::UNBOUNDED } else { Recovery::NONE };
        let (owner, free, step) = (RowOwner::Joint(joint), &data.work.free.bodies, data.step);
        joint::add(rows, owner, &coupling, free, SpatialMotion::ZERO, step, recovery, |wrench, numbers| {
            let (child, parent) = (coupling.child, Some(coupling.parent));
            response::of_bodies(&self.factors, bodies, child, parent, &[wrench], numbers)
        });
    }

    /// Adds the rows that lock the root's rotation, if it is to be locked.
    pub(super) fn lock(&self, data: &StepData<'_>, rows: &mut Rows) {
        if data.root_freedom == RootFreedom::Translating {
            lock::add(rows, data.work.free.bodies.at(0), |wrench, numbers| {
                response::of_bodies(&self.factors, &data.work.placed.bodies, 0, None, &[wrench], numbers)
            });
        }
    }
}
