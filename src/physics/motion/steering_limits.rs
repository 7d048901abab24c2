//! Steered targets keep to the ranges and speeds of their joints in every cell.

use super::limits::TargetLimits;
use super::spline::{hermite_range, hermite_rate_range};
use super::steering::{KeyframeChange, Steering, SteeringTable};

impl Steering {
    /// Reduces the changes of a joint until its targets keep to `limits` in every cell ([`Self::share_within`]).
    pub fn keep_within(
        &mut self,
        joint: usize,
        knots: &[(f64, f64)],
        durations: &[f64],
        limits: &TargetLimits,
    ) {
        let share = self.share_within(joint, knots, durations, limits);
        if share < 1.0 {
            for change in self.tables.iter_mut().flat_map(|table| &mut table.rings).flatten() {
                change.angles[joint] *= share;
                change.velocities[joint] *= share;
            }
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

    /// The greatest share of a joint's changes, from 0 to 1, with which its targets keep to `limits` in every cell, whatever came before.
    /// `knots` are angle and velocity at the keyframes of the loop, the first once more at the end, `duration` apart.
    ///
    /// Between two keyframes at which the changes are at most a₀, a₁ (angle) and v₀, v₁ (velocity) the spline changes by at most
    /// max(a₀, a₁) + 4/27 (v₀ + v₁) d, and its rate by at most 1.5 (a₀ + a₁) / d + v₀ + v₁: the greatest values of the cubic's
    /// four shapes.
    pub fn share_within(
        &self,
        joint: usize,
        knots: &[(f64, f64)],
        durations: &[f64],
        limits: &TargetLimits,
    ) -> f64 {
        let count = durations.len();
        let mut share: f64 = 1.0;
        let mut allow = |room: f64, change: f64| {
            if change > room.max(0.0) {
                share = share.min(room.max(0.0) / change);
            }
        };
        for (index, (pair, &duration)) in knots.windows(2).zip(durations).enumerate() {
            let (a, v) = self.most(index, joint);
            let (b, w) = self.most((index + 1) % count, joint);
            if let Some([lower, upper]) = limits.range {
                let (least, greatest) = hermite_range(pair[0], pair[1], duration);
                allow((least - lower).min(upper - greatest), a.max(b) + 4.0 / 27.0 * (v + w) * duration);
            }
            if let Some(most) = limits.speed {
                let (least, greatest) = hermite_rate_range(pair[0], pair[1], duration);
                allow(most - greatest.max(-least), 1.5 * (a + b) / duration + v + w);
            }
        }
        share
    }
}
