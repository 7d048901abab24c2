//! One step of time: the stages by name, in order.

use super::articulated::{JointLoad, Singular};
use super::kinematics::place;
use super::response;
use super::root::RootFreedom;
use crate::model::Model;
use crate::scene::{DrivePlan, Feedforward, StepPlan};
use crate::sim::contact::Touch;
use crate::sim::diagnostics::check_finite;
use crate::sim::integrate::advance;
use crate::sim::rows::{Owner, contact, dry_friction, limit, torque};
use crate::sim::spatial::{Force, Motion};
use crate::sim::state::State;
use crate::sim::step::{fail_unless_usable, root_freedom};
use crate::sim::tracking::Spring;
use crate::sim::workspace::Workspace;
use crate::sim::{Command, Failure};

/// A drive whose resistance α is below this (N m s/rad) is a given torque: it has no slope to solve for.
const NO_RESISTANCE: f64 = 1e-12;

/// An actuator counts as saturated within this share of its greatest torque.
const AT_LIMIT: f64 = 1.0 - 1e-12;

/// One step of `step` seconds.
///
/// # Errors
/// As [`super::super::Simulator::step`].
pub fn step(
    model: &Model,
    plan: &StepPlan,
    state: &mut State,
    work: &mut Workspace,
    command: Command<'_>,
    step: f64,
) -> Result<(), Failure> {
    let freedom = root_freedom(model, plan);
    let mut stages = Stages { model, plan, state, work, freedom, step };
    stages.kinematics();
    stages.detection();
    stages.drives(command)?;
    loop {
        stages.free_motion()?;
        stages.rows();
        stages.solve()?;
        stages.response();
        // An actuator that would exceed its limit gets a row of its own. Each joint can be added
        // only once, so this ends.
        if !stages.saturation() {
            break;
        }
    }
    stages.commit();
    check_finite(model, state, || work.rows.worst())
}

/// The stages of a step over their common data.
struct Stages<'a> {
    model: &'a Model,
    plan: &'a StepPlan,
    state: &'a mut State,
    work: &'a mut Workspace,
    freedom: RootFreedom,
    /// Length of the step, s.
    step: f64,
}

impl Stages<'_> {
    /// Where the bodies are and how they move.
    fn kinematics(&mut self) {
        let Self { model, plan, state, work, .. } = self;
        place(model, state, &mut work.bodies);
        work.common_point = state.root.position;
        work.articulated.prepare(model, &work.bodies, &state.velocities, plan.velocity_forces);
    }

    /// Where the character touches the ground.
    fn detection(&mut self) {
        self.work.detect(self.model, self.plan, self.state.root.position.z, self.step);
    }

    /// Acceleration of the root in the directions in which it is not free: a lock stops its rotation.
    fn given(&self) -> Motion {
        match self.freedom {
            RootFreedom::Translating => Motion {
                angular: -self.state.root.angular_velocity / self.step,
                linear: nalgebra::Vector3::zeros(),
            },
            RootFreedom::Bolted | RootFreedom::Free => Motion::ZERO,
        }
    }

    /// The acceleration opposite to gravity, which every body has instead of its weight.
    fn lifted(&self) -> Motion {
        Motion { angular: nalgebra::Vector3::zeros(), linear: -self.plan.gravity }
    }

    /// What each joint is asked to do, and the torque that would do it exactly.
    fn drives(&mut self, command: Command<'_>) -> Result<(), Failure> {
        let step = self.step;
        let work = &mut *self.work;
        work.saturated.fill(false);
        work.springs.fill(Spring::default());
        work.torque.fill(0.0);
        match command {
            Command::Passive => {}
            Command::Torque(given) => {
                for (spring, torque) in work.springs.iter_mut().zip(given) {
                    spring.at_rest = *torque;
                }
            }
            Command::Track { now, next } => {
                let plan = self.plan;
                let Some(drive) = &plan.drive else { return Ok(()) };
                self.velocity_control(drive, now, next)?;
                let work = &mut *self.work;
                for joint in 0..now.len() {
                    let offset = work.feedforward[joint];
                    let (stiffness, damping) = (drive.stiffness[joint], drive.damping[joint]);
                    let angle = self.state.angles[joint];
                    let mut spring =
                        Spring::new(stiffness, damping, offset, angle, now[joint], next[joint], step);
                    if let Some(limits) = &drive.max_torque {
                        if spring.resistance <= NO_RESISTANCE {
                            spring.at_rest = spring.at_rest.clamp(-limits[joint], limits[joint]);
                        } else {
                            work.saturated[joint] = self.state.memory.saturated[joint] != 0.0;
                        }
                    }
                    work.springs[joint] = spring;
                }
            }
        }
        Ok(())
    }

    /// The first pass: offset torques f₀ that would give the joints the target's velocity exactly
    /// (Tokizaki & Hasegawa figure 2), with contacts or without.
    fn velocity_control(&mut self, drive: &DrivePlan, now: &[f64], next: &[f64]) -> Result<(), Failure> {
        let (given, lifted, step) = (self.given(), self.lifted(), self.step);
        let Self { model, plan, state, work, freedom, .. } = self;
        let Some(control) = &mut work.control else {
            work.feedforward.fill(0.0);
            return Ok(());
        };
        for joint in 0..now.len() {
            work.joint_rates[joint] = (next[joint] - now[joint]) / step;
            work.joint_acceleration[joint] = (work.joint_rates[joint] - state.velocities[joint]) / step;
        }
        let root = control
            .prescribe(
                model,
                &work.bodies,
                &work.articulated,
                &work.joint_acceleration,
                *freedom,
                lifted,
                given,
                plan.velocity_forces,
            )
            .ok_or_else(|| singular(model, state, Singular::Root))?;
        if drive.feedforward == Feedforward::ContactAware && !work.touches.is_empty() {
            work.free[0] = after(state, root, plan.velocity_forces, step);
            for index in 1..work.bodies.len() {
                let parent = work.free[model.bodies[index].parent];
                work.free[index] =
                    parent.plus_scaled(work.bodies[index].freedom, work.joint_rates[index - 1]);
            }
            work.control_rows.clear();
            contact::add(
                &mut work.control_rows,
                &work.touches,
                &work.free,
                plan.friction,
                step,
                plan.stabilization,
                &state.memory.contact,
                |touch, direction, half| {
                    // Bodies that touch each other push the rigid whole nowhere.
                    let force = match touch.against.body() {
                        None => Force::at(touch.at, direction),
                        Some(_) => Force::ZERO,
                    };
                    half.copy_from_slice(&control.root.half_solve(force));
                },
            );
            work.control_rows.assemble(step);
            let (problem, force) = work.control_rows.problem(plan.circular_friction());
            let solution = work.engine.solve(&problem, force);
            fail_unless_usable(solution.status, model, state)?;
            let mut half = [0.0; response::ROOT];
            work.control_rows.impulse(1.0, &mut half);
            control.accelerate_root(control.root.finish(half));
            push_contacts(&work.touches, &work.control_rows.force, plan.friction, |body, force| {
                control.push(model, body, force);
            });
        }
        for joint in 0..now.len() {
            let damping = plan.damping.as_ref().map_or(0.0, |damping| damping[joint]);
            work.feedforward[joint] = control.torque(&work.bodies, joint)
                + model.armature[joint] * work.joint_acceleration[joint]
                + damping * work.joint_rates[joint];
        }
        Ok(())
    }

    /// Velocities after the step if no row acted.
    fn free_motion(&mut self) -> Result<(), Failure> {
        let (given, lifted, step) = (self.given(), self.lifted(), self.step);
        let Self { model, plan, state, work, freedom, .. } = self;
        for joint in 0..work.loads.len() {
            let rate = state.velocities[joint];
            let mut load = JointLoad { torque: 0.0, inertia: model.armature[joint] };
            if let Some(damping) = &plan.damping {
                load.torque -= damping[joint] * rate;
                load.inertia += step * damping[joint];
            }
            if !work.saturated[joint] {
                let drive = work.springs[joint].load(rate, step);
                load.torque += drive.torque;
                load.inertia += drive.inertia;
            }
            work.loads[joint] = load;
        }
        let root = work
            .articulated
            .accelerate(
                model,
                &work.bodies,
                &work.loads,
                *freedom,
                lifted,
                given,
                plan.velocity_forces,
                &mut work.joint_acceleration,
            )
            .map_err(|cause| singular(model, state, cause))?;
        work.free[0] = after(state, root, plan.velocity_forces, step);
        for joint in 0..work.joint_rates.len() {
            let rate = state.velocities[joint] + step * work.joint_acceleration[joint];
            work.joint_rates[joint] = rate;
            let parent = work.free[model.bodies[joint + 1].parent];
            work.free[joint + 1] = parent.plus_scaled(work.bodies[joint + 1].freedom, rate);
        }
        Ok(())
    }

    /// What contacts, limits, dry friction and saturated actuators ask of the new velocities.
    fn rows(&mut self) {
        let step = self.step;
        let Self { model, plan, state, work, .. } = self;
        let Workspace { bodies, touches, springs, saturated, articulated, joint_rates, free, rows, .. } =
            &mut **work;
        let memory = &state.memory;
        rows.clear();
        let of_joint =
            |joint: usize, half: &mut [f64]| response::of_joint(model, bodies, articulated, joint, half);
        contact::add(
            rows,
            touches,
            free,
            plan.friction,
            step,
            plan.stabilization,
            &memory.contact,
            |touch, direction, half| {
                let force = Force::at(touch.at, direction);
                response::of_bodies(
                    model,
                    bodies,
                    articulated,
                    touch.body,
                    touch.against.body(),
                    force,
                    half,
                );
            },
        );
        if let Some(limits) = &plan.limits {
            let angles = &state.angles;
            limit::add(rows, limits, angles, joint_rates, step, plan.stabilization, &memory.limit, of_joint);
        }
        if let Some(friction) = &plan.dry_friction {
            dry_friction::add(rows, friction, joint_rates, &memory.dry_friction, of_joint);
        }
        if let Some(limits) = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_ref()) {
            for joint in (0..saturated.len()).filter(|joint| saturated[*joint]) {
                let guess = memory.saturated[joint];
                torque::add(rows, joint, springs[joint], limits[joint], joint_rates[joint], guess, of_joint);
            }
        }
    }

    /// The complementarity problem.
    fn solve(&mut self) -> Result<(), Failure> {
        let Self { model, plan, state, work, step, .. } = self;
        work.residual = 0.0;
        if work.rows.is_empty() {
            return Ok(());
        }
        work.rows.assemble(*step);
        let (problem, force) = work.rows.problem(plan.circular_friction());
        let solution = work.engine.solve(&problem, force);
        work.residual = solution.residual;
        fail_unless_usable(solution.status, model, state)
    }

    /// New velocities.
    fn response(&mut self) {
        let Self { model, work, step, .. } = self;
        if work.rows.is_empty() {
            work.changes.fill(Motion::ZERO);
            return;
        }
        work.rows.impulse(*step, &mut work.half);
        response::finish(
            model,
            &work.bodies,
            &work.articulated,
            &work.half,
            &mut work.joint_rates,
            &mut work.changes,
        );
    }

    /// Torques of the actuators; whether one of them needs a row that it does not have yet.
    fn saturation(&mut self) -> bool {
        let Self { plan, work, .. } = self;
        let mut again = false;
        let limits = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_ref());
        for joint in 0..work.torque.len() {
            if work.saturated[joint] {
                continue;
            }
            let torque = work.springs[joint].torque(work.joint_rates[joint]);
            work.torque[joint] = torque;
            let Some(limits) = limits else { continue };
            if torque.abs() > limits[joint] && work.springs[joint].resistance > NO_RESISTANCE {
                work.saturated[joint] = true;
                again = true;
            }
        }
        again
    }

    /// The new state, and what the next step remembers of this one.
    fn commit(&mut self) {
        let step = self.step;
        let Self { model, plan, state, work, .. } = self;
        let memory = &mut state.memory;
        memory.contact.fill([0.0; 3]);
        memory.limit.fill(0.0);
        memory.dry_friction.fill(0.0);
        memory.saturated.fill(0.0);
        let rows_per_touch = contact::rows_per_touch(plan.friction);
        for (touch, force) in work.touches.iter().zip(work.rows.force.chunks_exact(rows_per_touch)) {
            memory.contact[touch.slot][..rows_per_touch].copy_from_slice(force);
        }
        let limits = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_ref());
        let joint_rows = work.touches.len() * rows_per_touch..;
        for (owner, force) in work.rows.owner[joint_rows.clone()].iter().zip(&work.rows.force[joint_rows]) {
            match *owner {
                Owner::Contact { .. } => {}
                Owner::LowerLimit(joint) => memory.limit[joint] += force,
                Owner::UpperLimit(joint) => memory.limit[joint] -= force,
                Owner::DryFriction(joint) => memory.dry_friction[joint] = *force,
                Owner::Torque(joint) => {
                    work.torque[joint] = *force;
                    if limits.is_some_and(|limits| force.abs() >= limits[joint] * AT_LIMIT) {
                        memory.saturated[joint] = *force;
                    }
                }
            }
        }
        if !model.fixed_base {
            let root = work.free[0].plus(work.changes[0]);
            state.root.linear_velocity = root.linear;
            state.root.angular_velocity = root.angular;
        }
        state.velocities.copy_from_slice(&work.joint_rates);
        advance(state, step);
    }
}

/// Velocity of the root after a step at spatial acceleration `acceleration`.
///
/// The velocity kept in a state is that of the root's origin, which moves: its rate of change is the
/// spatial acceleration plus ω × v (Featherstone 2008, section 2.11).
fn after(state: &State, acceleration: Motion, velocity_forces: bool, step: f64) -> Motion {
    let velocity = Motion { angular: state.root.angular_velocity, linear: state.root.linear_velocity };
    let mut acceleration = acceleration;
    if velocity_forces {
        acceleration.linear += velocity.angular.cross(&velocity.linear);
    }
    velocity.plus_scaled(acceleration, step)
}

/// Calls `push` with the force of every touch on each body that it acts on.
fn push_contacts(
    touches: &[Touch],
    forces: &[f64],
    friction: Option<f64>,
    mut push: impl FnMut(usize, Force),
) {
    for (touch, forces) in touches.iter().zip(forces.chunks_exact(contact::rows_per_touch(friction))) {
        let force = Force::at(touch.at, touch.force(forces));
        push(touch.body, force);
        if let Some(other) = touch.against.body() {
            push(other, force.scaled(-1.0));
        }
    }
}

fn singular(model: &Model, state: &State, cause: Singular) -> Failure {
    let place = match cause {
        Singular::Joint(joint) => format!("joint {}", model.joint_names[joint]),
        Singular::Root => format!("root link {}", model.character.links[0].name),
    };
    Failure {
        time: state.time,
        place,
        cause: "nothing resists an acceleration: the mass matrix is singular".into(),
    }
}
