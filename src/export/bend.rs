//! The path of a root, bent a little to end where it should.

use nalgebra::{UnitQuaternion, Vector3};

use gaitwright_physics::motion::{RootAdjustment, RootMotion, hermite, hermite_rate};
use gaitwright_physics::sim::Root;

/// Intervals into which a bend is divided to find where it is greatest.
const INTERVALS: u32 = 64;

/// What is added to the motion of a root over a stretch of time: nothing at its start, and at its end what was
/// missing. Between them it is the cubic that has no rate at the start and the missing velocity at the end, so that
/// velocities stay those of the path.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    /// Length of the stretch, s.
    duration: f64,
    /// Missing at the end, m and m/s.
    translation: [Vector3<f64>; 2],
    /// The same as a rotation vector in the world frame, rad and rad/s.
    rotation: [Vector3<f64>; 2],
}

impl Bend {
    /// Leads to `wanted` at the end of `duration` seconds, where the root was `found`.
    pub(super) fn new(duration: f64, found: &RootMotion, wanted: &RootMotion) -> Self {
        let (found, wanted) = (Root::from(found), Root::from(wanted));
        let rotation = wanted.orientation * found.orientation.inverse();
        Self {
            duration,
            translation: [wanted.position - found.position, wanted.linear_velocity - found.linear_velocity],
            rotation: [rotation.scaled_axis(), wanted.angular_velocity - found.angular_velocity],
        }
    }

    /// Where the root is at `time` seconds into the stretch, and how it moves, instead of as in `root`.
    pub(super) fn at(&self, time: f64, root: &RootMotion) -> RootMotion {
        let root = Root::from(root);
        RootMotion::from(&Root {
            position: root.position + self.value(&self.translation, time),
            orientation: UnitQuaternion::from_scaled_axis(self.value(&self.rotation, time))
                * root.orientation,
            linear_velocity: root.linear_velocity + self.rate(&self.translation, time),
            angular_velocity: root.angular_velocity + self.rate(&self.rotation, time),
        })
    }

    /// The most that it adds anywhere.
    pub(super) fn greatest(&self) -> RootAdjustment {
        let most = |end: &[Vector3<f64>; 2]| {
            let times = (0..=INTERVALS).map(|index| self.duration * f64::from(index) / f64::from(INTERVALS));
            times.map(|time| self.value(end, time).norm()).fold(0.0, f64::max)
        };
        RootAdjustment { translation: most(&self.translation), rotation: most(&self.rotation) }
    }

    fn value(&self, end: &[Vector3<f64>; 2], time: f64) -> Vector3<f64> {
        end[0].zip_map(&end[1], |value, rate| hermite((0.0, 0.0), (value, rate), self.duration, time))
    }

    fn rate(&self, end: &[Vector3<f64>; 2], time: f64) -> Vector3<f64> {
        end[0].zip_map(&end[1], |value, rate| hermite_rate((0.0, 0.0), (value, rate), self.duration, time))
    }
}
