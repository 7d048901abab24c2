//! Rows s: joints driven toward a moving target by spring, damper and offset torque.
//!
//! Tokizaki & Hasegawa eq. (19) with a target that moves: over a step from t to t + h the target's
//! velocity is v* = (q*(t + h) − q*(t)) / h, the spring displacement at the end of the step is
//! (q − q*(t)) + h (q̇⁺ − v*), and so
//!
//! λ_s = f₀ − K (q − q*(t)) − (D + K h) (q̇⁺ − v*),
//!
//! which is implicit in the new velocity and therefore stable for any K and D. A target that is
//! tracked exactly costs no torque from K or D.

use super::reduced::articulated::JointLoad;

/// A joint's drive over one step, as a line: torque = `at_rest` − `resistance` · q̇⁺.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spring {
    /// β = f₀ − K (q − q*) + α v*, N m or N.
    pub at_rest: f64,
    /// α = D + K h, N m s/rad or N s/m.
    pub resistance: f64,
}

impl Spring {
    /// The drive of a joint at `angle` whose target moves from `now` to `next` over `step` seconds.
    ///
    /// `stiffness` is K, `damping` D, `offset` f₀.
    pub fn new(
        stiffness: f64,
        damping: f64,
        offset: f64,
        angle: f64,
        now: f64,
        next: f64,
        step: f64,
    ) -> Self {
        let resistance = damping + stiffness * step;
        let target_velocity = (next - now) / step;
        Self { at_rest: offset - stiffness * (angle - now) + resistance * target_velocity, resistance }
    }

    /// The torque at the new velocity `rate`, N m or N.
    #[inline]
    pub fn torque(self, rate: f64) -> f64 {
        self.at_rest - self.resistance * rate
    }

    /// What the drive adds to the joint's equation when the joint moves at `rate` before the step.
    #[inline]
    pub fn load(self, rate: f64, step: f64) -> JointLoad {
        JointLoad { torque: self.torque(rate), inertia: step * self.resistance }
    }
}
