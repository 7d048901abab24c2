//! How one joint is discretised, and what a state of the learner is.

use serde::{Deserialize, Serialize};

use gaitwright_physics::motion::TargetLimits;

/// Angle and velocity of one joint on the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Level {
    /// Number of angle steps from the standing angle, [`JointGrid::lowest`] to [`JointGrid::highest`].
    pub angle: i8,
    /// Number of velocity steps from rest, within [`JointGrid::velocity_range`].
    pub velocity: i8,
}

/// A state: one level a joint, and how long it takes to get there.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridState {
    /// One a joint.
    pub levels: Vec<Level>,
    /// Beats that a transition to this state takes, at least 1 (see
    /// [`Parameters::beat`](super::Parameters::beat)).
    pub beats: u8,
}

/// How the angle and the velocity of one joint are discretised.
///
/// Angles are spaced evenly around the standing angle, within its reach; where the range of motion cuts off levels on
/// one side, they are added on the other. The number of velocities depends on the angle, as in figure 3 of Tokizaki &
/// Hasegawa: toward a limit there are only velocities from which the joint can come to rest within one transition
/// time without crossing the limit, so that at the limit itself none points out of the range.
#[derive(Debug, Clone, PartialEq)]
pub struct JointGrid {
    /// Standing angle, rad or m: level 0.
    pub standing: f64,
    /// Distance between two levels of angle, rad or m.
    pub angle_step: f64,
    /// Distance between two levels of velocity, rad/s or m/s.
    pub velocity_step: f64,
    /// What a spline between two states must keep to.
    pub limits: TargetLimits,
    /// Lowest level of angle.
    pub lowest: i8,
    /// Lowest and highest level of velocity at each level of angle, from `lowest` to `highest`.
    pub velocities: Vec<[i8; 2]>,
}

/// A cubic that starts with velocity v and is back at its start, at rest, after time T moves at most 4/27 v T away.
/// Inverse: over a distance d to the limit, the greatest velocity is 27/4 d / T.
const EXCURSION: f64 = 27.0 / 4.0;

impl JointGrid {
    /// Discretises a joint: `angle_levels` over twice `reach` (rad or m) around `standing`, velocities up
    /// to `speed` (rad/s or m/s) on `velocity_levels`, both numbers odd, for transitions of
    /// `transition_time` seconds.
    pub fn new(
        standing: f64,
        limits: Option<[f64; 2]>,
        speed: f64,
        reach: f64,
        (angle_levels, velocity_levels): (u8, u8),
        transition_time: f64,
    ) -> Self {
        let standing = limits.map_or(standing, |[lower, upper]| standing.clamp(lower, upper));
        let (angle_half, velocity_half) = (half(angle_levels), half(velocity_levels));
        let angle_step = reach / f64::from(angle_half.max(1));
        let velocity_step = speed / f64::from(velocity_half.max(1));
        let levels = |room: f64, step: f64, most: i8| (room / step + 1e-9).floor().min(f64::from(most)) as i8;
        let [below, above] = limits.map_or([f64::INFINITY; 2], |[lo, up]| [standing - lo, up - standing]);
        let nearest = |room: f64| levels(room, angle_step, angle_half);
        let farthest = |room: f64| levels(room, angle_step, 2 * angle_half);
        // Levels that a limit cuts off on one side are added on the other.
        let lowest = -farthest(below).min(2 * angle_half - nearest(above));
        let highest = farthest(above).min(2 * angle_half - nearest(below));
        let velocities = (lowest..=highest)
            .map(|level| {
                let offset = f64::from(level) * angle_step;
                let fastest = |room: f64| {
                    levels(EXCURSION * room.max(0.0) / transition_time, velocity_step, velocity_half)
                };
                [-fastest(below + offset), fastest(above - offset)]
            })
            .collect();
        let limits = TargetLimits { range: limits, speed: None };
        Self { standing, angle_step, velocity_step, limits, lowest, velocities }
    }

    /// Highest level of angle.
    pub fn highest(&self) -> i8 {
        self.lowest + (self.velocities.len() - 1) as i8
    }

    /// Lowest and highest level of velocity at a level of angle on the grid.
    pub fn velocity_range(&self, angle: i8) -> [i8; 2] {
        self.velocities[(angle - self.lowest) as usize]
    }

    /// The nearest level that exists: the angle is clamped first, then the velocity to the range at that angle.
    pub fn clamp(&self, angle: i16, velocity: i16) -> Level {
        let angle = angle.clamp(self.lowest.into(), self.highest().into()) as i8;
        let [slowest, fastest] = self.velocity_range(angle);
        Level { angle, velocity: velocity.clamp(slowest.into(), fastest.into()) as i8 }
    }

    /// Whether it has the same levels as `other`, of which the angles count the other way where `sign` is negative.
    pub fn mirrors(&self, other: &Self, sign: i8) -> bool {
        if sign > 0 {
            return self.lowest == other.lowest && self.velocities == other.velocities;
        }
        let reversed = other.velocities.iter().rev().map(|[slowest, fastest]| [-fastest, -slowest]);
        self.lowest == -other.highest() && self.velocities.iter().copied().eq(reversed)
    }

    /// Angle (rad or m) and velocity (rad/s or m/s) of a level.
    pub fn place(&self, level: Level) -> (f64, f64) {
        let angle = self.standing + f64::from(level.angle) * self.angle_step;
        // Rounding must not put the last level beyond the limit.
        let angle = self.limits.range.map_or(angle, |[lower, upper]| angle.clamp(lower, upper));
        (angle, f64::from(level.velocity) * self.velocity_step)
    }
}

/// Levels on each side of the middle one.
fn half(levels: u8) -> i8 {
    (levels / 2).min(i8::MAX as u8 / 2) as i8
}
