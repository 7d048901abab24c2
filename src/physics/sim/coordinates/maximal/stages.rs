//! One step of time in maximal coordinates: the stages by name, in order.

use nalgebra::UnitQuaternion;

use super::kinematics::{bodies_from_joints, joints_from_bodies, place};
use super::response;
use super::workspace::MaximalWorkspace;
use crate::model::Model;
use crate::scene::StepPlan;
use crate::sim::actuator::ActuatorMode;
use crate::sim::command::Command;
use crate::sim::coordinates::outcome::StepOutcome;
use crate::sim::failure::{Failure, check_finite_with, fail_unless_usable};
use crate::sim::momentum::Composite;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::rows::RowOwner;
use crate::sim::spatial::{SpatialForce, SpatialMotion};
use crate::sim::state::State;
use crate::sim::tracking::{Spring, Target};
use crate::sim::workspace::Workspace;

/// One step of `step` seconds, unless it has to be shorter (see [`StepOutcome`]).
///
/// # Errors
/// As [`Simulator::step`](crate::sim::Simulator::step).
pub fn step(
    model: &Model,
    plan: &StepPlan,
    state: &mut State,
    work: &mut Workspace,
    own: &mut MaximalWorkspace,
    command: Command<'_>,
    step: f64,
) -> Result<StepOutcome, Failure> {
    let ahead = own.forecast.run(model, plan, state, command, step)?;
    if ahead != StepOutcome::Completed {
        return Ok(ahead);
    }
    let mut stages = Stages { model, plan, state, work, own, step };
    stages.kinematics();
    stages.detection();
    stages.mean_velocities();
    stages.row_correction();
    stages.free_motion();
    stages.drives(command)?;
    stages.prescribed_torques();
    stages.velocities()?;
    stages.recovery()?;
    stages.commit();
    check_finite_with(model, state, || work.rows.worst())?;
    Ok(StepOutcome::Completed)
}

/// The stages of a step over their common data.
pub(super) struct Stages<'a> {
    pub model: &'a Model,
    pub plan: &'a StepPlan,
    pub state: &'a mut State,
    pub work: &'a mut Workspace,
    pub own: &'a mut MaximalWorkspace,
    /// Length of the step, s.
    pub step: f64,
}

impl Stages<'_> {
    /// Places the bodies and gives them the old velocities.
    fn kinematics(&mut self) {
        let Self { model, state, work, own, .. } = self;
        if state.body_states.is_empty() {
            bodies_from_joints(model, state, &mut work.bodies);
        } else {
            place(model, state, &mut work.bodies);
        }
        for (old, body) in work.old.iter_mut().zip(&work.bodies) {
            *old = body.velocity;
        }
        work.common_point = state.root.position;
        work.mean_rates.copy_from_slice(&state.velocities);
        work.near_limit.copy_from_slice(&own.forecast.work.near_limit);
        work.coarse = own.forecast.work.coarse;
        work.evaluations += 1;
    }

    /// Detects contact candidates.
    fn detection(&mut self) {
        self.work.detect(self.model, self.plan, None, self.step);
    }

    /// Gives the bodies the forecast's mean velocities, at which velocity-dependent forces are taken.
    fn mean_velocities(&mut self) {
        if !self.plan.has_joint_bias() {
            return;
        }
        let Self { work, own, .. } = self;
        let ahead = &own.forecast.work;
        work.mean_rates.copy_from_slice(&ahead.mean_rates);
        for (body, mean) in work.bodies.iter_mut().zip(&ahead.bodies) {
            body.velocity = mean.velocity;
        }
    }

    /// C of every body: what the rows read in addition to the body's own velocity.
    fn row_correction(&mut self) {
        let Self { model, plan, work, own, step, .. } = self;
        let row_correction = &mut own.row_correction;
        row_correction.fill(SpatialMotion::ZERO);
        if !plan.has_joint_bias() {
            return;
        }
        // First D of every body, then C.
        for index in 1..work.bodies.len() {
            let parent = model.bodies[index].parent;
            let drift = work.bodies[parent].velocity.cross_motion(work.bodies[index].motion_subspace);
            row_correction[index] = row_correction[parent].plus_scaled(drift, work.mean_rates[index - 1]);
        }
        let root = work.bodies[0].velocity;
        let of_root = root.angular.cross(&root.linear);
        for (row_correction, body) in row_correction.iter_mut().zip(&work.bodies) {
            let of_body = body.velocity.angular.cross(&body.velocity.at(body.center));
            *row_correction = row_correction.scaled(-*step);
            row_correction.linear += (of_root - of_body) * *step;
        }
    }

    /// Velocities after the step, as the rows read them, if no row and no drive acted.
    fn free_motion(&mut self) {
        let Self { model, plan, work, own, step, .. } = self;
        for (index, body) in work.bodies.iter().enumerate() {
            let factor = &own.factors[index];
            let mut free = work.old[index].plus(own.row_correction[index]);
            if !factor.is_fixed() {
                free.linear += plan.gravity * *step;
            }
            if plan.velocity_forces {
                let row_correction = body.velocity.angular;
                let momentum =
                    body.rotation * (model.bodies[index].inertia * body.rotation.tr_mul(&row_correction));
                let gyroscopic = SpatialForce {
                    moment: momentum.cross(&row_correction),
                    force: nalgebra::Vector3::zeros(),
                };
                free = free.plus_scaled(factor.accelerate(body, gyroscopic), *step);
            }
            work.free[index] = free;
        }
        self.free_rates();
    }

    /// Joint velocities of the bodies' free ones.
    pub(super) fn free_rates(&mut self) {
        let Self { model, work, .. } = self;
        for joint in 0..work.free_rates.len() {
            let (child, parent) = (joint + 1, model.bodies[joint + 1].parent);
            let relative = work.free[child].plus(work.free[parent].scaled(-1.0));
            work.free_rates[joint] = relative.dot(response::along(&work.bodies[child]));
        }
    }

    /// The joints' drives under `command`.
    fn drives(&mut self, command: Command<'_>) -> Result<(), Failure> {
        self.work.springs.fill(Spring::default());
        self.work.switches = 0;
        self.work.actuators.copy_from_slice(&self.own.forecast.work.actuators);
        self.work.torque.fill(0.0);
        match command {
            Command::Passive => {}
            Command::Torque(prescribed) => {
                for (joint, torque) in prescribed.iter().enumerate() {
                    let spring = Spring { at_rest: *torque, resistance: 0.0 };
                    self.work.springs[joint] = spring.clamped(self.plan.actuator_limits(joint).torque);
                }
            }
            Command::Velocity(_) => self.work.springs.copy_from_slice(&self.own.forecast.work.springs),
            Command::Track { now, next } => {
                let plan = self.plan;
                let Some(drive) = &plan.drive else { return Ok(()) };
                self.velocity_control(drive)?;
                for (joint, (now, next)) in now.iter().zip(next).enumerate() {
                    let (stiffness, damping) = (drive.stiffness[joint], drive.damping[joint]);
                    let offset = self.work.feedforward[joint] + drive.offset[joint];
                    let angle = self.state.angles[joint];
                    let target = Target { now: *now, next: *next };
                    let spring = Spring::new(stiffness, damping, offset, angle, target, self.step);
                    self.work.springs[joint] = spring.clamped(drive.limits(joint).torque);
                }
            }
        }
        Ok(())
    }

    /// Torques that do not depend on the velocity act at once.
    fn prescribed_torques(&mut self) {
        let Self { model, work, own, step, .. } = self;
        for (joint, spring) in work.springs.iter().enumerate() {
            if !spring.is_prescribed() || work.actuators[joint] != ActuatorMode::Line {
                continue;
            }
            let wrench = response::along(&work.bodies[joint + 1]).scaled(spring.at_rest);
            for (body, wrench) in [(joint + 1, wrench), (model.bodies[joint + 1].parent, wrench.scaled(-1.0))]
            {
                let acceleration = own.factors[body].accelerate(&work.bodies[body], wrench);
                work.free[body] = work.free[body].plus_scaled(acceleration, *step);
            }
        }
        self.free_rates();
    }

    /// New velocities.
    fn velocities(&mut self) -> Result<(), Failure> {
        loop {
            self.rows();
            self.solve()?;
            self.response();
            // Rows are added for a limit that would be crossed and for a contact that an impact brings about. Each is
            // added at most once, and actuators leave their bounds only so often, so the loop ends.
            let switched = self.work.switch_actuators(self.plan);
            let crossing = self.crosses_limit();
            if !self.impact_contacts() && !crossing && !switched {
                return Ok(());
            }
            if switched {
                self.free_motion();
                self.prescribed_torques();
            }
        }
    }

    /// The complementarity problem.
    fn solve(&mut self) -> Result<(), Failure> {
        let Self { model, plan, state, work, step, .. } = self;
        let status = work.solve(plan, *step);
        fail_unless_usable(status, model, state)
    }

    /// Changes of velocity by the rows, and the new joint velocities.
    fn response(&mut self) {
        let Self { model, work, own, step, .. } = self;
        work.rows.impulse(*step, &mut work.half);
        response::finish(&own.factors, &work.bodies, &work.half, &mut work.changes);
        work.take_changes();
        for joint in 0..work.joint_rates.len() {
            let (child, parent) = (joint + 1, model.bodies[joint + 1].parent);
            let change = work.changes[child].plus(work.changes[parent].scaled(-1.0));
            work.joint_rates[joint] =
                work.free_rates[joint] + change.dot(response::along(&work.bodies[child]));
        }
    }

    /// Whether a joint without a row for its limit would cross it in this step; a row is added.
    fn crosses_limit(&mut self) -> bool {
        self.plan
            .limits
            .as_ref()
            .is_some_and(|limits| self.work.mark_crossed_limits(limits, &self.state.angles, self.step))
    }

    /// Whether an impact in this step brings about other contacts; rows are added for them.
    fn impact_contacts(&mut self) -> bool {
        let Self { model, plan, work, step, .. } = self;
        let found = work.is_impact(plan, *step) && work.detect_again(model, plan, None, *step);
        work.add_driven_in(model, plan, *step) || found
    }

    /// Changes of the velocities along which positions move: those by the rows, and where a penetration or a
    /// violated limit is to be corrected, ones that also correct it. Correcting leaves no speed behind.
    fn recovery(&mut self) -> Result<(), Failure> {
        let Self { model, plan, state, work, own, step } = self;
        work.recovery_changes.copy_from_slice(&work.changes);
        if !work.rows.needs_recovery() {
            return Ok(());
        }
        let status = work.solve_recovery(plan, *step);
        fail_unless_usable(status, model, state)?;
        response::finish(&own.factors, &work.bodies, &work.half, &mut work.recovery_changes);
        Ok(())
    }

    /// The new state, and what the next step remembers of this one.
    fn commit(&mut self) {
        let Self { model, plan, state, work, own, step } = self;
        work.remember(plan, &mut state.memory);
        let ahead = &own.forecast.state.memory;
        if !model.joints_are_independent() {
            state.memory.feedforward_contacts.clone_from(&ahead.feedforward_contacts);
        }
        state.memory.acceleration.clone_from(&ahead.acceleration);
        state.memory.tension_squared.copy_from_slice(&ahead.tension_squared);
        state.memory.pendulum = ahead.pendulum;
        for (index, body_state) in state.body_states.iter_mut().enumerate() {
            if own.factors[index].is_fixed() {
                continue;
            }
            let body = &work.bodies[index];
            let by_itself = work.free[index].plus(own.row_correction[index].scaled(-1.0));
            let velocity = by_itself.plus(work.changes[index]);
            body_state.linear_velocity = velocity.at(body.center);
            body_state.angular_velocity = velocity.angular;
            let drift = by_itself.plus(work.recovery_changes[index]);
            body_state.center += drift.at(body.center) * *step;
            body_state.orientation =
                UnitQuaternion::from_scaled_axis(drift.angular * *step) * body_state.orientation;
            body_state.orientation.renormalize();
        }
        if !model.fixed_base {
            state.root.linear_velocity = work.new[0].linear;
            state.root.angular_velocity = work.new[0].angular;
        }
        state.velocities.copy_from_slice(&work.joint_rates);
        for joint in 0..work.torque.len() {
            work.torque[joint] = work.springs[joint].torque(work.joint_rates[joint]);
        }
        for (owner, force) in work.rows.owner.iter().zip(&work.rows.force) {
            if let RowOwner::Torque(joint) = *owner {
                work.torque[joint] = *force;
            }
        }
        joints_from_bodies(model, state, *step);
        state.time += *step;
        self.keep_momentum();
    }

    /// Gives the bodies the momentum that a step in flight ends with, by a rigid motion of them all.
    fn keep_momentum(&mut self) {
        let Self { model, plan, state, work, own, step } = self;
        if !RootFreedom::keeps_momentum(model, plan) || !work.is_in_flight(plan) {
            return;
        }
        // The common motion of all bodies is added to velocities in which the root's is contained.
        for (body, old) in work.bodies.iter_mut().zip(&work.old) {
            body.velocity = *old;
        }
        let before = Composite::new(&work.bodies).momentum(SpatialMotion::ZERO);
        let wanted = before.after_flight(model.mass, plan.gravity, *step);
        place(model, state, &mut work.bodies);
        let Some(motion) = Composite::new(&work.bodies).correction(SpatialMotion::ZERO, wanted) else {
            return;
        };
        for (body_state, body) in state.body_states.iter_mut().zip(&work.bodies) {
            body_state.linear_velocity += motion.at(body.center);
            body_state.angular_velocity += motion.angular;
        }
        // The root's velocity is the one of joint coordinates, with the correction that it has there.
        let ahead = &own.forecast;
        let correction = ahead.state.root.motion().minus(ahead.work.new[0]);
        state.root.linear_velocity += correction.linear;
        state.root.angular_velocity += correction.angular;
    }
}
