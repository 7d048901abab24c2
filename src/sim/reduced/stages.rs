//! One step of time in joint coordinates: the stages by name, in order.
//!
//! The paper's step takes everything at the beginning of the step but the new velocities, and then moves the
//! positions along them (Tokizaki & Hasegawa eqs. 8-9). Moreau and Jean's with θ = 1/2 moves the positions
//! half-way along the old velocities, takes everything there, and moves them the other half along the new
//! ones: over a sequence of steps that is the same staggered scheme, so that contacts and limits look a
//! whole step ahead in both, but forces of position are taken in the middle, and forces of velocity are
//! repeated until they are those of the mean of old and new velocities. That is of second order, and neither
//! feeds nor drains a rotation.

use super::articulated::{JointLoad, Singular};
use super::kinematics::{BodyMotion, move_along, place};
use super::response;
use super::root::RootFreedom;
use crate::model::Model;
use crate::scene::{DrivePlan, Feedforward, Integrator, StepPlan};
use crate::sim::contact::Touch;
use crate::sim::diagnostics::check_finite;
use crate::sim::integrate::advance;
use crate::sim::rows::{Owner, contact, dry_friction, limit, torque};
use crate::sim::spatial::{Force, Motion};
use crate::sim::state::{State, Swing};
use crate::sim::step::{fail_unless_usable, root_freedom};
use crate::sim::tracking::{Shares, Spring, Target, implicit_share};
use crate::sim::workspace::Workspace;
use crate::sim::{Command, Failure};

/// A drive whose resistance α is below this (N m s/rad) is a given torque: it has no slope to solve for.
const NO_RESISTANCE: f64 = 1e-12;

/// An actuator counts as saturated within this share of its greatest torque.
const AT_LIMIT: f64 = 1.0 - 1e-12;

/// Farthest that a body may turn in a step, rad, at its old velocity as at its new one. What turns faster has
/// to be stepped more finely.
const FARTHEST_TURN: f64 = 0.3;

/// Farthest that the phase of a body swinging under tension may go in a step, rad: such a swing is explicit
/// in its position, and unstable from 2 on.
const FARTHEST_SWING: f64 = 1.0;

/// Forces of velocity are settled when another pass would move no body farther than this in the step,
/// rad or m.
const SETTLED: f64 = 1e-6;

/// The same in the middle of a step, whose own error is smaller.
const SETTLED_IN_THE_MIDDLE: f64 = 1e-9;

/// Greatest number of passes until then. Each has to halve what is left, or the step is too long.
const MOST_PASSES: usize = 20;

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Outcome {
    /// The state is that after the step.
    Done,
    /// A body turns or swings too fast for the step. The state's positions may have moved, its
    /// velocities not.
    TooFast {
        /// Index of the body.
        body: usize,
        /// Longest step that could follow it, s.
        longest: f64,
    },
}

/// One step of `step` seconds, unless a body would turn too far in it.
///
/// # Errors
/// As [`crate::sim::Simulator::step`].
pub fn step(
    model: &Model,
    plan: &StepPlan,
    state: &mut State,
    work: &mut Workspace,
    command: Command<'_>,
    step: f64,
) -> Result<Outcome, Failure> {
    let freedom = root_freedom(model, plan);
    let middle = plan.accuracy.integrator == Integrator::MoreauJean;
    let time = state.time;
    let mut stages = Stages { model, plan, state, work, freedom, step, time, middle, turn: 0.0 };
    if middle {
        stages.first_half();
    }
    stages.kinematics();
    let (body, turn) = stages.fastest_turn();
    if turn * step > FARTHEST_TURN {
        return Ok(Outcome::TooFast { body, longest: FARTHEST_TURN / turn });
    }
    if let Some(Swing { body, rate }) = stages.state.memory.swing
        && rate * step > FARTHEST_SWING
    {
        return Ok(Outcome::TooFast { body, longest: FARTHEST_SWING / rate });
    }
    stages.turn = turn * step;
    stages.detection();
    stages.drives(command)?;
    if !stages.velocities()? || !stages.mean_velocities(command)? {
        return Ok(Outcome::TooFast { body, longest: 0.5 * step });
    }
    let (body, turn) = stages.fastest_new_turn();
    if turn * step > FARTHEST_TURN {
        return Ok(Outcome::TooFast { body, longest: FARTHEST_TURN / turn });
    }
    stages.pulls();
    stages.recovery()?;
    stages.commit();
    check_finite(model, state, || work.rows.worst())?;
    Ok(Outcome::Done)
}

/// New velocities as far as they are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Ahead {
    /// As if no row acted.
    Free,
    /// With all rows.
    Rows,
}

/// Passes over the forces of velocity, which depend on the new velocities that they help to make.
#[derive(Debug)]
struct Passes {
    count: usize,
    /// Change that the last pass brought, rad or m a step.
    last: f64,
    /// Change that is next to nothing.
    settled: f64,
}

/// What a pass leaves to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Left {
    Nothing,
    Something,
    /// The passes do not approach anything.
    Everything,
}

impl Passes {
    fn until(settled: f64) -> Self {
        Self { count: 0, last: f64::INFINITY, settled }
    }

    /// What is left after a pass that brought `change`, where a body turns by `turn` (rad) in the step, which is
    /// about the share of a change that the next pass brings.
    fn left(&mut self, change: f64, turn: f64) -> Left {
        let share = turn.max(change / self.last);
        self.count += 1;
        self.last = change;
        if change * share <= self.settled {
            Left::Nothing
        } else if share <= 0.5 && self.count < MOST_PASSES {
            Left::Something
        } else {
            Left::Everything
        }
    }
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
    /// Farthest that a body turns in it, rad.
    turn: f64,
    /// Time at its beginning, s.
    time: f64,
    /// Whether positions are those of the middle of the step while it is computed.
    middle: bool,
}

impl Stages<'_> {
    /// Where the bodies are and how they move.
    fn kinematics(&mut self) {
        let Self { model, plan, state, work, .. } = self;
        place(model, state, &mut work.bodies);
        for (old, body) in work.old.iter_mut().zip(&work.bodies) {
            *old = body.velocity;
        }
        work.common_point = state.root.position;
        work.mean_rates.copy_from_slice(&state.velocities);
        work.articulated.prepare(model, &work.bodies, &work.mean_rates, plan.velocity_forces);
    }

    /// Moves the positions to the middle of the step, along the old velocities.
    fn first_half(&mut self) {
        let root =
            Motion { angular: self.state.root.angular_velocity, linear: self.state.root.linear_velocity };
        self.work.joint_rates.copy_from_slice(&self.state.velocities);
        advance(self.state, root, &self.work.joint_rates, 0.5 * self.step);
    }

    /// The body that turns fastest at the velocities of the beginning, and its turn, rad/s.
    fn fastest_turn(&self) -> (usize, f64) {
        fastest(self.work.bodies.iter().map(|body| body.velocity))
    }

    /// The same at the new velocities.
    fn fastest_new_turn(&self) -> (usize, f64) {
        fastest(self.work.free.iter().zip(&self.work.changes).map(|(free, change)| free.plus(*change)))
    }

    /// New velocities; whether their forces of velocity settled.
    fn velocities(&mut self) -> Result<bool, Failure> {
        self.work.evaluations += 1;
        loop {
            self.factorise()?;
            if !self.middle && !self.expected_mean()? {
                return Ok(false);
            }
            self.free_velocities(false);
            self.rows();
            self.solve()?;
            self.response();
            // An actuator that would exceed its greatest torque gets a row of its own, and so do a limit
            // that would be passed and a touch that a blow brings about. Each can be added only once, so
            // this ends.
            let saturated = self.saturation();
            let passing = self.passing();
            if !self.struck() && !passing && !saturated {
                return Ok(true);
            }
        }
    }

    /// The paper's step takes forces of velocity at the mean of the old velocities and those to be expected if every
    /// row acts as in the last step: at the old ones alone they would feed every rotation by half the square
    /// of its turn in a step. Whether they settled.
    fn expected_mean(&mut self) -> Result<bool, Failure> {
        if !self.plan.velocity_forces {
            return Ok(true);
        }
        self.expectation();
        let mut passes = Passes::until(SETTLED);
        loop {
            self.free_velocities(true);
            let change = self.mean_motion(Ahead::Free);
            match passes.left(change, self.turn) {
                Left::Nothing => return Ok(true),
                Left::Something => {}
                Left::Everything => return Ok(false),
            }
        }
    }

    /// The forces of the last step's rows, where they would act now.
    fn expectation(&mut self) {
        let Self { state, work, .. } = self;
        let memory = &state.memory;
        work.expected.bodies.fill(Force::ZERO);
        for touch in &work.touches {
            let force = Force::at(touch.at, touch.force(&memory.contact[touch.slot]));
            let bodies = &mut work.expected.bodies;
            bodies[touch.body] = bodies[touch.body].plus(force);
            if let Some(other) = touch.against.body() {
                bodies[other] = bodies[other].plus(force.scaled(-1.0));
            }
        }
        for (joint, push) in work.expected.joints.iter_mut().enumerate() {
            let torque = if work.saturated[joint] { memory.saturated[joint] } else { 0.0 };
            *push = memory.limit[joint] + memory.dry_friction[joint] + torque;
        }
    }

    /// In the middle of a step, repeats all with the forces of velocity of the mean of old and new velocities;
    /// whether they settled.
    fn mean_velocities(&mut self, command: Command<'_>) -> Result<bool, Failure> {
        if !(self.middle && self.plan.velocity_forces) {
            return Ok(true);
        }
        let mut passes = Passes::until(SETTLED_IN_THE_MIDDLE);
        loop {
            let change = self.mean_motion(Ahead::Rows);
            self.drives(command)?;
            self.velocities()?;
            match passes.left(change, self.turn) {
                Left::Nothing => return Ok(true),
                Left::Something => {}
                Left::Everything => return Ok(false),
            }
        }
    }

    /// Lets the bodies move with the mean of old and new velocities, as far as forces of velocity see
    /// them, and gives how much farther that moves one of them in the step, rad or m, than before.
    fn mean_motion(&mut self, ahead: Ahead) -> f64 {
        let Self { model, state, work, step, .. } = self;
        let root = &state.root;
        let old = Motion { angular: root.angular_velocity, linear: root.linear_velocity };
        let (new, new_rates) = match ahead {
            Ahead::Free => (work.free[0], &work.free_rates),
            Ahead::Rows => (work.free[0].plus(work.changes[0]), &work.joint_rates),
        };
        let mean = if model.fixed_base { Motion::ZERO } else { old.plus(new).scaled(0.5) };
        let before = work.bodies[0].velocity;
        let mut change = (mean.angular - before.angular).amax().max((mean.linear - before.linear).amax());
        for joint in 0..work.mean_rates.len() {
            let mean = 0.5 * (state.velocities[joint] + new_rates[joint]);
            change = change.max((mean - work.mean_rates[joint]).abs());
            work.mean_rates[joint] = mean;
        }
        move_along(model, mean, &work.mean_rates, &mut work.bodies);
        work.articulated.prepare(model, &work.bodies, &work.mean_rates, true);
        change * *step
    }

    /// What the character touches.
    fn detection(&mut self) {
        self.work.detect(self.model, self.plan, self.step);
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
        work.near_limit.fill([false; 2]);
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
                    let target = Target { now: now[joint], next: next[joint] };
                    let mut spring = if self.middle {
                        let per_inertia = step / work.carried_inertia[joint];
                        let shares = Shares::new(per_inertia * step * stiffness, per_inertia * damping);
                        let rate = self.state.velocities[joint];
                        Spring::in_the_middle(stiffness, damping, shares, offset, angle, rate, target, step)
                    } else {
                        Spring::new(stiffness, damping, offset, angle, target, step)
                    };
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
            )
            .ok_or_else(|| singular(model, state, Singular::Root))?;
        if drive.feedforward == Feedforward::ContactAware && !work.touches.is_empty() {
            work.free[0] = after(state, root, &work.bodies[0], plan.velocity_forces, step);
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

    /// The mass matrix under the loads of the joints.
    fn factorise(&mut self) -> Result<(), Failure> {
        let step = self.step;
        let Self { model, plan, state, work, freedom, middle, .. } = self;
        for joint in 0..work.loads.len() {
            let rate = state.velocities[joint];
            let mut load = JointLoad { torque: 0.0, inertia: model.armature[joint] };
            if let Some(damping) = &plan.damping {
                let whole = step * damping[joint];
                let share = if *middle { implicit_share(whole / work.carried_inertia[joint]) } else { 1.0 };
                load.torque -= damping[joint] * rate;
                load.inertia += share * whole;
            }
            if !work.saturated[joint] {
                let drive = work.springs[joint].load(rate, step);
                load.torque += drive.torque;
                load.inertia += drive.inertia;
            }
            work.loads[joint] = load;
        }
        work.articulated
            .factorise(model, &work.bodies, &work.loads, *freedom)
            .map_err(|cause| singular(model, state, cause))?;
        Ok(())
    }

    /// Velocities after the step if no row acted, or if rows acted as is `expected`, for the present forces of
    /// velocity.
    fn free_velocities(&mut self, expected: bool) {
        let (given, lifted, step) = (self.given(), self.lifted(), self.step);
        let Self { model, plan, state, work, freedom, .. } = self;
        let root = work.articulated.accelerate(
            model,
            &work.bodies,
            &work.loads,
            expected.then_some(&work.expected),
            *freedom,
            lifted,
            given,
            &mut work.joint_acceleration,
        );
        work.free[0] = after(state, root, &work.bodies[0], plan.velocity_forces, step);
        for joint in 0..work.free_rates.len() {
            let rate = state.velocities[joint] + step * work.joint_acceleration[joint];
            work.free_rates[joint] = rate;
            let parent = work.free[model.bodies[joint + 1].parent];
            work.free[joint + 1] = parent.plus_scaled(work.bodies[joint + 1].freedom, rate);
        }
    }

    /// What contacts, limits, dry friction and saturated actuators ask of the new velocities.
    fn rows(&mut self) {
        let step = self.step;
        let Self { model, plan, state, work, .. } = self;
        let Workspace {
            bodies,
            touches,
            springs,
            saturated,
            near_limit,
            articulated,
            free_rates,
            free,
            rows,
            ..
        } = &mut **work;
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
            for (joint, near) in near_limit.iter_mut().enumerate() {
                let [lower, upper] = limit::near(limits[joint], angles[joint], free_rates[joint], step);
                *near = [near[0] || lower, near[1] || upper];
            }
            limit::add(
                rows,
                limits,
                near_limit,
                angles,
                free_rates,
                step,
                plan.stabilization,
                &memory.limit,
                of_joint,
            );
        }
        if let Some(friction) = &plan.dry_friction {
            dry_friction::add(rows, friction, free_rates, &memory.dry_friction, of_joint);
        }
        if let Some(limits) = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_ref()) {
            for joint in (0..saturated.len()).filter(|joint| saturated[*joint]) {
                let guess = memory.saturated[joint];
                torque::add(rows, joint, springs[joint], limits[joint], free_rates[joint], guess, of_joint);
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
        work.joint_rates.copy_from_slice(&work.free_rates);
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

    /// The force that each joint carries, which makes its body a pendulum under tension, and how fast the
    /// fastest of them swings: ω² = F r / d, with lever r and the inertia d felt at the joint.
    fn pulls(&mut self) {
        let Self { model, plan, state, work, step, .. } = self;
        let Workspace { bodies, free, changes, carried, touches, rows, articulated, levers, old, .. } =
            &mut **work;
        for (index, body) in bodies.iter().enumerate() {
            let new = free[index].plus(changes[index]);
            let gain = new.at(body.center) - old[index].at(body.center);
            let turning = body.velocity.angular.cross(&body.velocity.at(body.center));
            carried[index] = (gain / *step + turning - plan.gravity) * model.bodies[index].mass;
        }
        let rows_per_touch = contact::rows_per_touch(plan.friction);
        for (touch, forces) in touches.iter().zip(rows.force.chunks_exact(rows_per_touch)) {
            let force = touch.force(forces);
            carried[touch.body] -= force;
            if let Some(other) = touch.against.body() {
                carried[other] += force;
            }
        }
        let mut fastest = Swing::default();
        for index in (1..bodies.len()).rev() {
            let joint = index - 1;
            let force = carried[index];
            carried[model.bodies[index].parent] += force;
            // What pulls for one step only is a blow.
            let pull = force.norm();
            let lasting = pull.min(state.memory.pull[joint]);
            state.memory.pull[joint] = pull;
            let square = lasting * levers[joint] * articulated.joints[joint].inverse_d;
            if square > fastest.rate {
                fastest = Swing { body: index, rate: square };
            }
        }
        fastest.rate = fastest.rate.sqrt();
        state.memory.swing = Some(fastest);
    }

    /// The velocities along which positions move: the new ones, and where a penetration or a violated
    /// limit is to be corrected, new ones that also correct it. Correcting leaves no speed behind.
    fn recovery(&mut self) -> Result<(), Failure> {
        let Self { model, plan, state, work, step, .. } = self;
        work.drift = work.free[0].plus(work.changes[0]);
        work.drift_rates.copy_from_slice(&work.joint_rates);
        if !work.rows.recovering() {
            return Ok(());
        }
        work.forces.clone_from(&work.rows.force);
        work.rows.ask_for_recovery(true);
        let (problem, force) = work.rows.problem(plan.circular_friction());
        let solution = work.engine.solve(&problem, force);
        fail_unless_usable(solution.status, model, state)?;
        work.rows.impulse(*step, &mut work.half);
        work.drift_rates.copy_from_slice(&work.free_rates);
        let change = response::finish(
            model,
            &work.bodies,
            &work.articulated,
            &work.half,
            &mut work.drift_rates,
            &mut work.drift_changes,
        );
        work.drift = work.free[0].plus(change);
        work.rows.ask_for_recovery(false);
        work.rows.force.clone_from(&work.forces);
        Ok(())
    }

    /// Whether a joint without a row for its limit would pass it in this step; it gets one.
    fn passing(&mut self) -> bool {
        let Self { plan, state, work, step, .. } = self;
        let Some(limits) = &plan.limits else { return false };
        let mut again = false;
        for (joint, limit) in limits.iter().enumerate() {
            let Some([lower, upper]) = *limit else { continue };
            let end = state.angles[joint] + *step * work.joint_rates[joint];
            for (near, passed) in work.near_limit[joint].iter_mut().zip([end < lower, end > upper]) {
                again |= passed && !*near;
                *near |= passed;
            }
        }
        again
    }

    /// Whether a blow in this step, which changes the velocities after touches were looked for, lets something
    /// else touch; it gets rows.
    fn struck(&mut self) -> bool {
        let Self { model, plan, work, step, .. } = self;
        let blow = work
            .changes
            .iter()
            .zip(&work.bodies)
            .map(|(change, body)| change.at(body.center).amax() + change.angular.amax() * work.reach);
        // What weight does to a body at rest is looked ahead to anyway.
        if work.touches.is_empty() || blow.fold(0.0, f64::max) <= 4.0 * *step * plan.gravity.norm() {
            return false;
        }
        let Workspace { bodies, free, changes, drift_changes, known, touches, .. } = &mut **work;
        for (index, body) in bodies.iter_mut().enumerate() {
            drift_changes[index] = body.velocity;
            body.velocity = free[index].plus(changes[index]);
        }
        known.clone_from(touches);
        work.detect(model, plan, *step);
        let Workspace { bodies, drift_changes, known, touches, .. } = &mut **work;
        for (body, velocity) in bodies.iter_mut().zip(drift_changes) {
            body.velocity = *velocity;
        }
        let count = known.len();
        for touch in touches.iter() {
            if known[..count].iter().all(|other| other.slot != touch.slot) {
                known.push(Touch { rebound: 0.0, ..*touch });
            }
        }
        std::mem::swap(known, touches);
        touches.len() > count
    }

    /// The new state, and what the next step remembers of this one.
    fn commit(&mut self) {
        let (step, time) = (self.step, self.time);
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
        let drift = if model.fixed_base { Motion::ZERO } else { work.drift };
        advance(state, drift, &work.drift_rates, if self.middle { 0.5 * step } else { step });
        state.time = time + step;
    }
}

/// Index and magnitude of the greatest angular velocity, rad/s.
fn fastest(velocities: impl Iterator<Item = Motion>) -> (usize, f64) {
    let mut fastest = (0, 0.0);
    for (index, velocity) in velocities.enumerate() {
        let square = velocity.angular.norm_squared();
        if square > fastest.1 {
            fastest = (index, square);
        }
    }
    (fastest.0, fastest.1.sqrt())
}

/// Velocity of the root after a step at spatial acceleration `acceleration`.
///
/// The velocity kept in a state is that of the root's origin, which moves: its rate of change is the
/// spatial acceleration plus ω × v (Featherstone 2008, section 2.11), with ω and v as the forces of
/// velocity see them.
fn after(state: &State, acceleration: Motion, root: &BodyMotion, velocity_forces: bool, step: f64) -> Motion {
    let velocity = Motion { angular: state.root.angular_velocity, linear: state.root.linear_velocity };
    let mut acceleration = acceleration;
    if velocity_forces {
        acceleration.linear += root.velocity.angular.cross(&root.velocity.linear);
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
