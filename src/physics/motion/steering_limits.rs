//! Steered targets keep to the ranges and speeds of their joints in every cell.

use super::limits::TargetLimits;
use super::spline::{hermite_range, hermite_rate_range};
use super::steering::{KeyframeChange, Steering, SteeringTable};

/// The spline of one joint between two knots, without any change.
pub(super) struct PlainSegment {
    /// Angle and velocity at its ends.
    pub(super) ends: [(f64, f64); 2],
    /// As which keyframes of the loop the ends are changed; `None` is not changed.
    pub(super) keyframes: [Option<usize>; 2],
    /// s.
    pub(super) duration: f64,
}

impl Steering {
    /// Multiplies the changes of a joint.
    pub(super) fn scale(&mut self, joint: usize, share: f64) {
        for change in self.tables.iter_mut().flat_map(|table| &mut table.rings).flatten() {
            change.angles[joint] *= share;
            change.velocities[joint] *= share;
        }
    }

    /// Most by which the tables together change angle and velocity of a joint at a keyframe.
    fn most(&self, keyframe: usize, joint: usize) -> (f64, f64) {
        let greatest = |of: fn(&KeyframeChange) -> &[f64]| {
            let of_table = |table: &SteeringTable| {
                table.rings.iter().map(|ring| of(&ring[keyframe])[joint].abs()).fold(0.0, f64::max)
            };
            self.tables.iter().map(of_table).sum::<f64>()
        };
        (greatest(|change| &change.angles), greatest(|change| &change.velocities))
    }

    /// The greatest share of a joint's changes, from 0 to 1, with which its targets keep to `limits` on the `segments` in every cell,
    /// whatever came before.
    ///
    /// Between two knots at which the changes are at most a₀, a₁ (angle) and v₀, v₁ (velocity) the spline changes by at most
    /// max(a₀, a₁) + 4/27 (v₀ + v₁) d, and its rate by at most 1.5 (a₀ + a₁) / d + v₀ + v₁: the greatest values of the cubic's
    /// four shapes.
    pub(super) fn share_within(
        &self,
        joint: usize,
        segments: impl Iterator<Item = PlainSegment>,
        limits: &TargetLimits,
    ) -> f64 {
        let mut share: f64 = 1.0;
        let mut allow = |room: f64, change: f64| {
            if change > room.max(0.0) {
                share = share.min(room.max(0.0) / change);
            }
        };
        for PlainSegment { ends: [from, to], keyframes, duration } in segments {
            let [(a, v), (b, w)] =
                keyframes.map(|keyframe| keyframe.map_or((0.0, 0.0), |keyframe| self.most(keyframe, joint)));
            if let Some([lower, upper]) = limits.range {
                let (least, greatest) = hermite_range(from, to, duration);
                allow((least - lower).min(upper - greatest), a.max(b) + 4.0 / 27.0 * (v + w) * duration);
            }
            if let Some(most) = limits.speed {
                let (least, greatest) = hermite_rate_range(from, to, duration);
                allow(most - greatest.max(-least), 1.5 * (a + b) / duration + v + w);
            }
        }
        share
    }
}
