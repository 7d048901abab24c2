//! What an actuator can do.

/// A torque is all that an actuator has where it is within this share of its greatest torque of what it has at its speed.
const SLACK: f64 = 1e-6;

/// What an actuator can do; both infinite where unlimited.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActuatorLimits {
    /// τ_max, N m or N.
    pub torque: f64,
    /// v_max, rad/s or m/s.
    pub speed: f64,
}

impl ActuatorLimits {
    /// Whether the torque falls with the speed.
    #[inline]
    pub fn falls_with_speed(self) -> bool {
        self.speed.is_finite() && self.is_bounded()
    }

    /// Whether `torque` is available at the velocity `rate` whichever the direction of either; false also where that is a
    /// matter of rounding, and where the greatest speed is 0.
    #[inline]
    pub fn surely_has(self, torque: f64, rate: f64) -> bool {
        torque.abs() <= self.torque * (1.0 - rate.abs() / self.speed) * (1.0 - 1e-12)
    }

    /// Whether there is a greatest torque, above 0: an actuator without any needs no row.
    pub fn is_bounded(self) -> bool {
        self.torque.is_finite() && self.torque > 0.0
    }

    /// Whether `torque` is all that it has at the velocity `rate`, in either direction; false where it is not bounded.
    pub fn gives_all(self, torque: f64, rate: f64) -> bool {
        let [least, greatest] = self.available(rate);
        let slack = SLACK * self.torque;
        self.is_bounded() && (torque <= least + slack || torque >= greatest - slack)
    }

    /// l and u at the velocity `rate`, N m or N.
    pub fn available(self, rate: f64) -> [f64; 2] {
        let share = |speed: f64| self.torque * (1.0 - speed / self.speed).clamp(0.0, 1.0);
        [-share(-rate), share(rate)]
    }
}
