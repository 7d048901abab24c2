//! Whether a step is accepted: it must neither create energy nor drive a contact into the ground.
//!
//! Velocities follow the tangent of the path of the positions, so that a step of any scheme errs by the path's
//! curvature. The schemes here are staggered: the positions half a step before and half a step after those at
//! which forces are taken belong to the old and to the new velocities (in Moreau and Jean's step they are the step's
//! own ends). Between those two poses the kinetic energy may grow by the work of gravity and of the motors and by
//! nothing else, because contacts, limits, friction and dampers only dissipate. Work is that of a force at the mean of
//! old and new velocity, which is exact for forces that are solved for.

use nalgebra::Vector3;

use super::Stages;
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_control::{
    BALANCE_SAFETY, ENERGY_GROWTH, FINEST_DIVISION, MAX_PENETRATION_GAIN, NEGLIGIBLE_ROTATION, SHORTENING,
};

impl Stages<'_> {
    /// The longest step that is likely to create no energy and to let no contact sink in, s, if this one does;
    /// `angular_rate` is the greatest of a body, rad/s. Not used under error control, where the step's error alone
    /// counts, nor with feedforward whose period is shorter than the step: it reaches a velocity at the step's end, so that a shorter
    /// step is another drive.
    pub(super) fn shorter_step(&mut self, angular_rate: f64) -> Option<f64> {
        let whole = self.plan.step();
        let straight = angular_rate * whole <= NEGLIGIBLE_ROTATION
            && self.work.residual * self.step <= MAX_PENETRATION_GAIN;
        let exempt = self.plan.accuracy.step_tolerance.is_some() || self.feedforward_depends_on_step();
        if straight || exempt || self.step * FINEST_DIVISION <= whole {
            return None;
        }
        let created = self.spurious_energy();
        let sunk = self.penetration_gain() / MAX_PENETRATION_GAIN;
        // Both grow with the square of the step, the energy against what is allowed in it.
        let excess = created.max(sunk);
        let [least, most] = SHORTENING;
        (excess > 1.0).then(|| self.step * (BALANCE_SAFETY / excess.sqrt()).clamp(least, most))
    }

    /// Whether the feedforward reaches the target's velocity within one step, however short.
    fn feedforward_depends_on_step(&self) -> bool {
        self.feeds_forward() && self.work.feedforward_period < self.plan.step()
    }

    /// Energy that the step creates, as a multiple of what is allowed. Leaves `displaced` half a step along the new
    /// velocities.
    fn spurious_energy(&mut self) -> f64 {
        let half = 0.5 * self.step;
        let Self { model, plan, state, work, step, .. } = self;
        let old = state.root.motion();
        let new = if model.fixed_base { SpatialMotion::ZERO } else { work.new[0] };
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
        let created = after - before - half * twice_power;
        let allowed = ENERGY_GROWTH * plan.step() * *step * before.max(after);
        // A scene without velocity-dependent forces does not conserve energy.
        if created > 0.0 && plan.velocity_forces { created / allowed } else { 0.0 }
    }

    /// Greatest depth by which a contact penetrates farther in the step, m, because its path curves away from its velocity
    /// or because the solver left it a velocity. Needs `displaced` from [`spurious_energy`](Self::spurious_energy).
    fn penetration_gain(&self) -> f64 {
        let Self { model, work, step, .. } = self;
        let velocity = |index: usize| work.new[index];
        let half = 0.5 * step;
        let root = if model.fixed_base { Vector3::zeros() } else { velocity(0).linear * half };
        // Where half a step takes a body's point, less where its velocity alone would take it.
        let curve = |index: usize, at: Vector3<f64>| {
            let (here, there) = (&work.bodies[index], &work.displaced.bodies[index]);
            let local = here.rotation.tr_mul(&(at - here.origin));
            there.point(local) + root - at - velocity(index).at(at) * half
        };
        let gains = work.candidates.iter().map(|candidate| {
            let normal = candidate.frame[0];
            let other = candidate.against.body().map_or(Vector3::zeros(), |other| curve(other, candidate.at));
            // A whole step curves four times as far as half of it.
            let curved = 4.0 * normal.dot(&(other - curve(candidate.body, candidate.at)));
            curved - step * normal.dot(&candidate.slip(velocity)) + candidate.depth.min(0.0)
        });
        gains.fold(0.0, f64::max)
    }
}
