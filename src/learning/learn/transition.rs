//! A transition between two states: the splines that the joints track.

use super::behaviour::Posture;
use super::grid::Grid;
use gaitwright_physics::motion::hermite;

/// Slack for rounding when a spline is compared with its limits, see [`TargetLimits::hold`](gaitwright_physics::motion::TargetLimits::hold).
const ROUNDING: f64 = 1e-9;

/// Cubic Hermite splines, one a joint, from one posture to another over `duration`
/// (Tokizaki & Hasegawa section 2.2).
#[derive(Debug, Clone, Copy)]
pub struct Transition<'a> {
    /// Angles and velocities at its start.
    pub from: &'a Posture,
    /// Angles and velocities at its end.
    pub to: &'a Posture,
    /// s.
    pub duration: f64,
}

impl Transition<'_> {
    /// Writes the target angles (rad or m, one a joint) at `t` seconds into the transition.
    pub fn targets(&self, t: f64, angles: &mut [f64]) {
        for (joint, angle) in angles.iter_mut().enumerate() {
            let (from, to) = self.ends(joint);
            *angle = hermite(from, to, self.duration, t);
        }
    }

    /// Whether the spline of every joint keeps to its range of motion and its greatest speed throughout, by the exact
    /// extremes of the cubics. Between two states inside the range their velocities can lead a spline out of it, and
    /// between two that are far apart it can be too fast; such a transition is not permitted (the problem that section
    /// 3.4 of Tokizaki & Hasegawa starts from).
    pub fn stays_within(&self, grid: &Grid) -> bool {
        grid.joints.iter().enumerate().all(|(joint, grid)| {
            let (from, to) = self.ends(joint);
            grid.limits.hold(from, to, self.duration, ROUNDING)
        })
    }

    fn ends(&self, joint: usize) -> ((f64, f64), (f64, f64)) {
        let end = |posture: &Posture| (posture.angles[joint], posture.velocities[joint]);
        (end(self.from), end(self.to))
    }
}
