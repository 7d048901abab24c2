//! Rows of joint limits.
//!
//! At the lower end of a range w = q̇⁺ + bias ≥ 0, λ ≥ 0, w λ = 0, at the upper end the same for
//! −q̇⁺ (rows c, Tokizaki & Hasegawa eq. 16), with the bias of the angle that is left: a joint may reach
//! its limit within the step but not pass it.

use super::{Owner, Rows, gap_bias};
use crate::sim::lcp::Bound;

/// Greatest speed at which a violated limit is corrected, rad/s or m/s.
const FASTEST_RECOVERY: f64 = 1.0;

/// A limit has a row when the joint is within this many steps of it at its present speed ...
const STEPS_AHEAD: f64 = 3.0;

/// ... or within this angle, rad or m, so that a push from elsewhere in the same step cannot pass it.
const NEARBY: f64 = 0.02;

/// Adds a row for every limit that the joints could reach.
///
/// `angles` are those at the beginning of the step, `free` the joint velocities if no row acted,
/// `guess` the last step's forces; `half_solve` fills the half-solved row of a force along a joint,
/// which is turned round here for an upper limit.
#[allow(clippy::too_many_arguments)] // the ingredients of eq. 27, each from another stage
pub fn add(
    rows: &mut Rows,
    limits: &[Option<[f64; 2]>],
    angles: &[f64],
    free: &[f64],
    step: f64,
    stabilization: bool,
    guess: &[f64],
    mut half_solve: impl FnMut(usize, &mut [f64]),
) {
    for (joint, limit) in limits.iter().enumerate() {
        let Some([lower, upper]) = *limit else { continue };
        let ends = [
            (Owner::LowerLimit(joint), 1.0, angles[joint] - lower),
            (Owner::UpperLimit(joint), -1.0, upper - angles[joint]),
        ];
        for (owner, sign, gap) in ends {
            if gap > NEARBY + STEPS_AHEAD * step * free[joint].abs() {
                continue;
            }
            let bias = gap_bias(gap, step, stabilization, FASTEST_RECOVERY);
            let offset = sign * free[joint] + bias;
            let remembered = (sign * guess[joint]).max(0.0);
            let half = rows.push(owner, Bound::NonNegative, offset, 0.0, remembered);
            half_solve(joint, half);
            if sign < 0.0 {
                half.iter_mut().for_each(|entry| *entry = -*entry);
            }
        }
    }
}
