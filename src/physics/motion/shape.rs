//! Splines that leave a joint's range of motion or exceed its speed, brought back within.
//!
//! Between two knots the target is the cubic Hermite spline of [`super::hermite`]. Knots keep their angles, and as each
//! has one rate for the spline before and the spline after it, the target stays continuous with its rate. What gives way
//! is the rates: as for the monotone splines of Fritsch & Carlson 1980 ("Monotone piecewise cubic interpolation", SIAM
//! J. Numer. Anal. 17(2)), they are scaled down until the extremes of every segment, which are known in closed form, are
//! within the limits. A segment between knots at rest has its extremes at its ends and the greatest speed 1.5 |Δq| / T.
//! Where that exceeds the limit, the knots are too far apart for the time, and the whole motion is played more slowly.

use super::limits::TargetLimits;

/// What counts as rounding in a comparison with a limit: rad, m and their rates, relative above 1. It is far below what
/// documents may have, so that a shaped motion is one that may be played.
const ROUNDING: f64 = 1e-12;

/// How often all segments are looked at before rates that still have to give way are set to 0. Each knot belongs to
/// two segments, so that what one of them needs may break the other.
const ROUNDS: usize = 32;

/// Halvings in the search for the greatest share of a rate that can stay.
const HALVINGS: usize = 40;

/// Angle (rad or m) and rate (a second) of a joint at a knot.
type Knot = (f64, f64);

/// Shapes a motion from rest at the angles `start` through `postures`, `transition_time` seconds apart, of which those
/// from number `cycle` on are visited over and over, so that no joint's target leaves its range or exceeds its speed
/// in `limits`. Returns the transition time that goes with the new rates: the same, or a longer one where the angles are
/// too far apart for the speed.
///
/// A posture is a pair of angles and rates, one a joint like `start` and `limits`. Angles outside of the range are moved
/// to its end; all others stay. What breaks no limit stays bit for bit as it was.
pub fn shape(
    start: &[f64],
    postures: &mut [(&mut [f64], &mut [f64])],
    cycle: usize,
    transition_time: f64,
    limits: &[TargetLimits],
) -> f64 {
    let mut columns: Vec<Vec<Knot>> = (0..start.len().min(limits.len()))
        .map(|joint| {
            let rest = (start[joint], 0.0);
            let visited = postures.iter().map(|(angles, rates)| (angles[joint], rates[joint]));
            std::iter::once(rest).chain(visited).map(|knot| clamped(knot, &limits[joint])).collect()
        })
        .collect();
    // From each knot to the next, and from the last posture back to the first of the cycle.
    let last = postures.len();
    let segments: Vec<[usize; 2]> =
        (0..last).map(|knot| [knot, knot + 1]).chain((cycle < last).then_some([last, cycle + 1])).collect();
    let asked = columns.clone();
    let mut duration = transition_time;
    loop {
        let needed = columns
            .iter_mut()
            .zip(limits)
            .filter_map(|(knots, limits)| limit(knots, &segments, duration, limits).err())
            .fold(duration, f64::max);
        if needed <= duration {
            break;
        }
        duration = needed;
        // The same path, gone through more slowly.
        let slower = transition_time / duration;
        for (knots, asked) in columns.iter_mut().zip(&asked) {
            for (knot, asked) in knots.iter_mut().zip(asked) {
                *knot = (asked.0, slower * asked.1);
            }
        }
    }
    for (joint, knots) in columns.iter().enumerate() {
        for ((angles, rates), knot) in postures.iter_mut().zip(&knots[1..]) {
            (angles[joint], rates[joint]) = *knot;
        }
    }
    duration
}

fn clamped((angle, rate): Knot, limits: &TargetLimits) -> Knot {
    (limits.range.map_or(angle, |[lower, upper]| angle.max(lower).min(upper)), rate)
}

/// Scales the rates of one joint's knots down until every segment of `duration` seconds is within `limits`.
///
/// # Errors
/// The least duration, s, with which a segment can be, where this one is too short for the joint's speed.
fn limit(
    knots: &mut [Knot],
    segments: &[[usize; 2]],
    duration: f64,
    limits: &TargetLimits,
) -> Result<(), f64> {
    let holds = |from: Knot, to: Knot| limits.hold(from, to, duration, ROUNDING);
    // Rates only ever fall, and between knots at rest nothing is exceeded, so this ends.
    for round in 0.. {
        let mut within = true;
        for &[first, second] in segments {
            let (from, to) = (knots[first], knots[second]);
            if holds(from, to) {
                continue;
            }
            if !holds((from.0, 0.0), (to.0, 0.0)) {
                let speed = limits.speed.unwrap_or(f64::INFINITY);
                return Err(1.5 * (to.0 - from.0).abs() / speed);
            }
            within = false;
            let [one, other] = if round < ROUNDS { eased(from, to, holds) } else { [0.0; 2] };
            // The start of play is at rest, and a cycle of one posture has one rate for both ends.
            if first == second {
                knots[first].1 *= one.min(other);
            } else {
                knots[first].1 *= one;
                knots[second].1 *= other;
            }
        }
        if within {
            break;
        }
    }
    Ok(())
}

/// The shares of both ends' rates with which a segment `holds`: that end gives way alone which loses less, or both
/// where neither can.
fn eased(from: Knot, to: Knot, holds: impl Fn(Knot, Knot) -> bool) -> [f64; 2] {
    let share = |of: [f64; 2]| {
        // The share itself where an end gives way, 1 where it does not.
        let scaled = |share: f64| of.map(|gives| 1.0 - gives * (1.0 - share));
        let holds = |share: f64| {
            let [one, other] = scaled(share);
            holds((from.0, one * from.1), (to.0, other * to.1))
        };
        let (mut least, mut most) = (0.0, 1.0);
        if !holds(least) {
            return None;
        }
        for _ in 0..HALVINGS {
            let middle = 0.5 * (least + most);
            if holds(middle) { least = middle } else { most = middle }
        }
        Some(scaled(least))
    };
    let lost = |[one, other]: [f64; 2]| (1.0 - one) * from.1.abs() + (1.0 - other) * to.1.abs();
    let alone = [share([1.0, 0.0]), share([0.0, 1.0])].into_iter().flatten();
    alone
        .min_by(|one, other| lost(*one).total_cmp(&lost(*other)))
        .or_else(|| share([1.0, 1.0]))
        .unwrap_or([0.0; 2])
}
