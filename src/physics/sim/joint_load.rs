//! What acts along a joint in a step beside bodies and rows.

use super::tracking::Spring;

/// Load of a joint: a force, and a force per joint acceleration.
#[derive(Debug, Clone, Copy, Default)]
pub struct JointLoad {
    /// Force along the joint at its present velocity, N m or N.
    pub torque: f64,
    /// Inertia along the joint besides that of bodies: armature, and h times
    /// the coefficients of forces that are implicit in the new velocity; kg m² or kg.
    pub inertia: f64,
    /// The acceleration that the joint is to have whatever it takes, rad/s² or m/s².
    pub held: Option<f64>,
}

impl JointLoad {
    /// What the drive `spring` adds to a joint that moves at `rate` before the step.
    #[inline]
    pub fn of_drive(spring: Spring, rate: f64, step: f64) -> Self {
        Self { torque: spring.torque(rate), inertia: step * spring.resistance, held: None }
    }

    /// The same load of a joint that moves at `rate` as a line in its new velocity.
    #[inline]
    pub fn line(self, rate: f64, step: f64) -> Spring {
        let resistance = self.inertia / step;
        Spring { at_rest: self.torque + resistance * rate, resistance }
    }
}
