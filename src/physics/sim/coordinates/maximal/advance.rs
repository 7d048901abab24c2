//! Positions after the step, and the momentum of a flight.

use nalgebra::UnitQuaternion;

use super::MaximalCoordinates;
use super::kinematics::{joints_from_bodies, place};
use crate::sim::coordinates::reduced::flight::factor_of_whirl;
use crate::sim::energy::kinetic_energy_at;
use crate::sim::momentum::Composite;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_data::StepData;

impl MaximalCoordinates {
    /// Keeps what the forecast found about the step's length, and whether it was solved.
    pub(super) fn take_judgement(&self, data: &mut StepData<'_>) {
        let (ahead, memory) = (&self.forecast.state.memory, &mut data.state.memory);
        data.work.coarse = self.forecast.work.coarse;
        data.work.problem.unsolved |= self.forecast.work.counts().unsolved;
        memory.tension_squared.copy_from_slice(&ahead.tension_squared);
        memory.pendulum = ahead.pendulum;
    }

    /// Moves the bodies, and gives the joints their angles.
    pub(super) fn move_bodies(&mut self, data: &mut StepData<'_>) {
        let StepData { model, state, work, step, .. } = data;
        for (index, body_state) in state.body_states.iter_mut().enumerate() {
            if self.factors[index].is_fixed() {
                continue;
            }
            let center = work.placed.bodies.at(index).center;
            let row_correction = self.row_correction[index].scaled(*step);
            let velocity = work.new.bodies.at(index).minus(row_correction);
            body_state.linear_velocity = velocity.at(center);
            body_state.angular_velocity = velocity.angular;
            let drift = work.moving().bodies.at(index).minus(row_correction);
            body_state.center += drift.at(center) * *step;
            body_state.orientation =
                UnitQuaternion::from_scaled_axis(drift.angular * *step) * body_state.orientation;
            body_state.orientation.renormalize();
        }
        joints_from_bodies(model, state, *step);
        self.keep_momentum(data);
    }

    /// Gives the bodies the momentum that a step in flight ends with, by a rigid motion of them all.
    fn keep_momentum(&mut self, data: &mut StepData<'_>) {
        let StepData { model, plan, state, work, step, .. } = data;
        if !RootFreedom::keeps_momentum(model, plan) || !work.is_in_flight(plan) {
            return;
        }
        let placed = &mut work.placed;
        // The common motion of all bodies is added to velocities in which the root's is contained.
        placed.bodies.velocity.copy_from(&placed.old);
        let before = Composite::new(&placed.bodies).momentum(SpatialMotion::ZERO);
        let wanted = before.after_flight(model.mass, plan.gravity, *step);
        place(model, state, &mut placed.bodies);
        let composite = Composite::new(&placed.bodies);
        let corrections = [composite.correction(SpatialMotion::ZERO, wanted), composite.rigid_motion(wanted)];
        let [Some(motion), Some(rigid)] = corrections else {
            return;
        };
        for (body_state, body) in state.body_states.iter_mut().zip(placed.bodies.iter()) {
            body_state.linear_velocity += motion.at(body.center);
            body_state.angular_velocity += motion.angular;
        }
        // The energy of a whirl (`coordinates/reduced/flight.rs`).
        if let Some(energy) = self.forecast.energy() {
            let against = placed.bodies.iter().map(|body| body.velocity.plus(motion).minus(rigid));
            let internal = kinetic_energy_at(model, &placed.bodies, against, &state.velocities);
            let of_rigid = composite.kinetic_energy(rigid) - wanted.energy_of_center(model.mass);
            let factor = factor_of_whirl(energy - of_rigid, internal);
            for (body_state, body) in state.body_states.iter_mut().zip(placed.bodies.iter()) {
                let (linear, angular) = (rigid.at(body.center), rigid.angular);
                body_state.linear_velocity = linear + (body_state.linear_velocity - linear) * factor;
                body_state.angular_velocity = angular + (body_state.angular_velocity - angular) * factor;
            }
            state.velocities.iter_mut().for_each(|rate| *rate *= factor);
        }
        // The root's velocity is the one of joint coordinates, with the correction that it has there.
        let ahead = &self.forecast;
        let correction = ahead.state.root.motion().minus(ahead.work.new.bodies.at(0));
        state.root.linear_velocity += correction.linear;
        state.root.angular_velocity += correction.angular;
    }
}
