//! Where the bodies are at the beginning of a step, or in Moreau and Jean's at its middle, and whether it is too long for how
//! they move.

use super::ReducedCoordinates;
use super::kinematics::place;
use crate::model::Model;
use crate::sim::bodies::BodyMotion;
use crate::sim::coordinates::outcome::StepOutcome;
use crate::sim::integrate::advance;
use crate::sim::memory::Pendulum;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_control::{MAX_PENDULUM_PHASE, MAX_ROTATION_ANGLE, SLOW_ROTATION};
use crate::sim::step_data::StepData;

impl ReducedCoordinates {
    /// Places the bodies. The outcome of a step that is too long for the old velocities.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn begin(&mut self, data: &mut StepData<'_>) -> Option<StepOutcome> {
        if RootFreedom::keeps_momentum(data.model, data.plan) {
            self.flight.begin(data.state);
        }
        if data.midpoint {
            first_half(data);
        }
        self.kinematics(data);
        let StepData { model, state, work, step, .. } = data;
        let bodies = &work.placed.bodies;
        let (body, rate) = fastest(model, bodies, bodies.iter().map(|body| body.velocity));
        if rate * *step > MAX_ROTATION_ANGLE {
            return Some(StepOutcome::TooFast { body, longest: MAX_ROTATION_ANGLE / rate });
        }
        if let Some(Pendulum { body, frequency }) = state.memory.pendulum
            && frequency * *step > MAX_PENDULUM_PHASE
        {
            return Some(StepOutcome::TooFast { body, longest: MAX_PENDULUM_PHASE / frequency });
        }
        self.rotation_angle = rate * *step;
        data.fastest = body;
        None
    }

    /// Places the bodies and gives them the old velocities.
    fn kinematics(&mut self, data: &mut StepData<'_>) {
        let StepData { model, state, work, midpoint, .. } = data;
        let placed = &mut work.placed;
        if *midpoint || !self.flight.take_bodies(&mut placed.bodies) {
            place(model, state, &mut placed.bodies);
        }
        placed.common_point = state.root.position;
        placed.begin(&state.velocities);
    }

    /// The outcome of a step that is too long for the new velocities.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn refuse(&mut self, data: &mut StepData<'_>) -> Option<StepOutcome> {
        let (body, rate) =
            fastest(data.model, &data.work.placed.bodies, data.work.new.bodies.iter().copied());
        if rate * data.step > MAX_ROTATION_ANGLE {
            return Some(StepOutcome::TooFast { body, longest: MAX_ROTATION_ANGLE / rate });
        }
        self.whirls = rate * data.plan.units.time > SLOW_ROTATION;
        self.shorter_step(data, rate).map(|longest| StepOutcome::TooCoarse { longest })
    }
}

/// Moves the positions to the step's midpoint, along the old velocities.
fn first_half(data: &mut StepData<'_>) {
    let rates = &mut data.work.new.rates;
    rates.copy_from_slice(&data.state.velocities);
    advance(data.state, data.state.root.motion(), rates, 0.5 * data.step);
}

/// Index and magnitude of the greatest angular velocity, rad/s, less spin that changes nothing.
#[inline(always)] // compiled for the processor of `step`
fn fastest(
    model: &Model,
    bodies: &[BodyMotion],
    velocities: impl Iterator<Item = SpatialMotion>,
) -> (usize, f64) {
    let mut fastest = (0, 0.0);
    for (index, ((velocity, body), spin)) in velocities.zip(bodies).zip(&model.spins).enumerate() {
        let square = spin.visible_squared(&body.rotation, velocity.angular);
        if square > fastest.1 {
            fastest = (index, square);
        }
    }
    (fastest.0, fastest.1.sqrt())
}
