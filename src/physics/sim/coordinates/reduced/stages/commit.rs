//! The new state.

use super::Stages;
use crate::sim::coordinates::reduced::response;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::integrate::advance;
use crate::sim::lcp::SolveStatus;
use crate::sim::momentum::Momentum;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::SpatialMotion;

impl Stages<'_> {
    /// The velocities along which positions move: the new ones, and where a penetration or a violated
    /// limit is to be corrected, new ones that also correct it. Correcting leaves no speed behind.
    pub(super) fn recovery(&mut self) -> Result<(), Failure> {
        let Self { plan, work, step, .. } = self;
        work.recovery_root = work.new[0];
        work.recovery_rates.copy_from_slice(&work.joint_rates);
        if !work.rows.needs_recovery() {
            return Ok(());
        }
        let status = work.solve_recovery(plan, *step);
        if status != SolveStatus::Solved && self.release_stuck() {
            // The velocities are the same, but for rounding, with rows in place of joints that stick.
            self.factorise()?;
            self.velocities_at_mean()?;
            return self.recovery();
        }
        let Self { model, state, work, .. } = self;
        fail_unless_usable(status, model, state)?;
        work.recovery_rates.copy_from_slice(&work.free_rates);
        let change = response::finish(
            model,
            &work.bodies,
            &work.articulated,
            &work.half,
            &mut work.recovery_rates,
            &mut work.recovery_changes,
        );
        work.recovery_root = work.free[0].plus(change);
        Ok(())
    }

    /// The new state, and what the next step remembers of this one.
    pub(super) fn commit(&mut self) {
        let (step, time) = (self.step, self.time);
        let momentum = self.momentum_of_flight();
        let Self { model, plan, state, work, .. } = self;
        work.remember(plan, &mut state.memory);
        work.remember_friction(&mut state.memory);
        let last = &mut state.memory.acceleration;
        if !model.fixed_base {
            let root = work.new[0];
            last.root = root.minus(state.root.motion()).scaled(1.0 / step);
            state.root.linear_velocity = root.linear;
            state.root.angular_velocity = root.angular;
        }
        let changes = work.joint_rates.iter().zip(&state.velocities);
        for (acceleration, (new, old)) in last.joints.iter_mut().zip(changes) {
            *acceleration = (new - old) / step;
        }
        state.velocities.copy_from_slice(&work.joint_rates);
        let root = if model.fixed_base { SpatialMotion::ZERO } else { work.recovery_root };
        advance(state, root, &work.recovery_rates, if self.midpoint { 0.5 * step } else { step });
        state.time = time + step;
        if let Some(momentum) = momentum {
            // A step of Moreau and Jean's begins elsewhere.
            work.flight.end(model, state, momentum, !self.midpoint);
        }
    }

    /// The momentum that a step in flight ends with; `None` where momentum is not kept.
    fn momentum_of_flight(&mut self) -> Option<Momentum> {
        let Self { model, plan, work, step, .. } = self;
        // Under error control a symmetric step must stay symmetric: its trials are corrected instead (step_within).
        let by_trial = self.midpoint && plan.accuracy.step_tolerance.is_some();
        if by_trial || !RootFreedom::keeps_momentum(model, plan) || !work.is_in_flight(plan) {
            return None;
        }
        let momentum = work.flight.momentum(model);
        Some(momentum.after_flight(model.mass, plan.gravity, *step))
    }
}
