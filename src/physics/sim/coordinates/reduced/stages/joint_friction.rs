//! Dry friction of joints without rows (see `sim/joint_friction.rs`).

use super::Stages;
use crate::scene::SolverKind;
use crate::sim::actuator::ActuatorMode;
use crate::sim::joint_friction::FrictionMode;
use crate::sim::rows::contact;
use crate::sim::spatial::{SpatialForce, SpatialMotion};

impl Stages<'_> {
    /// What to try first for the dry friction of every joint. Needs the drives.
    pub(super) fn first_friction(&mut self) {
        let plan = self.plan;
        let Some(friction) = &plan.dry_friction else { return };
        // Gauss-Seidel sweeps within a budget leave a residual, with which nothing can be compared.
        let by_rows = plan.accuracy.solver.kind == SolverKind::Pgs;
        for (joint, most) in friction.iter().copied().enumerate() {
            let (state, memory) = (&*self.state, &self.state.memory);
            let rate = state.velocities[joint];
            let expected = rate + self.step * memory.acceleration.joints[joint];
            self.work.friction_modes[joint] = if most <= 0.0 {
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
        let angle = self.state.angles[joint];
        let limit = self.plan.limits.as_ref().and_then(|limits| limits[joint]);
        self.model.loops.is_empty()
            && self.work.actuators[joint] == ActuatorMode::Line
            && limit.is_none_or(|[lower, upper]| lower < angle && angle < upper)
    }

    /// Puts the dry friction of joints without a row into their loads.
    pub(super) fn friction_loads(&mut self) {
        let Self { plan, state, work, step, .. } = self;
        let Some(friction) = &plan.dry_friction else { return };
        for (joint, mode) in work.friction_modes.iter().enumerate() {
            let load = &mut work.loads[joint];
            load.torque += mode.sliding_torque(friction[joint]);
            load.held = (*mode == FrictionMode::Stuck).then(|| -state.velocities[joint] / *step);
        }
    }

    /// Gives rows to the joints whose friction is not what it was taken for; whether there are any.
    pub(super) fn friction_gives_way(&mut self) -> bool {
        let plan = self.plan;
        let Some(friction) = &plan.dry_friction else { return false };
        if self.work.friction_modes.contains(&FrictionMode::Stuck) {
            self.sticking_torques();
        }
        let work = &mut *self.work;
        let mut changed = false;
        for (joint, mode) in work.friction_modes.iter_mut().enumerate() {
            let most = friction[joint];
            match mode {
                FrictionMode::None | FrictionMode::Row => continue,
                FrictionMode::Stuck => {}
                FrictionMode::Forward | FrictionMode::Backward => {
                    work.friction[joint] = mode.sliding_torque(most);
                }
            }
            let driven_by_row = *mode == FrictionMode::Stuck && work.actuators[joint] != ActuatorMode::Line;
            if driven_by_row || !mode.holds(most, work.friction[joint], work.joint_rates[joint]) {
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
        for mode in self.work.friction_modes.iter_mut().filter(|mode| **mode == FrictionMode::Stuck) {
            *mode = FrictionMode::Row;
            released = true;
        }
        released
    }

    /// Torques of friction in the joints that stick: what their bodies, with all beyond, require at the new velocities and
    /// under the contacts' forces, less what the joints' drives and dampers give (Featherstone 2008, section 5.3).
    fn sticking_torques(&mut self) {
        let minus_gravity = self.minus_gravity();
        let Self { model, plan, work, step, .. } = self;
        let per_second = 1.0 / *step;
        // Bias forces contain what the velocities accelerate; see `after` for the root's.
        let mut constant = minus_gravity;
        if plan.velocity_forces {
            let root = work.bodies[0].velocity;
            constant.linear -= root.angular.cross(&root.linear);
        }
        for (index, wrench) in work.wrenches.iter_mut().enumerate() {
            let acceleration: SpatialMotion =
                constant.plus_scaled(work.new[index].minus(work.old[index]), per_second);
            let required = work.bodies[index].inertia.times(acceleration);
            *wrench = work.articulated.bias_force(index).plus(required);
        }
        let per_contact = contact::rows_per_contact(plan.friction);
        for (candidate, forces) in work.candidates.iter().zip(work.rows.force.chunks_exact(per_contact)) {
            let force = SpatialForce::at(candidate.at, candidate.force(forces));
            work.wrenches[candidate.body] = work.wrenches[candidate.body].plus(force.scaled(-1.0));
            if let Some(other) = candidate.against.body() {
                work.wrenches[other] = work.wrenches[other].plus(force);
            }
        }
        for &index in model.outward.iter().rev() {
            let (joint, wrench) = (index - 1, work.wrenches[index]);
            let load = &work.loads[joint];
            if let Some(acceleration) = load.held {
                let required = work.bodies[index].motion_subspace.dot(wrench) + load.inertia * acceleration;
                work.friction[joint] = required - load.torque;
            }
            let parent = model.bodies[index].parent;
            work.wrenches[parent] = work.wrenches[parent].plus(wrench);
        }
    }
}
