//! What bounds an actuator in a step: its greatest torque, and a torque that falls as its speed rises.
//!
//! With the greatest torque τ_max and the greatest speed v_max, a motor has in the direction of motion
//!
//! τ ≤ u(q̇⁺) = τ_max clamp(1 − q̇⁺ / v_max, 0, 1),  τ ≥ l(q̇⁺) = −τ_max clamp(1 + q̇⁺ / v_max, 0, 1),
//!
//! at its new velocity: nothing is left at v_max, and against the motion the whole torque brakes. Either bound is itself the
//! line ±τ_max − (τ_max / v_max) q̇⁺ within a box, [0, τ_max] or [−τ_max, 0]: a saturated row s of
//! resistance τ_max / v_max (see [`rows::torque`](super::rows::torque)). The drive's own line, u and l all fall with q̇⁺, so
//! that the torque min(max(drive, l), u) does, and a joint has one solution. Which of the three lines holds is found by
//! solving with one and comparing at the new velocity; for a joint alone the first comparison is right.

use super::tracking::Spring;
use crate::scene::ActuatorLimits;

/// Share of the greatest torque within which two lines count as equal, so that rounding switches nothing.
const SLACK: f64 = 1e-9;

/// Which line an actuator's torque follows in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ActuatorMode {
    /// That of its drive, below every bound: no row.
    #[default]
    Line,
    /// That of its drive within ±τ_max: a row.
    Boxed,
    /// u, the greatest torque in the positive direction: a row.
    Forward,
    /// l, the greatest torque in the negative direction: a row.
    Backward,
}

impl ActuatorMode {
    /// The first to be tried for an actuator driven by `spring` that had the torque `last` at its bound in the last step
    /// (0: it was not at its bound).
    #[inline]
    pub fn first(spring: Spring, limits: ActuatorLimits, last: f64) -> Self {
        if last == 0.0 {
            // In most steps an actuator is not at its bound.
            if spring.is_servo() { Self::Boxed } else { Self::Line }
        } else if limits.falls_with_speed() && last > 0.0 {
            Self::Forward
        } else if limits.falls_with_speed() && last < 0.0 {
            Self::Backward
        } else if spring.is_servo() || !spring.is_prescribed() {
            Self::Boxed
        } else {
            Self::Line
        }
    }

    /// The line and the box of the actuator's row, if it has one.
    pub fn row(self, spring: Spring, limits: ActuatorLimits) -> Option<(Spring, [f64; 2])> {
        let most = limits.torque;
        let bound = |at_rest: f64| Spring { at_rest, resistance: most / limits.speed };
        match self {
            Self::Line => None,
            Self::Boxed => Some((spring, [-most, most])),
            Self::Forward => Some((bound(most), [0.0, most])),
            Self::Backward => Some((bound(-most), [-most, 0.0])),
        }
    }

    /// Whether it is that of a torque that falls as the speed rises.
    pub fn is_at_bound(self) -> bool {
        matches!(self, Self::Forward | Self::Backward)
    }

    /// The mode that holds where this one gives the torque `torque` at the new velocity `rate`.
    pub fn next(self, spring: Spring, limits: ActuatorLimits, torque: f64, rate: f64) -> Self {
        if !limits.falls_with_speed() {
            let exceeds = self == Self::Line && torque.abs() > limits.torque && !spring.is_prescribed();
            return if exceeds { Self::Boxed } else { self };
        }
        let [lower, upper] = limits.available(rate);
        let wanted = if self.is_at_bound() { spring.torque(rate) } else { torque };
        let slack = SLACK * limits.torque;
        match self {
            Self::Forward if wanted >= upper - slack => self,
            Self::Backward if wanted <= lower + slack => self,
            // A servo at its bound that passes its velocity may reach it with less torque: off it, it wants all or nothing.
            Self::Forward | Self::Backward if spring.is_servo() => Self::Boxed,
            _ if wanted > upper + slack => Self::Forward,
            _ if wanted < lower - slack => Self::Backward,
            Self::Forward | Self::Backward => Self::Line,
            Self::Line | Self::Boxed => self,
        }
    }
}
