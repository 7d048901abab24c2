//! Where the bodies are at the beginning of a step, or in Moreau and Jean's at its middle, and whether it is too long for how
//! they move.

use super::ReducedCoordinates;
use super::kinematics::place;
use multiversion::multiversion;

use crate::model::wide::{LANES, Lanes, WideMatrix};
use crate::model::{BodyGroup, Model};
use crate::sim::bodies::Bodies;
use crate::sim::coordinates::outcome::StepOutcome;
use crate::sim::integrate::advance;
use crate::sim::memory::Pendulum;
use crate::sim::per_body::Motions;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::WideMotion;
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
        let (body, rate) = fastest(model, bodies, &bodies.velocity);
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
        let (body, rate) = fastest(data.model, &data.work.placed.bodies, &data.work.new.bodies);
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

/// Index and magnitude of the greatest angular velocity, rad/s, less spin that changes nothing, when the bodies move with
/// `velocities`.
#[inline(always)] // compiled for the processor of `step`
fn fastest(model: &Model, bodies: &Bodies, velocities: &Motions) -> (usize, f64) {
    let (mut fastest, mut greatest) = (0, 0.0_f64);
    for index in 0..model.groups.len() {
        let group = &model.groups[index];
        let mut squares = [0.0; LANES];
        visible_squares(group, &bodies.groups[index].rotation, &velocities.groups[index], &mut squares);
        for lane in 0..LANES {
            if squares[lane] > greatest {
                (fastest, greatest) = (group.bodies[lane], squares[lane]);
            }
        }
    }
    (fastest, greatest.sqrt())
}

/// Squares of the angular velocities that turn the bodies of `group` visibly, (rad/s)².
#[multiversion(targets("x86_64+avx2"))]
fn visible_squares(group: &BodyGroup, rotations: &WideMatrix, velocities: &WideMotion, squares: &mut Lanes) {
    for lane in 0..LANES {
        let (angular, axis) = (velocities.at(lane).angular, rotations.at(lane) * group.spin_axis.at(lane));
        let visible = angular - axis * axis.dot(&angular);
        squares[lane] = group.shows[lane] * visible.norm_squared();
    }
}
