//! The joints' drives under a command, and the feedforward torques.

use super::{Stages, free_motion::after, free_motion::singular};
use crate::scene::{DrivePlan, Feedforward};
use crate::sim::actuator::ActuatorMode;
use crate::sim::command::Command;
use crate::sim::contact::ContactCandidate;
use crate::sim::coordinates::reduced::articulated::Singular;
use crate::sim::coordinates::reduced::response;
use crate::sim::failure::{Failure, fail_unless_usable};
use crate::sim::lcp::Solver;
use crate::sim::rows::{ROOT, Recovery, contact};
use crate::sim::spatial::SpatialForce;
use crate::sim::tracking::{ImplicitWeights, Spring, Target};

impl Stages<'_> {
    /// The joints' drives under `command`, with their feedforward torques.
    pub(super) fn drives(&mut self, command: Command<'_>) -> Result<(), Failure> {
        let step = self.step;
        let work = &mut *self.work;
        work.actuators.fill(ActuatorMode::Line);
        work.switches = 0;
        work.near_limit.fill([false; 2]);
        work.springs.fill(Spring::default());
        work.torque.fill(0.0);
        work.control_rows.clear();
        match command {
            Command::Passive => {}
            Command::Torque(prescribed) => {
                for (joint, torque) in prescribed.iter().enumerate() {
                    let spring = Spring { at_rest: *torque, resistance: 0.0 };
                    let limits = self.plan.actuator_limits(joint);
                    work.springs[joint] = spring.clamped(limits.torque);
                    let last = self.state.memory.saturated[joint];
                    work.actuators[joint] = ActuatorMode::first(spring, limits, last);
                }
            }
            Command::Velocity(wanted) => {
                for (joint, wanted) in wanted.iter().enumerate() {
                    let Some(wanted) = wanted else { continue };
                    let limits = self.plan.actuator_limits(joint);
                    let spring = Spring::servo_within(*wanted, limits, work.composite_inertia[joint] / step);
                    let last = self.state.memory.saturated[joint];
                    work.springs[joint] = spring;
                    work.actuators[joint] = match ActuatorMode::first(spring, limits, last) {
                        ActuatorMode::Line => ActuatorMode::Boxed,
                        mode => mode,
                    };
                }
            }
            Command::Track { now, next } => {
                let plan = self.plan;
                let Some(drive) = &plan.drive else { return Ok(()) };
                self.velocity_control(drive)?;
                let work = &mut *self.work;
                for joint in 0..now.len() {
                    let offset = work.feedforward[joint] + drive.offset[joint];
                    let (stiffness, damping) = (drive.stiffness[joint], drive.damping[joint]);
                    let angle = self.state.angles[joint];
                    let target = Target { now: now[joint], next: next[joint] };
                    let spring = if self.midpoint {
                        let per_inertia = step / work.composite_inertia[joint];
                        let weights =
                            ImplicitWeights::new(per_inertia * step * stiffness, per_inertia * damping);
                        let rate = self.state.velocities[joint];
                        Spring::at_midpoint(stiffness, damping, weights, offset, angle, rate, target, step)
                    } else {
                        Spring::new(stiffness, damping, offset, angle, target, step)
                    };
                    let limits = drive.limits(joint);
                    work.springs[joint] = spring.clamped(limits.torque);
                    let last = self.state.memory.saturated[joint];
                    work.actuators[joint] = ActuatorMode::first(spring, limits, last);
                }
            }
        }
        Ok(())
    }

    /// Feedforward: offset torques f₀ that would bring the joints to the target's velocity within the feedforward's
    /// period (Tokizaki & Hasegawa figure 2; see [`Reference::rate_after`](crate::sim::tracking::Reference::rate_after)),
    /// with contacts or without.
    pub(super) fn velocity_control(&mut self, drive: &DrivePlan) -> Result<(), Failure> {
        if drive.feedforward != Feedforward::None && !self.model.joints_are_independent() {
            return self.prescribe_velocity(drive);
        }
        let step = self.step;
        let horizon = drive.horizon(self.work.feedforward_period, step);
        let (prescribed, minus_gravity) = (self.prescribed().scaled(step / horizon), self.minus_gravity());
        let Self { model, plan, state, work, root_freedom, .. } = self;
        let Some(control) = &mut work.control else {
            work.feedforward.fill(0.0);
            return Ok(());
        };
        for joint in 0..work.reference.len() {
            let rate = state.velocities[joint];
            work.joint_rates[joint] = work.reference[joint].rate_after(rate, work.feedforward_period, step);
            work.joint_acceleration[joint] = (work.joint_rates[joint] - rate) / step;
        }
        let root = control
            .prescribe(
                model,
                &work.bodies,
                &work.articulated,
                &work.joint_acceleration,
                *root_freedom,
                minus_gravity,
                prescribed,
            )
            .ok_or_else(|| singular(model, state, Singular::Root))?;
        let candidates = &work.candidates[..work.detected];
        if drive.feedforward == Feedforward::ContactAware && !candidates.is_empty() {
            work.free[0] = after(state, root, &work.bodies[0], plan.velocity_forces, horizon);
            for index in 1..work.bodies.len() {
                let parent = work.free[model.bodies[index].parent];
                let rate = state.velocities[index - 1] + horizon * work.joint_acceleration[index - 1];
                work.free[index] = parent.plus_scaled(work.bodies[index].motion_subspace, rate);
            }
            contact::add(
                &mut work.control_rows,
                candidates,
                &work.free,
                plan.friction,
                horizon,
                Recovery::of_unilateral(plan),
                &state.memory.feedforward_contacts,
                contact::compliance(model.mass, horizon),
                |candidate, forces, numbers| {
                    // Contact forces between two bodies of the rigid whole cancel.
                    let forces = if candidate.against.body().is_none() { forces } else { &[] };
                    numbers.extend(control.root.half_solve(response::side_by_side(forces)));
                    ROOT..ROOT
                },
            );
            work.control_rows.assemble(horizon);
            let (problem, force) = work.control_rows.problem(plan.circular_friction());
            let solution = work.solver.solve(&problem, force);
            fail_unless_usable(solution.status, model, state)?;
            let mut half = [0.0; ROOT];
            work.control_rows.impulse(1.0, &mut half);
            control.accelerate_root(control.root.finish(half));
            push_contacts(candidates, &work.control_rows.force, plan.friction, |body, force| {
                control.push(model, body, force);
            });
        }
        for joint in 0..work.feedforward.len() {
            let damping = plan.damping.as_ref().map_or(0.0, |damping| damping[joint]);
            work.feedforward[joint] = control.torque(&work.bodies, joint)
                + model.armature[joint] * work.joint_acceleration[joint]
                + damping * work.joint_rates[joint];
        }
        Ok(())
    }
}

/// Calls `push` with the force of every contact on each body that it acts on.
fn push_contacts(
    candidates: &[ContactCandidate],
    forces: &[f64],
    friction: Option<f64>,
    mut push: impl FnMut(usize, SpatialForce),
) {
    for (candidate, forces) in candidates.iter().zip(forces.chunks_exact(contact::rows_per_contact(friction)))
    {
        let force = SpatialForce::at(candidate.at, candidate.force(forces));
        push(candidate.body, force);
        if let Some(other) = candidate.against.body() {
            push(other, force.scaled(-1.0));
        }
    }
}
