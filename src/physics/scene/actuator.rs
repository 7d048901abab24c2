//! What an actuator can do.

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
    pub fn falls_with_speed(self) -> bool {
        self.speed.is_finite() && self.torque.is_finite() && self.torque > 0.0
    }

    /// l and u at the velocity `rate`, N m or N.
    pub fn available(self, rate: f64) -> [f64; 2] {
        let share = |speed: f64| self.torque * (1.0 - speed / self.speed).clamp(0.0, 1.0);
        [-share(-rate), share(rate)]
    }
}
