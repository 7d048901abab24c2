//! Rows of joint limits.
//!
//! At the lower end of a range w = q̇⁺ + bias ≥ 0, λ ≥ 0, w λ = 0, at the upper end the same for
//! −q̇⁺ (rows c, Tokizaki & Hasegawa eq. 16), with the bias of the angle that is left: a joint may reach
//! its limit within the step but not pass it.

use std::ops::Range;

use super::assembly::{Row, Rows};
use super::owner::RowOwner;
use super::stabilization::{gap_bias, gap_recovery};
use crate::model::wide::Lanes;
use crate::sim::lcp::Bound;

/// A limit has a row when the joint is within this many steps of it at the velocity it has if no row acts.
const STEPS_AHEAD: f64 = 2.0;

/// Which ends of `limit`, lower and upper, a joint at `angle` comes near within a step of `step` seconds, or is
/// beyond, when its velocity is `free` if no row acts.
#[inline]
pub fn near([lower, upper]: [f64; 2], angle: f64, free: f64, step: f64) -> [bool; 2] {
    let reach = STEPS_AHEAD * step * free;
    [angle - lower <= (-reach).max(0.0), upper - angle <= reach.max(0.0)]
}

/// Adds a row for every end of a joint's range that is `near`, lower and upper.
///
/// `angles` are those at the beginning of the step, `free` the joint velocities if no row acted,
/// `recovery` gives the greatest speed at which a joint is brought back, rad/s or m/s; `warm_start` the last step's forces; `half_solve` half-solves the row of a force along a joint
/// (see [`Rows::push`]); its sign is changed here for an upper limit.
#[allow(clippy::too_many_arguments)] // the ingredients of eq. 27, each from another stage
pub fn add(
    rows: &mut Rows,
    limits: &[[f64; 2]],
    near: &[[bool; 2]],
    angles: &[f64],
    free: &[f64],
    step: f64,
    recovery: impl Fn(usize) -> f64,
    warm_start: &[f64],
    mut half_solve: impl FnMut(usize, &mut Vec<Lanes>) -> Range<usize>,
) {
    for (joint, ([lower, upper], near)) in limits.iter().zip(near).enumerate() {
        if *near == [false; 2] {
            continue;
        }
        let ends = [
            (RowOwner::LowerLimit(joint), 1.0, angles[joint] - lower),
            (RowOwner::UpperLimit(joint), -1.0, upper - angles[joint]),
        ];
        for ((owner, sign, gap), near) in ends.into_iter().zip(*near) {
            if !near {
                continue;
            }
            let offset = sign * free[joint] + gap_bias(gap, step);
            let warm_start = (sign * warm_start[joint]).max(0.0);
            let recovery = gap_recovery(gap, step, recovery(joint));
            let row = Row { warm_start, recovery, ..Row::new(owner, Bound::NonNegative, offset) };
            rows.push([row], |numbers| {
                let start = numbers.len();
                let places = half_solve(joint, numbers);
                if sign < 0.0 {
                    numbers[start..].iter_mut().for_each(|lanes| *lanes = lanes.map(|number| -number));
                }
                places
            });
        }
    }
}
