//! Feedforward, the first of the two passes of tracking: the torque that would bring the joints to the target's velocity
//! within the feedforward's period (see [`Reference::rate_after`](crate::sim::tracking::Reference::rate_after)).
//!
//! Rows s prescribe the velocity after the step as rows e, beside those of the joints themselves (Tokizaki &
//! Hasegawa eq. 17 and figure 2), with contacts or without. Their forces, with what the rotor and the damping
//! of the joint take at that velocity, are the offset torques f₀. Where loops or passive joints leave some velocities
//! open, the velocity-dependent forces of the prescribed motion have to be found along with it. The forecast has done
//! so, and its torques are taken.

use super::stages::Stages;
use crate::scene::{DrivePlan, Feedforward};
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::lcp::Solver;
use crate::sim::rows::{RowOwner, contact, drive};

impl Stages<'_> {
    /// Fills the offset torques for the motions of the targets in `reference`.
    pub(super) fn velocity_control(&mut self, drive: &DrivePlan) -> Result<(), Failure> {
        let (model, plan, step) = (self.model, self.plan, self.step);
        self.work.feedforward.fill(0.0);
        if drive.feedforward == Feedforward::None {
            return Ok(());
        }
        if !model.joints_are_independent() {
            self.work.feedforward.copy_from_slice(&self.own.forecast.work.feedforward);
            return Ok(());
        }
        let period = self.work.feedforward_period;
        // The pass is a step of its own.
        let horizon = drive.horizon(period, step);
        self.look_ahead(horizon);
        let mut rows = std::mem::take(&mut self.work.control_rows);
        rows.clear();
        if drive.feedforward == Feedforward::ContactAware {
            let compliance = contact::compliance(model.mass, horizon);
            self.contacts(&mut rows, &self.state.memory.feedforward_contacts, compliance);
        }
        let joints = self.work.reference.len();
        for joint in 0..joints {
            let rate = self.state.velocities[joint];
            self.work.joint_rates[joint] = self.work.reference[joint].rate_after(rate, period, step);
        }
        for joint in (0..joints).rev() {
            self.joint(&mut rows, joint);
            let free = self.work.free_rates[joint];
            let rate = self.state.velocities[joint];
            let wanted = rate + (self.work.joint_rates[joint] - rate) * (horizon / step);
            drive::prescribe_velocity(&mut rows, joint, wanted, free, |joint, numbers| {
                self.of_joint(joint, numbers)
            });
        }
        self.lock(&mut rows);
        rows.assemble(horizon);
        let (problem, force) = rows.problem(plan.circular_friction());
        let solution = self.work.solver.solve(&problem, force);
        self.look_ahead(step);
        for (owner, force) in rows.owner.iter().zip(&rows.force) {
            if let RowOwner::Drive(joint) = *owner {
                let damping = plan.damping.as_ref().map_or(0.0, |damping| damping[joint]);
                let wanted = self.work.joint_rates[joint];
                let acceleration = (wanted - self.state.velocities[joint]) / step;
                self.work.feedforward[joint] =
                    force + model.armature[joint] * acceleration + damping * wanted;
            }
        }
        self.work.control_rows = rows;
        fail_unless_usable(solution.status, model, self.state)
    }

    /// Makes the step `horizon` seconds long: extends the free velocities, which are linear in its length.
    fn look_ahead(&mut self, horizon: f64) {
        if horizon == self.step {
            return;
        }
        let extent = horizon / self.step;
        self.step = horizon;
        for (free, old) in self.work.free.iter_mut().zip(&self.work.old) {
            *free = old.plus_scaled(free.minus(*old), extent);
        }
        self.free_rates();
    }
}
