//! How the trunk moves: its tilt, its height, and how far it pitches, rolls and heaves within a stride.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use gaitwright_physics::model::Model;
use gaitwright_physics::playback::Trace;
use gaitwright_physics::sim::Root;

/// What the trunk did.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct TrunkMotion {
    /// Greatest tilt from the standing orientation, rad.
    pub(super) tilt: f64,
    /// Least height of the trunk over that of the standing pose, told by the root's origin or whichever point stands in for it
    /// ([`Model::height_mark`]).
    pub(super) least_height: f64,
    /// Pitch from least to greatest within a stride, mean over the strides, rad.
    pub(super) pitch: f64,
    /// Roll, as the pitch, rad.
    pub(super) roll: f64,
    /// Height of the trunk's centre of mass from lowest to highest within a stride, mean over the strides, m.
    pub(super) heave: f64,
}

impl TrunkMotion {
    /// Of the root in `trace`, which stands at `standing` on ground of the height `ground` (m) and goes along `direction`;
    /// strides of `period` seconds.
    pub(super) fn of(
        trace: &Trace,
        (standing, ground): (&Isometry3<f64>, f64),
        direction: [f64; 3],
        model: &Model,
        period: f64,
    ) -> Self {
        let upright = standing.rotation.inverse();
        let forward = Vector3::new(direction[0], direction[1], 0.0);
        let center = model.bodies.first().map_or(Vector3::zeros(), |root| root.center);
        let root_height = standing.translation.z - ground;
        let mark = model.height_mark(root_height, &standing.rotation);
        let height = (root_height + (standing.rotation * mark).z).max(f64::MIN_POSITIVE);
        let poses: Vec<[f64; 4]> = trace
            .samples
            .iter()
            .map(|sample| {
                let root = &sample.root;
                let turned: UnitQuaternion<f64> = root.orientation * upright;
                let up = turned * Vector3::z();
                // Pitch and roll are about the axes of the heading, which may drift from the direction.
                let ahead = turned * forward;
                let heading =
                    Vector3::new(ahead.x, ahead.y, 0.0).try_normalize(0.0).unwrap_or_else(Vector3::x);
                let pitch = up.dot(&heading).atan2(up.z);
                let roll = (up.x * heading.y - up.y * heading.x).atan2(up.z);
                let trunk = root.position + root.orientation * center;
                [pitch, roll, trunk.z, up.z]
            })
            .collect();
        let [pitch, roll, heave] = [0, 1, 2].map(|axis| stroke(trace, period, |at| poses[at][axis]));
        let share = |root: &Root| ((root.position + root.orientation * mark).z - ground) / height;
        let heights = trace.samples.iter().map(|sample| share(&sample.root));
        Self {
            tilt: poses.iter().map(|pose| pose[3].clamp(-1.0, 1.0).acos()).fold(0.0, f64::max),
            least_height: heights.fold(f64::INFINITY, f64::min).min(f64::MAX),
            pitch,
            roll,
            heave,
        }
    }
}

/// Difference of the greatest and the least of `value` (by sample) within a stride of `period` seconds, mean over the whole
/// strides from the start of the trace; of the whole trace where it is shorter than a stride.
fn stroke(trace: &Trace, period: f64, value: impl Fn(usize) -> f64) -> f64 {
    let count = trace.samples.len();
    let interval = super::footfall::interval(trace);
    let length = if period > 0.0 && interval > 0.0 { period / interval } else { f64::INFINITY };
    let strides = ((count.saturating_sub(1)) as f64 / length).floor().max(1.0) as usize;
    let range = |stride: usize| {
        let from = (stride as f64 * length).round() as usize;
        let to = ((stride + 1) as f64 * length).round().min(count as f64 - 1.0).max(0.0) as usize;
        let values = (from..=to.min(count.saturating_sub(1))).filter(|at| *at < count).map(&value);
        let (least, greatest) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, greatest), value| {
                (least.min(value), greatest.max(value))
            });
        (greatest - least).max(0.0)
    };
    (0..strides).map(range).sum::<f64>() / strides as f64
}
