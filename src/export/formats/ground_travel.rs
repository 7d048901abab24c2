//! The even travel of a loop over the ground.

use nalgebra::{Isometry3, Rotation3, Translation3, UnitQuaternion, Vector3};

use gaitwright_physics::motion::{RootAdvance, RootMotion};

/// The travel of one cycle of a loop, spread evenly over its time.
///
/// The frame [`GroundTravel::frame`] is the world frame at the cycle's start; at its end it has moved by the
/// loop's whole `root_advance`. Seen from it, the root's motion repeats itself cycle by cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GroundTravel {
    /// The point below the root at the start of the cycle, m.
    pivot: Vector3<f64>,
    /// Travel of one cycle in the world frame, m.
    step: Vector3<f64>,
    /// Rotation of one cycle about z, rad.
    yaw: f64,
    /// Duration of one cycle, s.
    period: f64,
}

impl GroundTravel {
    /// The travel of a cycle that starts with the root at `start` and takes `period` seconds.
    pub(super) fn new(start: &RootMotion, advance: &RootAdvance, period: f64) -> Self {
        let [x, y, _] = start.position;
        let step = about_z(start.heading()) * Vector3::from(advance.translation);
        Self { pivot: Vector3::new(x, y, 0.0), step, yaw: advance.yaw, period }
    }

    /// The travelling frame `time` seconds after the start of the cycle, in the world frame.
    pub(super) fn frame(&self, time: f64) -> Isometry3<f64> {
        let part = time / self.period;
        let rotation = about_z(self.yaw * part);
        let translation = self.pivot + self.step * part - rotation * self.pivot;
        Isometry3::from_parts(Translation3::from(translation), rotation)
    }

    /// Its speed over the ground, m/s.
    pub(super) fn speed(&self) -> f64 {
        self.step.norm() / self.period
    }

    /// Velocities of a point and of a body in the travelling frame: `position`, m, is that of the point in this frame,
    /// `linear` (m/s) and `angular` (rad/s) are the velocities in the world frame.
    pub(super) fn relative_velocities(
        &self,
        time: f64,
        position: &Vector3<f64>,
        linear: &Vector3<f64>,
        angular: &Vector3<f64>,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let back = self.frame(time).rotation.inverse();
        let spin = Vector3::z() * (self.yaw / self.period);
        let linear = back * (linear - self.step / self.period) - spin.cross(&(position - self.pivot));
        (linear, back * angular - spin)
    }
}

fn about_z(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(&Vector3::z_axis(), angle))
}
