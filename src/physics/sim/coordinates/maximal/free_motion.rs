//! Where the bodies are, the mean velocities, and the velocities that the step would end with if no row acted.

use nalgebra::Vector3;

use super::MaximalCoordinates;
use super::kinematics::{bodies_from_joints, place};
use super::response;
use crate::model::Model;
use crate::sim::bodies::Bodies;
use crate::sim::spatial::{SpatialForce, SpatialMotion};
use crate::sim::step_data::StepData;
use crate::sim::workspace::Velocities;

impl MaximalCoordinates {
    /// Places the bodies and gives them the old velocities.
    pub(super) fn kinematics(&mut self, data: &mut StepData<'_>) {
        let StepData { model, state, work, .. } = data;
        let placed = &mut work.placed;
        if state.body_states.is_empty() {
            bodies_from_joints(model, state, &mut placed.bodies);
        } else {
            place(model, state, &mut placed.bodies);
        }
        placed.common_point = state.root.position;
        placed.begin(&state.velocities);
    }

    /// Gives the bodies the forecast's mean velocities, at which velocity-dependent forces are taken.
    pub(super) fn take_mean_velocities(&mut self, data: &mut StepData<'_>) {
        if !data.plan.has_joint_bias() {
            return;
        }
        let (placed, ahead) = (&mut data.work.placed, &self.forecast.work.placed);
        placed.mean_rates.copy_from_slice(&ahead.mean_rates);
        placed.bodies.velocity.copy_from(&ahead.bodies.velocity);
    }

    /// C / h of every body.
    pub(super) fn correct_rows(&mut self, data: &mut StepData<'_>) {
        let row_correction = &mut self.row_correction;
        row_correction.fill(SpatialMotion::ZERO);
        if !data.plan.has_joint_bias() {
            return;
        }
        let (bodies, rates) = (&data.work.placed.bodies, &data.work.placed.mean_rates);
        // First D of every body, then C.
        for index in 1..bodies.len() {
            let parent = data.model.bodies[index].parent;
            let drift = bodies.at(parent).velocity.cross_motion(bodies.at(index).motion_subspace);
            row_correction[index] = row_correction[parent].plus_scaled(drift, rates[index - 1]);
        }
        let root = bodies.at(0).velocity;
        let of_root = root.angular.cross(&root.linear);
        for (row_correction, body) in row_correction.iter_mut().zip(bodies.iter()) {
            let of_body = body.velocity.angular.cross(&body.velocity.at(body.center));
            *row_correction = row_correction.scaled(-1.0);
            row_correction.linear += of_root - of_body;
        }
    }

    /// Velocities after the step, as the rows read them, if no row acted: under the weights, the velocity-dependent forces and
    /// those loads of the joints that do not depend on their velocities.
    pub(super) fn free_velocities(&mut self, data: &mut StepData<'_>) {
        let StepData { model, plan, state, work, step, .. } = data;
        let (placed, free) = (&work.placed, &mut work.free);
        for (index, body) in placed.bodies.iter().enumerate() {
            let factor = &self.factors[index];
            let mut velocity = placed.old.at(index).plus_scaled(self.row_correction[index], *step);
            if !factor.is_fixed() {
                velocity.linear += plan.gravity * *step;
            }
            if plan.velocity_forces {
                let rotation = body.velocity.angular;
                let momentum =
                    body.rotation * (model.bodies[index].inertia * body.rotation.tr_mul(&rotation));
                let gyroscopic = SpatialForce { moment: momentum.cross(&rotation), force: Vector3::zeros() };
                velocity = velocity.plus_scaled(factor.accelerate(&body, gyroscopic), *step);
            }
            free.bodies.set(index, velocity);
        }
        for (joint, load) in work.drives.loads.iter().enumerate() {
            let line = load.line(state.velocities[joint], *step);
            if !line.is_prescribed() || line.at_rest == 0.0 {
                continue;
            }
            let (child, parent) = (joint + 1, model.bodies[joint + 1].parent);
            let wrench = response::along(&placed.bodies.at(child)).scaled(line.at_rest);
            for (body, wrench) in [(child, wrench), (parent, wrench.scaled(-1.0))] {
                let acceleration = self.factors[body].accelerate(&placed.bodies.at(body), wrench);
                free.bodies.set(body, free.bodies.at(body).plus_scaled(acceleration, *step));
            }
        }
        free_rates(model, &placed.bodies, free);
    }
}

/// Joint velocities of the bodies' free ones.
fn free_rates(model: &Model, bodies: &Bodies, free: &mut Velocities) {
    for (joint, rate) in free.rates.iter_mut().enumerate() {
        *rate = response::rate(model, bodies, joint, &free.bodies);
    }
}
