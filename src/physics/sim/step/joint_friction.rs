//! Dry friction of joints without rows (see `sim/joint_friction.rs`).

use super::Stages;
use crate::scene::SolverKind;
use crate::sim::actuator::ActuatorMode;
use crate::sim::coordinates::CoordinateSystem;
use crate::sim::joint_friction::FrictionMode;
use crate::sim::step_data::StepData;
use crate::sim::workspace::Workspace;

impl<C: CoordinateSystem> Stages<'_, C> {
    /// What to try first for the dry friction of every joint. Needs the drives.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn first_friction(&mut self) {
        let plan = self.data.plan;
        let Some(friction) = &plan.dry_friction else { return };
        // Gauss-Seidel sweeps within a budget leave a residual, with which nothing can be compared.
        let by_rows = C::JOINTS_BY_ROWS || plan.accuracy.solver.kind == SolverKind::Pgs;
        for (joint, most) in friction.iter().copied().enumerate() {
            let (state, memory) = (&*self.data.state, &self.data.state.memory);
            let rate = state.velocities[joint];
            let expected = rate + self.data.step * memory.acceleration.joints[joint];
            self.data.work.friction.modes[joint] = if most <= 0.0 {
                FrictionMode::None
            } else if by_rows {
                FrictionMode::Row
            } else {
                match FrictionMode::first(most, memory.dry_friction[joint], rate, expected) {
                    FrictionMode::Stuck if !self.may_stick(joint) => FrictionMode::Row,
                    mode => mode,
                }
            };
        }
    }

    /// Whether nothing else prescribes what joint `joint` does: no loop, no row of an actuator, no limit that is reached.
    fn may_stick(&self, joint: usize) -> bool {
        let StepData { model, plan, state, work, .. } = &self.data;
        let angle = state.angles[joint];
        let limit = plan.limits.as_ref().map(|limits| limits[joint]);
        model.loops.is_empty()
            && work.drives.actuators[joint] == ActuatorMode::Line
            && limit.is_none_or(|[lower, upper]| lower < angle && angle < upper)
    }

    /// Puts the dry friction of joints without a row into their loads.
    pub(super) fn friction_loads(&mut self) {
        let StepData { plan, state, work, step, .. } = &mut self.data;
        let Some(friction) = &plan.dry_friction else { return };
        for (joint, mode) in work.friction.modes.iter().enumerate() {
            let load = &mut work.drives.loads[joint];
            load.torque += mode.sliding_torque(friction[joint]);
            load.held = (*mode == FrictionMode::Stuck).then(|| -state.velocities[joint] / *step);
        }
    }

    /// Gives rows to the joints whose friction is not what it was taken for; whether there are any.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn friction_gives_way(&mut self) -> bool {
        let plan = self.data.plan;
        let Some(most) = &plan.dry_friction else { return false };
        if self.data.work.friction.modes.contains(&FrictionMode::Stuck) {
            self.system.sticking_torques(&mut self.data);
        }
        let Workspace { friction, drives, new, .. } = &mut *self.data.work;
        let mut changed = false;
        for (joint, mode) in friction.modes.iter_mut().enumerate() {
            let most = most[joint];
            match mode {
                FrictionMode::None | FrictionMode::Row => continue,
                FrictionMode::Stuck => {}
                FrictionMode::Forward | FrictionMode::Backward => {
                    friction.torque[joint] = mode.sliding_torque(most);
                }
            }
            let driven_by_row = *mode == FrictionMode::Stuck && drives.actuators[joint] != ActuatorMode::Line;
            if driven_by_row || !mode.holds(most, friction.torque[joint], new.rates[joint]) {
                *mode = FrictionMode::Row;
                changed = true;
            }
        }
        changed
    }

    /// Gives rows to all joints that stick; whether there are any. For problems that have no solution, or none that is found,
    /// while these joints cannot move.
    pub(super) fn release_stuck(&mut self) -> bool {
        let mut released = false;
        let modes = &mut self.data.work.friction.modes;
        for mode in modes.iter_mut().filter(|mode| **mode == FrictionMode::Stuck) {
            *mode = FrictionMode::Row;
            released = true;
        }
        released
    }
}
