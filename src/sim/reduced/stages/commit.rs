//! The new state.

use super::Stages;
use crate::sim::Failure;
use crate::sim::integrate::advance;
use crate::sim::lcp::Solver;
use crate::sim::reduced::response;
use crate::sim::rows::{contact, loops};
use crate::sim::spatial::Motion;
use crate::sim::state::Swing;
use crate::sim::step::fail_unless_usable;
use crate::sim::workspace::Workspace;

impl Stages<'_> {
    /// The force that each joint carries, which makes its body a pendulum under tension, and how fast the
    /// fastest of them swings: ω² = F r / d, with lever r and the inertia d felt at the joint.
    pub(super) fn pulls(&mut self) {
        let Self { model, plan, state, work, step, .. } = self;
        let Workspace {
            bodies,
            new,
            carried,
            touches,
            rows,
            articulated,
            levers,
            old,
            loops: forces_of_loops,
            ..
        } = &mut **work;
        for (index, body) in bodies.iter().enumerate() {
            let gain = new[index].minus(old[index]).at(body.center);
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
        loops::forces(rows, model, bodies, forces_of_loops);
        for (closing, force) in model.loops.iter().zip(&*forces_of_loops) {
            let [parent, child] = closing.bodies;
            carried[child] -= force.force;
            carried[parent] += force.force;
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
    pub(super) fn recovery(&mut self) -> Result<(), Failure> {
        let Self { model, plan, state, work, step, .. } = self;
        work.drift = work.new[0];
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

    /// The new state, and what the next step remembers of this one.
    pub(super) fn commit(&mut self) {
        let (step, time) = (self.step, self.time);
        let Self { model, plan, state, work, .. } = self;
        let per_touch = contact::rows_per_touch(plan.friction);
        let greatest = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_deref());
        state.memory.remember(&work.rows, &work.touches, per_touch, greatest);
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
        let drift = if model.fixed_base { Motion::ZERO } else { work.drift };
        advance(state, drift, &work.drift_rates, if self.middle { 0.5 * step } else { step });
        state.time = time + step;
    }
}
