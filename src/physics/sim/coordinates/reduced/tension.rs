//! The joint tensions, and the frequency of the fastest pendulum under them, which bounds the next step's length.

use multiversion::multiversion;
use nalgebra::Vector3;

use super::ReducedCoordinates;
use super::articulated::Articulated;
use crate::model::Model;
use crate::model::wide::{LANES, Lanes, WideVector};
use crate::sim::memory::Pendulum;
use crate::sim::per_body::{Motions, PerBody};
use crate::sim::rows::{contact, loops};
use crate::sim::spatial::WideMotion;
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
            transmitted_force.set(candidate.body, transmitted_force.at(candidate.body) - force);
            if let Some(other) = candidate.against.body() {
                transmitted_force.set(other, transmitted_force.at(other) + force);
            }
        }
        loops::forces(rows, model, bodies, forces_of_loops);
        for (closing, force) in model.loops.iter().zip(&*forces_of_loops) {
            let [parent, child] = closing.bodies;
            transmitted_force.set(child, transmitted_force.at(child) - force.force);
            transmitted_force.set(parent, transmitted_force.at(parent) + force.force);
        }
        let (mut fastest, mut greatest) = (0, 0.0);
        for index in (1..model.groups.len()).rev() {
            let group = &model.groups[index];
            let forces = transmitted_force.groups[index];
            transmitted_force.add_to_parents(group, &forces);
            for (lane, joint) in group.joints().enumerate() {
                // A tension that lasts for one step only is an impact.
                let tension_squared = forces.at(lane).norm_squared();
                let lasting = tension_squared.min(state.memory.tension_squared[joint]);
                state.memory.tension_squared[joint] = tension_squared;
                let factor = articulated.joints.groups[index].at(lane);
                let fourth = lasting * (moment_arms[joint] * factor.inverse_d).powi(2);
                if fourth > greatest {
                    (fastest, greatest) = (joint + 1, fourth);
                }
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
    new: &Motions,
    articulated: &Articulated,
    gravity: Vector3<f64>,
    step: f64,
    forces: &mut PerBody<Vector3<f64>, 3>,
) {
    let bodies = &placed.bodies;
    // The velocity of the root's origin, which moves, changes by ω × v more than that of the body's point there: see
    // `after` in `free_motion`.
    let root = bodies.velocity.at(0);
    let of_all = root.angular.cross(&root.linear) + gravity;
    for index in 0..model.groups.len() {
        let group = &model.groups[index];
        required_of_group(
            &group.mass,
            &bodies.groups[index].center,
            &bodies.velocity.groups[index],
            &articulated.bias_acceleration.groups[index],
            &placed.old.groups[index],
            &new.groups[index],
            of_all,
            1.0 / step,
            &mut forces.groups[index],
        );
    }
}

/// [`required`] of a group of bodies. `of_all` is what the acceleration of all centres of mass is less.
#[allow(clippy::too_many_arguments)] // see `wide`
#[multiversion(targets("x86_64+avx2"), attrs(allow(clippy::too_many_arguments)))]
fn required_of_group(
    masses: &Lanes,
    centers: &WideVector,
    velocities: &WideMotion,
    bias: &WideMotion,
    old: &WideMotion,
    new: &WideMotion,
    of_all: Vector3<f64>,
    per_second: f64,
    forces: &mut WideVector,
) {
    for lane in 0..LANES {
        let (velocity, center) = (velocities.at(lane), centers.at(lane));
        // All accelerations of the centre of mass but ω × v are of one spatial motion.
        let acceleration = bias.at(lane).plus_scaled(new.at(lane).minus(old.at(lane)), per_second);
        let centripetal = velocity.angular.cross(&velocity.at(center));
        forces.set(lane, (acceleration.at(center) + centripetal - of_all) * masses[lane]);
    }
}
