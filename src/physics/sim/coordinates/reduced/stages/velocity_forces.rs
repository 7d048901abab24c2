//! Which velocities the forces of velocity are taken at: the mean of old and new ones, which they help to make.
//!
//! At the old velocities alone they would feed every rotation by half the square of its turn in a step. The mean is
//! first guessed from the last step's acceleration, which in smooth motion is right to the step's second order; the
//! new velocities tell how far the guess was off, and only if that matters is the rest repeated.

use super::Stages;
use super::convergence::{Left, Passes};
use crate::sim::coordinates::reduced::articulated;
use crate::sim::coordinates::reduced::kinematics::move_along;
use crate::sim::spatial::Motion;

/// Forces of velocity are settled when the mean that they are taken at would move no body farther in the step than this
/// beside the true one, rad or m.
const SETTLED: f64 = 1e-6;

/// The same in the middle of a step, whose own error is smaller.
const SETTLED_IN_THE_MIDDLE: f64 = 1e-9;

/// The same in the middle of a step in which no row acts, where there is no other inaccuracy than the method's.
const SETTLED_IN_FLIGHT: f64 = 1e-11;

/// They are settled there as well within this share of how far half the gain of velocity moves the bodies, times the third
/// power of the turn: the method itself errs by a share of its second power.
const SHARE_IN_FLIGHT: f64 = 0.01;

/// Where rows act, whose forces jump and whose friction takes energy, they are settled as well within these shares of how
/// far half the gain of velocity moves the bodies: in the paper's step, and in the middle of one.
const SHARE_OF_GAIN: [f64; 2] = [0.1, 0.001];

impl Stages<'_> {
    /// Guesses the mean of old and new velocities: those that the last step's acceleration leads to half-way.
    pub(super) fn expect_mean(&mut self) {
        let Self { model, plan, state, work, step, .. } = self;
        if !plan.velocity_forces {
            return;
        }
        let (half, last) = (0.5 * *step, &state.memory.acceleration);
        let rates = state.velocities.iter().zip(&last.joints);
        for (mean, (rate, acceleration)) in work.mean_rates.iter_mut().zip(rates) {
            *mean = rate + half * acceleration;
        }
        let root =
            if model.fixed_base { Motion::ZERO } else { state.root.motion().plus_scaled(last.root, half) };
        self.move_with_mean(root);
    }

    /// What is left to do for the forces of velocity, now that new velocities are known. If something is, the
    /// mean is set anew.
    pub(super) fn correct_mean(&mut self, passes: &mut Passes) -> Left {
        let Self { model, plan, state, work, step, turn, middle, .. } = self;
        if !plan.velocity_forces {
            return Left::Nothing;
        }
        // Half of what the velocities gain, and by how much the guess missed that.
        let (mut gain, mut change) = (0.0_f64, 0.0_f64);
        for ((mean, old), new) in work.mean_rates.iter().zip(&state.velocities).zip(&work.joint_rates) {
            gain = gain.max((0.5 * (new - old)).abs());
            change = change.max((0.5 * (new + old) - mean).abs());
        }
        let mut root = Motion::ZERO;
        if !model.fixed_base {
            let (old, new, mean) = (state.root.motion(), work.new[0], work.bodies[0].velocity);
            root = old.plus(new).scaled(0.5);
            gain = gain.max(root.minus(old).amax());
            change = change.max(root.minus(mean).amax());
        }
        let gain = gain * *step;
        let settled = match (*middle, work.rows.is_empty()) {
            (false, true) => SETTLED,
            (false, false) => SETTLED.max(SHARE_OF_GAIN[0] * gain),
            (true, true) => SETTLED_IN_FLIGHT.max(SHARE_IN_FLIGHT * gain * turn.powi(3)),
            (true, false) => SETTLED_IN_THE_MIDDLE.max(SHARE_OF_GAIN[1] * gain),
        };
        let left = passes.left(change * *step, *turn, settled);
        if left == Left::Something {
            for ((mean, old), new) in work.mean_rates.iter_mut().zip(&state.velocities).zip(&work.joint_rates)
            {
                *mean = 0.5 * (old + new);
            }
            self.move_with_mean(root);
        }
        left
    }

    /// Lets the bodies move with the mean velocities, of which `root` is the root's, and takes the forces of velocity
    /// of that.
    fn move_with_mean(&mut self, root: Motion) {
        let Self { model, work, .. } = self;
        move_along(model, root, &work.mean_rates, &mut work.bodies);
        articulated::prepare(&mut work.articulated, model, &work.bodies, &work.mean_rates);
    }
}
