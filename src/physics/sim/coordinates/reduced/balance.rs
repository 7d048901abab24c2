//! Whether a step is accepted: it must neither create energy nor drive a contact into the ground.
//!
//! Both are judged by relative motion, that of the bodies against their common centre of mass and against what they touch.
//!
//! Velocities follow the tangent of the path of the positions, so that a step of any scheme errs by the path's
//! curvature. The schemes here are staggered: the positions half a step before and half a step after those at
//! which forces are taken belong to the old and to the new velocities (in Moreau and Jean's step they are the step's
//! own ends). Between those two poses the kinetic energy may grow by the work of gravity and of the motors and by
//! nothing else, because contacts, limits, friction and dampers only dissipate. Work is that of a force at the mean of
//! old and new velocity, which is exact for forces that are solved for. A rebound changes velocities all at once, and with them the
//! velocity-dependent forces, of which a step has but one value: it errs by the first power of the step, a smooth one by the second. Soft contacts are springs: they give back what they took,
//! and may sink in.

use nalgebra::Vector3;

use super::ReducedCoordinates;
use crate::sim::spatial::SpatialMotion;
use crate::sim::step_control::{
    BALANCE_SAFETY, ENERGY_GROWTH, ENERGY_OF_REBOUND, FINEST_DIVISION, MAX_PENETRATION_GAIN, MAX_SUBSTEPS,
    NEGLIGIBLE_ROTATION, SHORTENING,
};
use crate::sim::step_data::StepData;

impl ReducedCoordinates {
    /// The longest step that is likely to create no energy and to let no contact sink in, s, if this one does;
    /// `angular_rate` is the greatest of a body, rad/s. Under error control only a rebound is judged so: otherwise the step's error
    /// alone counts, but that of a position does not show the energy of a rebound.
    pub(super) fn shorter_step(&mut self, data: &mut StepData<'_>, angular_rate: f64) -> Option<f64> {
        let (whole, step) = (data.plan.step(), data.step);
        let greatest_gain = MAX_PENETRATION_GAIN * data.plan.units.length;
        let straight =
            angular_rate * whole <= NEGLIGIBLE_ROTATION && data.work.problem.residual * step <= greatest_gain;
        let exempt = data.plan.accuracy.step_tolerance.is_some();
        let rebounds = data.work.problem.rows.has_rebounds();
        data.work.coarse = false;
        if (straight || exempt) && !rebounds {
            return None;
        }
        let (created, liveliest) = self.spurious_energy(data);
        let allowed = if rebounds { ENERGY_OF_REBOUND } else { smooth_growth(data) } * liveliest;
        let created = if created > 0.0 { created / allowed } else { 0.0 };
        let sunk = self.penetration_gain(data) / greatest_gain;
        // Both grow with the square of the step, the energy against what is allowed in it; that of a rebound in proportion to it.
        let excess = created.max(sunk);
        let [least, most] = SHORTENING;
        let (finest, growth) =
            if rebounds { (MAX_SUBSTEPS, excess) } else { (FINEST_DIVISION, excess.sqrt()) };
        let too_coarse = excess > 1.0;
        data.work.coarse = too_coarse && step * finest <= whole;
        (too_coarse && !data.work.coarse).then(|| step * (BALANCE_SAFETY / growth).clamp(least, most))
    }

    /// Energy that the step creates, J, and the greater of its kinetic energies before and after. Leaves `displaced` half a step along
    /// the new velocities.
    ///
    /// The kinetic energy is that of the motion against the centre of mass and that of the centre of mass (König). The second
    /// grows by the work of the weight and of the contacts' sum of forces on it, so that of the weight only the latter is left
    /// to be counted; in flight nothing is, whatever the frame.
    fn spurious_energy(&mut self, data: &StepData<'_>) -> (f64, f64) {
        let StepData { model, plan, state, work, step, .. } = data;
        let (half, new) = (0.5 * step, &work.new);
        let old = state.root.motion();
        let root = if model.fixed_base { SpatialMotion::ZERO } else { new.bodies.at(0) };
        let before = self.displaced.displace(model, state, old, &state.velocities, -half);
        let after = self.displaced.displace(model, state, root, &new.rates, half);
        let mut twice_power = if model.fixed_base {
            let velocities = work.placed.old.iter().zip(new.bodies.iter());
            let parts = work.placed.bodies.iter().zip(velocities).zip(&model.bodies);
            let moments = parts.map(|((body, (old, new)), part)| old.plus(new).at(body.center) * part.mass);
            plan.gravity.dot(&moments.sum::<Vector3<f64>>())
        } else {
            -work.outer_force(plan).dot(&(before.center + after.center))
        };
        for ((torque, old), new) in work.drives.torque.iter().zip(&state.velocities).zip(&new.rates) {
            twice_power += torque * (old + new);
        }
        if plan.contact_time_constant.is_some() {
            twice_power += work.power_of_contacts(plan);
        }
        let created = after.kinetic - before.kinetic - half * twice_power;
        // A scene without velocity-dependent forces does not conserve energy.
        (if plan.velocity_forces { created } else { 0.0 }, before.kinetic.max(after.kinetic))
    }

    /// Greatest depth by which a contact penetrates farther in the step, m, because its path curves away from its velocity
    /// or because the solver left it a velocity. Needs `displaced` from [`spurious_energy`](Self::spurious_energy).
    fn penetration_gain(&self, data: &StepData<'_>) -> f64 {
        let StepData { model, plan, work, step, .. } = data;
        if plan.contact_time_constant.is_some() {
            return 0.0;
        }
        let velocity = |index: usize| work.new.bodies.at(index);
        let half = 0.5 * step;
        let root = if model.fixed_base { Vector3::zeros() } else { velocity(0).linear * half };
        // Where half a step takes a body's point, less where its velocity alone would take it.
        let curve = |index: usize, at: Vector3<f64>| {
            let (here, there) = (&work.placed.bodies.at(index), &self.displaced.bodies.at(index));
            let local = here.rotation.tr_mul(&(at - here.origin));
            there.point(local) + root - at - velocity(index).at(at) * half
        };
        let gains = work.detection.candidates.iter().map(|candidate| {
            let normal = candidate.frame[0];
            let other = candidate.against.body().map_or(Vector3::zeros(), |other| curve(other, candidate.at));
            // A whole step curves four times as far as half of it.
            let curved = 4.0 * normal.dot(&(other - curve(candidate.body, candidate.at)));
            curved - step * normal.dot(&candidate.slip(velocity)) + candidate.depth.min(0.0)
        });
        gains.fold(0.0, f64::max)
    }
}

/// Share of the kinetic energy that a step without rebounds may create.
fn smooth_growth(data: &StepData<'_>) -> f64 {
    let time = data.plan.units.time;
    ENERGY_GROWTH * (data.plan.step() / time) * (data.step / time)
}
