//! The joints' drives under a command, and the loads that they are.

use super::Stages;
use crate::scene::DrivePlan;
use crate::sim::actuator::ActuatorMode;
use crate::sim::command::Command;
use crate::sim::coordinates::CoordinateSystem;
use crate::sim::failure::Failure;
use crate::sim::joint_load::JointLoad;
use crate::sim::step_data::StepData;
use crate::sim::tracking::{ImplicitWeights, Spring, Target, implicit_damper_weight};
use crate::sim::workspace::{Drives, Workspace};

impl<C: CoordinateSystem> Stages<'_, C> {
    /// The joints' drives under `command`, with their feedforward torques.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn drives(&mut self, command: Command<'_>) -> Result<(), Failure> {
        let (plan, step) = (self.data.plan, self.data.step);
        let work = &mut *self.data.work;
        work.drives.release();
        work.problem.near_limit.fill([false; 2]);
        work.feedforward.rows.clear();
        work.feedforward.unsolved = false;
        match command {
            Command::Passive => {}
            Command::Torque(prescribed) => {
                for (joint, torque) in prescribed.iter().enumerate() {
                    let spring = Spring { at_rest: *torque, resistance: 0.0 };
                    self.drive(joint, spring.clamped(plan.actuator_limits(joint).torque));
                }
            }
            Command::Velocity(wanted) => {
                for (joint, wanted) in wanted.iter().enumerate() {
                    let Some(wanted) = wanted else { continue };
                    let inertia = self.data.work.drives.composite_inertia[joint];
                    let spring = Spring::servo_within(*wanted, plan.actuator_limits(joint), inertia / step);
                    self.drive(joint, spring);
                    let mode = &mut self.data.work.drives.actuators[joint];
                    if *mode == ActuatorMode::Line {
                        *mode = ActuatorMode::Boxed;
                    }
                }
            }
            Command::Track { now, next } => {
                if let Some(drive) = &plan.drive {
                    self.track(drive, now, next)?;
                }
            }
        }
        self.system.foresee(&mut self.data);
        Ok(())
    }

    /// Drives every joint by `drive` from its target `now` to the `next`.
    #[inline(always)] // compiled for the processor of `step`
    fn track(&mut self, drive: &DrivePlan, now: &[f64], next: &[f64]) -> Result<(), Failure> {
        self.feedforward(drive)?;
        let StepData { state, work, step, midpoint, .. } = &mut self.data;
        let Workspace { drives, feedforward, .. } = &mut **work;
        let Drives { springs, actuators, composite_inertia, .. } = drives;
        // Of one length each, so that no index is checked in the loop.
        let joints = springs.len();
        let (stiffness, damping) = (&drive.stiffness[..joints], &drive.damping[..joints]);
        let (offset, limits) = (&drive.offset[..joints], &drive.all_limits()[..joints]);
        let (angles, rates) = (&state.angles[..joints], &state.velocities[..joints]);
        let (now, next) = (&now[..joints], &next[..joints]);
        let (torque, inertia) = (&feedforward.torque[..joints], &composite_inertia[..joints]);
        let (saturated, actuators) = (&state.memory.saturated[..joints], &mut actuators[..joints]);
        for joint in 0..joints {
            let (stiffness, damping) = (stiffness[joint], damping[joint]);
            let (angle, target) = (angles[joint], Target { now: now[joint], next: next[joint] });
            let offset = torque[joint] + offset[joint];
            let spring = if *midpoint {
                let per_inertia = *step / inertia[joint];
                let weights = ImplicitWeights::new(per_inertia * *step * stiffness, per_inertia * damping);
                Spring::at_midpoint(stiffness, damping, weights, offset, angle, rates[joint], target, *step)
            } else {
                Spring::new(stiffness, damping, offset, angle, target, *step)
            };
            springs[joint] = spring.clamped(limits[joint].torque);
            actuators[joint] = ActuatorMode::first(springs[joint], limits[joint], saturated[joint]);
        }
        Ok(())
    }

    /// Drives joint `joint` by `spring`.
    #[inline(always)] // in the loop over the joints
    fn drive(&mut self, joint: usize, spring: Spring) {
        let drives = &mut self.data.work.drives;
        drives.springs[joint] = spring;
        let last = self.data.state.memory.saturated[joint];
        drives.actuators[joint] = ActuatorMode::first(spring, self.data.plan.actuator_limits(joint), last);
    }

    /// The line and the box of joint `joint`'s actuator, if it has a row. Where joints have rows anyway, it has one wherever it
    /// has a greatest torque.
    #[inline(always)] // in most steps it is one comparison
    pub(super) fn actuator_row(&self, joint: usize) -> Option<(Spring, [f64; 2])> {
        let drives = &self.data.work.drives;
        let (mode, spring) = (drives.actuators[joint], drives.springs[joint]);
        if mode == ActuatorMode::Line && !C::JOINTS_BY_ROWS {
            return None;
        }
        let limits = self.data.plan.actuator_limits(joint);
        match mode {
            ActuatorMode::Line if limits.torque.is_infinite() || spring.is_prescribed() => None,
            ActuatorMode::Line => ActuatorMode::Boxed.row(spring, limits),
            mode => mode.row(spring, limits),
        }
    }

    /// The loads of the joints but for their dry friction.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn loads(&mut self) {
        let StepData { model, plan, state, work, step, midpoint, .. } = &mut self.data;
        let Drives { loads, composite_inertia, .. } = &mut work.drives;
        for (load, armature) in loads.iter_mut().zip(&model.armature) {
            *load = JointLoad { torque: 0.0, inertia: *armature, held: None };
        }
        if let Some(damping) = &plan.damping {
            let joints = damping.iter().zip(&state.velocities).zip(&*composite_inertia);
            for (load, ((damping, rate), inertia)) in loads.iter_mut().zip(joints) {
                let whole = *step * damping;
                let share = if *midpoint { implicit_damper_weight(whole / inertia) } else { 1.0 };
                load.torque -= damping * rate;
                load.inertia += share * whole;
            }
        }
        let step = self.data.step;
        for joint in 0..self.data.work.drives.loads.len() {
            if self.actuator_row(joint).is_none() {
                let rate = self.data.state.velocities[joint];
                let drives = &mut self.data.work.drives;
                let drive = JointLoad::of_drive(drives.springs[joint], rate, step);
                let load = &mut drives.loads[joint];
                load.torque += drive.torque;
                load.inertia += drive.inertia;
            }
        }
    }

    /// Which line each actuator is to follow at the new velocities; whether one has to follow another than it did.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn switch_actuators(&mut self) -> bool {
        let Workspace { drives, new, problem, .. } = &mut *self.data.work;
        drives.switch_actuators(self.data.plan, &new.rates, &problem.rows)
    }
}
