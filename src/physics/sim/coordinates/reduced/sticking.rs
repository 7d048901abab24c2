//! The torques of dry friction with which joints stick (see `sim/joint_friction.rs`).

use multiversion::multiversion;

use super::ReducedCoordinates;
use super::articulated::Articulated;
use super::free_motion::minus_gravity;
use crate::model::wide::LANES;
use crate::sim::per_body::{Forces, Motions};
use crate::sim::rows::contact;
use crate::sim::spatial::{SpatialForce, SpatialMotion, WideForce, WideInertia, WideMotion};
use crate::sim::step_data::StepData;
use crate::sim::workspace::Placement;

impl ReducedCoordinates {
    /// Torques of friction in the joints that stick: what their bodies, with all beyond, require at the new velocities and
    /// under the contacts' forces, less what the joints' drives and dampers give (Featherstone 2008, section 5.3).
    pub(super) fn stick(&mut self, data: &mut StepData<'_>) {
        let minus_gravity = minus_gravity(data);
        let StepData { model, plan, work, step, .. } = data;
        let (bodies, wrenches) = (&work.placed.bodies, &mut self.wrenches);
        let per_second = 1.0 / *step;
        // Bias forces contain what the velocities accelerate; see `after` for the root's.
        let mut constant = minus_gravity;
        if plan.velocity_forces {
            let root = bodies.at(0).velocity;
            constant.linear -= root.angular.cross(&root.linear);
        }
        required(&self.articulated, &work.placed, &work.new.bodies, constant, per_second, wrenches);
        let forces = work.problem.rows.force.chunks_exact(contact::rows_per_contact(plan.friction));
        for (candidate, forces) in work.detection.candidates.iter().zip(forces) {
            let force = SpatialForce::at(candidate.at, candidate.force(forces));
            wrenches.set(candidate.body, wrenches.at(candidate.body).plus(force.scaled(-1.0)));
            if let Some(other) = candidate.against.body() {
                wrenches.set(other, wrenches.at(other).plus(force));
            }
        }
        for index in (1..model.groups.len()).rev() {
            let (group, wrench) = (&model.groups[index], wrenches.groups[index]);
            for (lane, joint) in group.joints().enumerate() {
                let load = &work.drives.loads[joint];
                if let Some(acceleration) = load.held {
                    let along = bodies.groups[index].motion_subspace.at(lane);
                    let required = along.dot(wrench.at(lane)) + load.inertia * acceleration;
                    work.friction.torque[joint] = required - load.torque;
                }
            }
            wrenches.add_to_parents(group, &wrench);
        }
    }
}

/// The wrench that each body requires for its change to the velocities `new`, `per_second` being one by the step, under the prepared
/// bias forces. `constant` is added to all accelerations.
#[multiversion(targets("x86_64+avx2"))]
fn required(
    articulated: &Articulated,
    placed: &Placement,
    new: &Motions,
    constant: SpatialMotion,
    per_second: f64,
    wrenches: &mut Forces,
) {
    for (index, wrenches) in wrenches.groups.iter_mut().enumerate() {
        required_of_group(
            &articulated.bias_force.groups[index],
            &placed.bodies.groups[index].inertia,
            &placed.old.groups[index],
            &new.groups[index],
            constant,
            per_second,
            wrenches,
        );
    }
}

/// [`required`] of a group of bodies.
#[multiversion(targets("x86_64+avx2"), attrs(allow(clippy::too_many_arguments)))]
fn required_of_group(
    bias: &WideForce,
    inertias: &WideInertia,
    old: &WideMotion,
    new: &WideMotion,
    constant: SpatialMotion,
    per_second: f64,
    wrenches: &mut WideForce,
) {
    for lane in 0..LANES {
        let acceleration = constant.plus_scaled(new.at(lane).minus(old.at(lane)), per_second);
        wrenches.set(lane, bias.at(lane).plus(inertias.at(lane).times(acceleration)));
    }
}
