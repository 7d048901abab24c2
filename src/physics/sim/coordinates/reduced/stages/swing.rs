//! How fast bodies swing under the tension in their joints, which the length of the next step has to follow.

use super::Stages;
use crate::sim::memory::Swing;
use crate::sim::rows::{contact, loops};
use crate::sim::workspace::Workspace;

impl Stages<'_> {
    /// The force that each joint carries, which makes its body a pendulum under tension, and how fast the
    /// fastest of them swings: ω² = F r / d, with lever r and the inertia d felt at the joint. Its square, with F²,
    /// takes no root for each joint.
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
        let per_second = 1.0 / *step;
        for (index, body) in bodies.iter().enumerate() {
            let gain = new[index].minus(old[index]).at(body.center);
            let turning = body.velocity.angular.cross(&body.velocity.at(body.center));
            carried[index] = (gain * per_second + turning - plan.gravity) * model.bodies[index].mass;
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
        let (mut fastest, mut greatest) = (0, 0.0);
        for &index in model.outward.iter().rev() {
            let joint = index - 1;
            let force = carried[index];
            carried[model.bodies[index].parent] += force;
            // What pulls for one step only is a blow.
            let pull = force.norm_squared();
            let lasting = pull.min(state.memory.pull[joint]);
            state.memory.pull[joint] = pull;
            let fourth = lasting * (levers[joint] * articulated.joints[joint].inverse_d).powi(2);
            if fourth > greatest {
                (fastest, greatest) = (index, fourth);
            }
        }
        state.memory.swing = Some(Swing { body: fastest, rate: greatest.sqrt().sqrt() });
    }
}
