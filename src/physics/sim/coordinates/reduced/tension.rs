//! The joint tensions, and the frequency of the fastest pendulum under them, which bounds the next step's length.

use multiversion::multiversion;
use nalgebra::Vector3;

use super::ReducedCoordinates;
use super::articulated::Articulated;
use crate::model::Model;
use crate::sim::memory::Pendulum;
use crate::sim::rows::{contact, loops};
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_data::StepData;
use crate::sim::workspace::Placement;

impl ReducedCoordinates {
    /// The tension in each joint, under which its body is a pendulum, and the fastest pendulum: ω² = F r / d, with the
    /// tension F, the moment arm r and the inertia d that the joint shows. Working with ω⁴ and F² takes no root for each
    /// joint.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn joint_tensions(&mut self, data: &mut StepData<'_>) {
        let StepData { model, plan, state, work, step, .. } = data;
        let Self { articulated, transmitted_force, moment_arms, loops: forces_of_loops, .. } = self;
        let (bodies, rows) = (&work.placed.bodies, &work.problem.rows);
        required(model, &work.placed, &work.new.bodies, articulated, plan.gravity, *step, transmitted_force);
        let rows_per_contact = contact::rows_per_contact(plan.friction);
        for (candidate, forces) in
            work.detection.candidates.iter().zip(rows.force.chunks_exact(rows_per_contact))
        {
            let force = candidate.force(forces);
            transmitted_force[candidate.body] -= force;
            if let Some(other) = candidate.against.body() {
                transmitted_force[other] += force;
            }
        }
        loops::forces(rows, model, bodies, forces_of_loops);
        for (closing, force) in model.loops.iter().zip(&*forces_of_loops) {
            let [parent, child] = closing.bodies;
            transmitted_force[child] -= force.force;
            transmitted_force[parent] += force.force;
        }
        let (mut fastest, mut greatest) = (0, 0.0);
        for &index in model.outward.iter().rev() {
            let joint = index - 1;
            let force = transmitted_force[index];
            transmitted_force[model.bodies[index].parent] += force;
            // A tension that lasts for one step only is an impact.
            let tension_squared = force.norm_squared();
            let lasting = tension_squared.min(state.memory.tension_squared[joint]);
            state.memory.tension_squared[joint] = tension_squared;
            let fourth = lasting * (moment_arms[joint] * articulated.joints[joint].inverse_d).powi(2);
            if fourth > greatest {
                (fastest, greatest) = (index, fourth);
            }
        }
        state.memory.pendulum = Some(Pendulum { body: fastest, frequency: greatest.sqrt().sqrt() });
    }
}

/// The force, less its weight, that each body requires to get the velocities `new` in `step` seconds, N.
#[multiversion(targets("x86_64+avx2"))]
fn required(
    model: &Model,
    placed: &Placement,
    new: &[SpatialMotion],
    articulated: &Articulated,
    gravity: Vector3<f64>,
    step: f64,
    forces: &mut [Vector3<f64>],
) {
    let per_second = 1.0 / step;
    // The velocity of the root's origin, which moves, changes by ω × v more than that of the body's point there: see
    // `after` in `free_motion`.
    let root = placed.bodies[0].velocity;
    let of_root = root.angular.cross(&root.linear);
    let velocities = placed.old.iter().zip(new);
    let bodies = placed.bodies.iter().zip(velocities).zip(&model.bodies);
    for (index, (force, ((body, (old, new)), part))) in forces.iter_mut().zip(bodies).enumerate() {
        // All accelerations of the centre of mass but ω × v are of one spatial motion.
        let acceleration = articulated.bias_acceleration(index).plus_scaled(new.minus(*old), per_second);
        let centripetal = body.velocity.angular.cross(&body.velocity.at(body.center)) - of_root;
        *force = (acceleration.at(body.center) + centripetal - gravity) * part.mass;
    }
}
