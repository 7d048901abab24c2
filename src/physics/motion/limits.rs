//! What the targets of a joint must keep to: its range of motion and its greatest speed.
//!
//! The rule is the same for every motion. One that comes from outside, as a document, is refused where a spline between
//! two of its keyframes leaves the range or exceeds the speed by more than rounding: it is not what its author drew any
//! more once it is changed ([`Player::new`](super::Player::new)). One that a search makes is changed before it is
//! simulated ([`shape`](super::shape())), or the transition is not permitted.

use super::document::Keyframe;
use super::spline::{hermite_range, hermite_rate_range};
use crate::character::{Character, Joint, JointKind};
use crate::fault::Fault;

/// How far a target may be beyond its limits and still count as within: rad, m and their rates, relative above 1. It
/// leaves room for numbers written with nine digits.
const ROUNDING: f64 = 1e-6;

/// What the targets of a joint must keep to.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TargetLimits {
    /// Range of motion, rad or m; `None` is unlimited.
    pub range: Option<[f64; 2]>,
    /// Greatest speed, rad/s or m/s; `None` is unlimited.
    pub speed: Option<f64>,
}

impl TargetLimits {
    /// No limits.
    pub const NONE: Self = Self { range: None, speed: None };

    /// Those of the movable joints of `character`, in their order, which is that of a model's joints. A joint without an
    /// actuator has none: nothing drives it to its target.
    pub fn of(character: &Character) -> Vec<Self> {
        let joints = character.links.iter().filter_map(|link| link.joint.as_ref());
        joints.filter(|joint| joint.kind != JointKind::Fixed).map(Self::of_joint).collect()
    }

    fn of_joint(joint: &Joint) -> Self {
        if !joint.driven {
            return Self::NONE;
        }
        Self {
            range: joint.limits.map(|range| [range.lower, range.upper]),
            speed: joint.velocity.filter(|speed| *speed > 0.0),
        }
    }

    /// Whether the spline from one value and rate to another over `duration` seconds is within the limits, but for
    /// `slack`: rad or m and their rates, relative above 1.
    pub fn hold(&self, from: (f64, f64), to: (f64, f64), duration: f64, slack: f64) -> bool {
        let room = |limit: f64| slack * limit.abs().max(1.0);
        let in_range = self.range.is_none_or(|[lower, upper]| {
            let (least, greatest) = hermite_range(from, to, duration);
            least >= lower - room(lower) && greatest <= upper + room(upper)
        });
        in_range
            && self.speed.is_none_or(|most| {
                let (least, greatest) = hermite_rate_range(from, to, duration);
                greatest.max(-least) <= most + room(most)
            })
    }
}

/// Angle and rate of a joint at a keyframe.
type Knot = (f64, f64);
/// The extreme of a spline from one knot to another over some seconds, and how far it is beyond a limit.
type Extreme<'a> = dyn Fn(Knot, Knot, f64) -> (f64, f64) + 'a;

/// Adds to `faults` where the splines between `keyframes`, which stand at `place` of the document, break the limits of
/// the document's joint number `index`, called `name`: of each limit the worst place.
pub(super) fn limit_faults(
    place: &str,
    keyframes: &[Keyframe],
    (index, name): (usize, &str),
    limits: &TargetLimits,
    faults: &mut Vec<Fault>,
) {
    let segments = || {
        keyframes.windows(2).enumerate().map(|(number, pair)| {
            let [from, to] = [&pair[0], &pair[1]].map(|end| (end.angles[index], end.velocities[index]));
            (number, from, to, pair[1].time - pair[0].time)
        })
    };
    // Gives the extreme that is farthest beyond, with the number of the keyframe at or after which it is: the first of
    // several as far.
    let worst = |extreme: &Extreme<'_>, end: fn(Knot) -> f64| {
        segments().fold(None, |worst: Option<(usize, f64, f64)>, (number, from, to, duration)| {
            let (value, beyond) = extreme(from, to, duration);
            let number = if value == end(to) { number + 1 } else { number };
            let farther = beyond > worst.map_or(0.0, |(_, _, least)| least);
            if farther { Some((number, value, beyond)) } else { worst }
        })
    };
    if let Some([lower, upper]) = limits.range {
        let room = ROUNDING * lower.abs().max(upper.abs()).max(1.0);
        let outside = |from, to, duration| {
            let (least, greatest) = hermite_range(from, to, duration);
            let (below, above) = (lower - least, greatest - upper);
            if below > above { (least, below - room) } else { (greatest, above - room) }
        };
        if let Some((number, value, _)) = worst(&outside, |(angle, _)| angle) {
            let reason = format!(
                "the joint \"{name}\" is asked to go to {value} here or before the next keyframe; its range is \
                 {lower} to {upper}"
            );
            faults.push(Fault::new(format!("{place}/{number}/angles/{index}"), reason));
        }
    }
    if let Some(most) = limits.speed {
        let too_fast = |from, to, duration| {
            let (least, greatest) = hermite_rate_range(from, to, duration);
            let rate = if greatest > -least { greatest } else { least };
            (rate, rate.abs() - most - ROUNDING * most.max(1.0))
        };
        if let Some((number, rate, _)) = worst(&too_fast, |(_, rate)| rate) {
            let reason = format!(
                "the joint \"{name}\" is asked to move at {rate} a second here or before the next keyframe; its \
                 greatest speed is {most}"
            );
            faults.push(Fault::new(format!("{place}/{number}/velocities/{index}"), reason));
        }
    }
}
