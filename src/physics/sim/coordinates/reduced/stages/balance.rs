//! Whether a step may be taken as it was computed: it may not make energy, nor drive what touches into the ground.
//!
//! Velocities go along the tangent of the path that positions follow, so that a step of any scheme errs by what the
//! path curves in it. The schemes here are staggered: positions half a step before and half a step after those at
//! which forces are taken belong to the old and to the new velocities (in Moreau and Jean's they are the step's
//! own ends). Between those two poses the kinetic energy may grow by the work of gravity and of the motors and by
//! nothing else, because contacts, limits, friction and dampers only take. All work is that of a force at the mean of
//! old and new velocity, which is exact for forces that are solved for.

use nalgebra::Vector3;

use super::Stages;
use crate::sim::spatial::Motion;
use crate::sim::step_control::{
    BALANCE_SAFETY, ENERGY_SHARE, FINEST, GREATEST_SINKING, SHORTENING, STRAIGHT,
};

impl Stages<'_> {
    /// The longest step that is likely to make no energy and to let nothing sink in, s, where this one does. Under error
    /// control the step's error is what counts, and that alone; and with feedforward, which asks for a velocity at the
    /// step's end, a shorter step is another drive.
    /// `turn` is how fast a body turns, rad/s.
    pub(super) fn flaw(&mut self, turn: f64) -> Option<f64> {
        let whole = self.plan.step();
        let straight = turn * whole <= STRAIGHT && self.work.residual * self.step <= GREATEST_SINKING;
        let exempt = self.plan.accuracy.step_tolerance.is_some() || self.feeds_forward();
        if straight || exempt || self.step * FINEST <= whole {
            return None;
        }
        let made = self.energy_made();
        let sunk = self.sinking() / GREATEST_SINKING;
        // Both grow with the square of the step, the energy against what is allowed in it.
        let excess = made.max(sunk);
        let [least, most] = SHORTENING;
        (excess > 1.0).then(|| self.step * (BALANCE_SAFETY / excess.sqrt()).clamp(least, most))
    }

    /// Energy that the step makes, as a multiple of what it may. Leaves the character displaced by half a step along
    /// its new velocities.
    fn energy_made(&mut self) -> f64 {
        let half = 0.5 * self.step;
        let Self { model, plan, state, work, step, .. } = self;
        let old = state.root.motion();
        let new = if model.fixed_base { Motion::ZERO } else { work.new[0] };
        let before = work.displaced.displace(model, state, old, &state.velocities, -half);
        let after = work.displaced.displace(model, state, new, &work.joint_rates, half);
        let mut twice_power = 0.0;
        for (index, body) in work.bodies.iter().enumerate() {
            let both = work.old[index].plus(work.new[index]);
            twice_power += model.bodies[index].mass * plan.gravity.dot(&both.at(body.center));
        }
        for ((torque, old), new) in work.torque.iter().zip(&state.velocities).zip(&work.joint_rates) {
            twice_power += torque * (old + new);
        }
        let made = after - before - half * twice_power;
        let allowed = ENERGY_SHARE * plan.step() * *step * before.max(after);
        // A scene without forces of velocity does not keep energy.
        if made > 0.0 && plan.velocity_forces { made / allowed } else { 0.0 }
    }

    /// Greatest depth that a touch gains in the step, m, because its path curves away from its velocity or because
    /// the solver left it a velocity, once the character is displaced.
    fn sinking(&self) -> f64 {
        let Self { model, work, step, .. } = self;
        let velocity = |index: usize| work.new[index];
        let half = 0.5 * step;
        let root = if model.fixed_base { Vector3::zeros() } else { velocity(0).linear * half };
        // How far half a step takes a body's point beyond where its velocity leads.
        let curve = |index: usize, at: Vector3<f64>| {
            let (here, there) = (&work.bodies[index], &work.displaced.bodies[index]);
            let local = here.rotation.tr_mul(&(at - here.origin));
            there.point(local) + root - at - velocity(index).at(at) * half
        };
        let sinkings = work.touches.iter().map(|touch| {
            let normal = touch.frame[0];
            let other = touch.against.body().map_or(Vector3::zeros(), |other| curve(other, touch.at));
            // A whole step curves four times as far as half of it.
            let curved = 4.0 * normal.dot(&(other - curve(touch.body, touch.at)));
            curved - step * normal.dot(&touch.slip(velocity)) + touch.depth.min(0.0)
        });
        sinkings.fold(0.0, f64::max)
    }
}
