//! The velocities at which velocity-dependent (Coriolis and gyroscopic) forces are taken: the mean of the old and the
//! new ones, found by a fixed-point iteration.
//!
//! Taken at the old velocities alone, these forces would add energy to every rotation: half the square of its angle in
//! a step, relatively. The mean is first predicted from the last step's acceleration, which in smooth motion is right
//! to the step's second order. The new velocities show the prediction's error, and only if that matters is the
//! iteration repeated.

use super::kinematics::move_along;
use super::{ReducedCoordinates, articulated};
use crate::sim::bodies::Bodies;
use crate::sim::convergence::{Convergence, FixedPoint};
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_data::StepData;

/// The mean velocity has converged when its error would displace no joint and not the root by more than this in the step, rad
/// or ℓ.
const TOLERANCE: f64 = 1e-6;

/// The same for the midpoint rule, whose own error is smaller.
const TOLERANCE_AT_MIDPOINT: f64 = 1e-9;

/// The same for the midpoint rule in a step without rows, where the method's error is the only other one.
const TOLERANCE_IN_FLIGHT: f64 = 1e-11;

/// In a step without rows, the midpoint rule's tolerance is also this share of the displacement by half the change
/// of velocity, times the third power of the rotation angle: the method's own error is a share of its second power.
const SHARE_IN_FLIGHT: f64 = 0.01;

/// Where rows act, whose forces jump and whose friction dissipates energy, the tolerance is also this share of the
/// displacement by half the change of velocity: in the paper's step, and in the midpoint rule.
const SHARE_OF_GAIN: [f64; 2] = [0.1, 0.001];

/// Least rotation angle of a step, rad, that an error of the mean is weighed with.
const LEAST_ANGLE: f64 = 1e-3;

impl ReducedCoordinates {
    /// Predicts the mean of old and new velocities from the last step's acceleration.
    pub(super) fn predict(&mut self, data: &mut StepData<'_>) {
        let StepData { model, plan, state, work, step, .. } = data;
        if !plan.velocity_forces {
            return;
        }
        let (half, last) = (0.5 * *step, &state.memory.acceleration);
        let rates = state.velocities.iter().zip(&last.joints);
        for (mean, (rate, acceleration)) in work.placed.mean_rates.iter_mut().zip(rates) {
            *mean = rate + half * acceleration;
        }
        let root = if model.fixed_base {
            SpatialMotion::ZERO
        } else {
            state.root.motion().plus_scaled(last.root, half)
        };
        self.move_with_mean(data, root);
    }

    /// Compares the mean with the new velocities, and sets it anew if another iteration is needed.
    #[inline(always)] // compiled for the processor of `step`
    pub(super) fn correct(&mut self, data: &mut StepData<'_>, iteration: &mut FixedPoint) -> Convergence {
        let rotation_angle = self.rotation_angle;
        let StepData { model, plan, state, work, step, midpoint, .. } = data;
        if !plan.velocity_forces {
            return Convergence::Converged;
        }
        // Half the change of velocity, and the error of the mean.
        let (mut gain, mut error) = (0.0_f64, 0.0_f64);
        let rates = work.placed.mean_rates.iter().zip(&state.velocities).zip(&work.new.rates);
        for (((mean, old), new), per_unit) in rates.zip(&self.per_unit) {
            gain = gain.max((0.5 * (new - old)).abs() * per_unit);
            error = error.max((0.5 * (new + old) - mean).abs() * per_unit);
        }
        let mut root = SpatialMotion::ZERO;
        if !model.fixed_base {
            let (old, new, mean) =
                (state.root.motion(), work.new.bodies.at(0), work.placed.bodies.at(0).velocity);
            root = old.plus(new).scaled(0.5);
            let in_units = |it: SpatialMotion| it.angular.amax().max(it.linear.amax() / plan.units.length);
            gain = gain.max(in_units(root.minus(old)));
            error = error.max(in_units(root.minus(mean)));
        }
        let gain = gain * *step;
        let tolerance = match (*midpoint, work.problem.rows.is_empty()) {
            (false, true) => TOLERANCE,
            // An error of the mean changes the new velocities by about its product with the rotation angle, of the step's order more.
            // In the paper's step, which is of first order itself, it is this change that is held to the tolerance.
            (false, false) => TOLERANCE.max(SHARE_OF_GAIN[0] * gain) / rotation_angle.clamp(LEAST_ANGLE, 1.0),
            (true, true) => TOLERANCE_IN_FLIGHT.max(SHARE_IN_FLIGHT * gain * rotation_angle.powi(3)),
            (true, false) => TOLERANCE_AT_MIDPOINT.max(SHARE_OF_GAIN[1] * gain),
        };
        let convergence = iteration.judge(error * *step, rotation_angle, tolerance);
        if convergence == Convergence::Improving {
            for ((mean, old), new) in
                work.placed.mean_rates.iter_mut().zip(&state.velocities).zip(&work.new.rates)
            {
                *mean = 0.5 * (old + new);
            }
            self.move_with_mean(data, root);
        }
        convergence
    }

    /// Sets the mean velocities of the bodies, of which `root` is the root's, and the velocity-dependent forces at them.
    fn move_with_mean(&mut self, data: &mut StepData<'_>, root: SpatialMotion) {
        let placed = &mut data.work.placed;
        let Bodies { groups, velocity, .. } = &mut placed.bodies;
        move_along(data.model, groups, root, &placed.mean_rates, velocity);
        articulated::prepare(&mut self.articulated, data.model, &placed.bodies, &placed.mean_rates);
    }
}
