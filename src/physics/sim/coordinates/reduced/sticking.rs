//! The torques of dry friction with which joints stick (see `sim/joint_friction.rs`).

use multiversion::multiversion;

use super::ReducedCoordinates;
use super::articulated::Articulated;
use super::free_motion::minus_gravity;
use crate::sim::rows::contact;
use crate::sim::spatial::{SpatialForce, SpatialMotion};
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
            let root = bodies[0].velocity;
            constant.linear -= root.angular.cross(&root.linear);
        }
        required(&self.articulated, &work.placed, &work.new.bodies, constant, per_second, wrenches);
        let forces = work.problem.rows.force.chunks_exact(contact::rows_per_contact(plan.friction));
        for (candidate, forces) in work.detection.candidates.iter().zip(forces) {
            let force = SpatialForce::at(candidate.at, candidate.force(forces));
            wrenches[candidate.body] = wrenches[candidate.body].plus(force.scaled(-1.0));
            if let Some(other) = candidate.against.body() {
                wrenches[other] = wrenches[other].plus(force);
            }
        }
        for &index in model.outward.iter().rev() {
            let (joint, wrench) = (index - 1, wrenches[index]);
            let load = &work.drives.loads[joint];
            if let Some(acceleration) = load.held {
                let required = bodies[index].motion_subspace.dot(wrench) + load.inertia * acceleration;
                work.friction.torque[joint] = required - load.torque;
            }
            let parent = model.bodies[index].parent;
            wrenches[parent] = wrenches[parent].plus(wrench);
        }
    }
}

/// The wrench that each body requires for its change to the velocities `new`, `per_second` being one by the step, under the prepared
/// bias forces. `constant` is added to all accelerations.
#[multiversion(targets("x86_64+avx2"))]
fn required(
    articulated: &Articulated,
    placed: &Placement,
    new: &[SpatialMotion],
    constant: SpatialMotion,
    per_second: f64,
    wrenches: &mut [SpatialForce],
) {
    let velocities = placed.old.iter().zip(new);
    for (index, (wrench, (body, (old, new)))) in
        wrenches.iter_mut().zip(placed.bodies.iter().zip(velocities)).enumerate()
    {
        let acceleration = constant.plus_scaled(new.minus(*old), per_second);
        *wrench = articulated.bias_force(index).plus(body.inertia.times(acceleration));
    }
}
