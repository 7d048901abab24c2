//! How positions are corrected, and the new state.

use super::Stages;
use crate::sim::coordinates::CoordinateSystem;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::lcp::SolveStatus;
use crate::sim::step_data::StepData;
use crate::sim::workspace::Workspace;

impl<C: CoordinateSystem> Stages<'_, C> {
    /// The velocities along which positions move: the new ones, and where a penetration or a violated
    /// limit is to be corrected, new ones that also correct it. Correcting leaves no speed behind.
    pub(super) fn recovery(&mut self) -> Result<(), Failure> {
        let StepData { plan, work, step, .. } = &mut self.data;
        work.recovers = work.problem.rows.needs_recovery();
        if !work.recovers {
            return Ok(());
        }
        let status = work.problem.solve_recovery(plan, *step);
        if status != SolveStatus::Solved && self.release_stuck() {
            // The velocities are the same, but for rounding, with rows in place of joints that stick.
            self.factorise()?;
            self.velocities_at_mean()?;
            return self.recovery();
        }
        let StepData { model, state, work, .. } = &mut self.data;
        if status == SolveStatus::Ray {
            // Overlaps of which none can be made smaller without making another greater, as of a body that is squeezed between two
            // walls, stay as they are.
            work.recovers = false;
            return Ok(());
        }
        fail_unless_usable(status, model, state, &work.problem.rows)?;
        let Workspace { placed, free, problem, recovery, changes, .. } = &mut **work;
        recovery.rates.copy_from_slice(&free.rates);
        self.system.respond(model, &placed.bodies, &problem.half, &mut recovery.rates, changes);
        recovery.change(&free.bodies, changes);
        Ok(())
    }

    /// The new state, and what the next step remembers of this one.
    pub(super) fn commit(&mut self) {
        let StepData { model, plan, state, work, step, time, .. } = &mut self.data;
        work.remember(plan, &mut state.memory);
        let (new, last) = (&work.new, &mut state.memory.acceleration);
        if !model.fixed_base {
            let root = new.bodies.at(0);
            last.root = root.minus(state.root.motion()).scaled(1.0 / *step);
            state.root.linear_velocity = root.linear;
            state.root.angular_velocity = root.angular;
        }
        let changes = new.rates.iter().zip(&state.velocities);
        for (acceleration, (new, old)) in last.joints.iter_mut().zip(changes) {
            *acceleration = (new - old) / *step;
        }
        state.velocities.copy_from_slice(&new.rates);
        state.time = *time + *step;
        self.system.advance(&mut self.data);
    }
}
