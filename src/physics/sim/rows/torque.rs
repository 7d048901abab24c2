//! Rows of actuators at their greatest torque.
//!
//! An actuator below its limit is a spring and damper inside the mass matrix. One that reaches its
//! limit becomes a boxed row s: λ_s = β − α q̇⁺ with α = D + K h and β = f₀ − K (q − q*) + α v* turns into
//! w = q̇⁺ + λ_s / α − β / α, so that 1/α is added to the row's diagonal entry of A and −β/α to its b
//! (Tokizaki & Hasegawa eqs. 26-27), with |λ_s| ≤ τ_max. A servo, which holds a velocity v, is the limit of infinite α:
//! w = q̇⁺ − v, a row e within a box (eq. 17).

use std::ops::Range;

use super::assembly::{Row, Rows};
use super::owner::RowOwner;
use crate::model::wide::Lanes;
use crate::sim::lcp::Bound;
use crate::sim::tracking::Spring;

/// Adds the row of joint `joint`, whose torque follows `line` between `lower` and `upper` (N m or N).
///
/// `free` is the joint's velocity if no row acted, `warm_start` its last torque; `half_solve` half-solves
/// the row of a force along the joint (see [`Rows::push`]).
pub fn add(
    rows: &mut Rows,
    joint: usize,
    line: Spring,
    [lower, upper]: [f64; 2],
    free: f64,
    warm_start: f64,
    half_solve: impl FnOnce(usize, &mut Vec<Lanes>) -> Range<usize>,
) {
    let bound = Bound::Box { lower, upper };
    let softness = 1.0 / line.resistance;
    let offset = match line.is_servo() {
        true => free - line.at_rest,
        false => free - line.at_rest * softness,
    };
    let row = Row { softness, warm_start, ..Row::new(RowOwner::Torque(joint), bound, offset) };
    rows.push([row], |numbers| half_solve(joint, numbers));
}
