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

use crate::scene::ActuatorLimits;

/// A drive whose resistance α is below this (N m s/rad) is a prescribed torque: it has no slope to solve for.
const NO_RESISTANCE: f64 = 1e-12;

/// A joint's drive over one step, as a line: torque = `at_rest` − `resistance` · q̇⁺.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spring {
    /// β = f₀ − K (q − q*) + α v*, N m or N; of a servo, the wanted velocity, rad/s or m/s.
    pub at_rest: f64,
    /// α = D + K h, N m s/rad or N s/m; infinite for a servo, which takes whatever torque its velocity requires.
    pub resistance: f64,
}

/// A joint's target over a step, rad or m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// At the beginning of the step.
    pub now: f64,
    /// At its end.
    pub next: f64,
}

/// How a joint's target moves at the beginning of a substep: what the feedforward pass brings the joint to.
///
/// Targets are given as angles at the ends of steps, so that the target's velocity is known as its mean over each step. It
/// is taken to change linearly over a step, from the mean of the last step to that of this one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Reference {
    /// The target's velocity r, rad/s or m/s.
    pub rate: f64,
    /// The target's acceleration a*, rad/s² or m/s².
    pub acceleration: f64,
}

impl Reference {
    /// Of a target that moves at `last` over the last step and at `this` over this one, `from` seconds after the beginning
    /// of this step of `whole` seconds.
    pub fn new(last: f64, this: f64, from: f64, whole: f64) -> Self {
        let acceleration = (this - last) / whole;
        Self { rate: last + acceleration * from, acceleration }
    }

    /// Velocity that the feedforward pass gives a joint of velocity `rate` in a step of `step` seconds.
    ///
    /// The pass asks for the acceleration a* + (r − q̇) / T with T the period. The error e = r − q̇ then follows
    /// ė = a* − q̈ = −e / T: it decays within the period whatever the step, and a target that accelerates is
    /// followed without lag (without a* the joint would stay behind by a* T). With x = h / T a step of h takes the share
    /// x − x²/2 + x³/2 of it away, which is 1 − e^(−x) to second order, and which neither overshoots nor
    /// diverges as long as h ≤ T. For h > T the step takes the place of the period. With h = T the
    /// velocity is that of the target over the step, which is the paper's pass (Tokizaki & Hasegawa eq. 17).
    pub fn rate_after(self, rate: f64, period: f64, step: f64) -> f64 {
        let part = step / period.max(step);
        let share = part * (1.0 - 0.5 * part * (1.0 - part));
        rate + step * self.acceleration + (self.rate - rate) * share
    }
}

impl Spring {
    /// The drive of a joint at `angle` over `step` seconds, taken at the end of the step.
    ///
    /// `stiffness` is K, `damping` D, `offset` f₀.
    pub fn new(stiffness: f64, damping: f64, offset: f64, angle: f64, target: Target, step: f64) -> Self {
        let resistance = damping + stiffness * step;
        let target_velocity = (target.next - target.now) / step;
        Self { at_rest: offset - stiffness * (angle - target.now) + resistance * target_velocity, resistance }
    }

    /// The drive of a joint in the midpoint rule. `angle` is the joint's at the midpoint, reached at its old velocity
    /// `rate`:
    ///
    /// λ_s = f₀ − K (q + σ h (q̇⁺ − v*) + (1 − σ) h (q̇⁺ − q̇) / 4 − q*) − D ((1 − θ) q̇ + θ q̇⁺ − v*),
    ///
    /// with q* the mean of the target's ends and the weights σ and θ of [`ImplicitWeights`]. For σ = 0 the spring acts at
    /// the mean of old and new position, which conserves its energy for any K; for σ = 1 it acts half a step after
    /// the new one, which damps what the step cannot resolve.
    #[allow(clippy::too_many_arguments)] // the letters of the equation
    pub fn at_midpoint(
        stiffness: f64,
        damping: f64,
        weights: ImplicitWeights,
        offset: f64,
        angle: f64,
        rate: f64,
        target: Target,
        step: f64,
    ) -> Self {
        let target_velocity = (target.next - target.now) / step;
        let after = weights.spring * step;
        let mean = 0.25 * step * (1.0 - weights.spring);
        let displacement = angle - after * target_velocity - mean * rate - 0.5 * (target.now + target.next);
        let slip = (1.0 - weights.damper) * rate - target_velocity;
        Self {
            at_rest: offset - stiffness * displacement - damping * slip,
            resistance: weights.damper * damping + stiffness * (after + mean),
        }
    }

    /// A drive that holds the velocity `wanted` (rad/s or m/s) as far as its bounds let it (velocity control, Tokizaki &
    /// Hasegawa eq. 17).
    pub fn servo(wanted: f64) -> Self {
        Self { at_rest: wanted, resistance: f64::INFINITY }
    }

    /// The same within `limits`. Without a torque limit the servo has a resistance of 10⁹ times `resistance` (the
    /// joint's inertia over the step, N m s/rad or N s/m) instead, so that a joint that cannot move leaves its equations solvable.
    pub fn servo_within(wanted: f64, limits: ActuatorLimits, resistance: f64) -> Self {
        if limits.torque.is_finite() {
            return Self::servo(wanted);
        }
        let resistance = 1e9 * resistance;
        Self { at_rest: resistance * wanted, resistance }
    }

    /// Whether the drive holds a velocity.
    #[inline]
    pub fn is_servo(self) -> bool {
        self.resistance == f64::INFINITY
    }

    /// Whether the torque is the same at any velocity.
    #[inline]
    pub fn is_prescribed(self) -> bool {
        self.resistance <= NO_RESISTANCE
    }

    /// Limits a prescribed torque to `greatest`; a torque that depends on the velocity stays as it is.
    #[inline]
    pub fn clamped(self, greatest: f64) -> Self {
        match self.is_prescribed() {
            true => Self { at_rest: self.at_rest.clamp(-greatest, greatest), ..self },
            false => self,
        }
    }

    /// The torque at the new velocity `rate`, N m or N; infinite for a servo off its velocity.
    #[inline]
    pub fn torque(self, rate: f64) -> f64 {
        if self.is_servo() {
            let missing = self.at_rest - rate;
            return if missing == 0.0 { 0.0 } else { missing * f64::INFINITY };
        }
        self.at_rest - self.resistance * rate
    }
}

/// Implicit weights of a spring and a damper in the midpoint rule: they are of second order where the step resolves
/// them, and damped where it does not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImplicitWeights {
    /// σ, of the spring: 0 for soft springs, growing with the square of h² K / I, and 1 in the limit of stiff ones.
    pub spring: f64,
    /// θ, of the damper (see [`implicit_damper_weight`]).
    pub damper: f64,
}

impl ImplicitWeights {
    /// For spring K and damper D on an inertia I over a step of h: `spring` = h² K / I, `decay` = h D / I.
    pub fn new(spring: f64, decay: f64) -> Self {
        // At h ω = 2, where an explicit step becomes unstable, σ is 1/2.
        let stiffness = (0.25 * spring).powi(2);
        let weight = if stiffness.is_finite() { stiffness / (1.0 + stiffness) } else { 1.0 };
        Self { spring: weight, damper: implicit_damper_weight(decay) }
    }
}

/// Weight θ of the new velocity in a damping force, for a decay of `decay` = h D / I over the step: the value at
/// which the step is exact for a single damper on an inertia I, θ = 1/(1 − e^−z) − 1/z. It is 1/2 for gentle dampers,
/// which is of second order, and tends to 1 for stiff ones, which keeps the velocity from oscillating.
pub fn implicit_damper_weight(decay: f64) -> f64 {
    if decay < 1e-3 {
        // The series, where the two fractions cancel.
        0.5 + decay / 12.0
    } else if decay == f64::INFINITY {
        1.0
    } else {
        -1.0 / (-decay).exp_m1() - 1.0 / decay
    }
}
