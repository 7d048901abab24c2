//! Rows s without bounds: everything along a joint that is linear in its new velocity.
//!
//! A torque λ = β − α q̇⁺ turns into w = q̇⁺ + λ / α − β / α = 0 (Tokizaki & Hasegawa eqs. 19-20, 26-27).
//! That is the drive below its greatest torque; it is viscous damping with α = d, β = 0; and it is the
//! rotor (armature) as well. A rotor of reflected inertia a takes the torque a q̈ from the joint, and as
//! λ = −a (q̇⁺ − q̇) / h that is α = a / h, β = a q̇ / h. Solved for λ and put into the bodies' equations with the
//! row's wrench S on both sides of the joint, it is exactly the term a S Sᵀ that the rotor adds to the mass
//! matrix, of rank one and across two bodies. All three act along the same joint, so that one row with the
//! sums of α and β stands for them.

use std::ops::Range;

use super::assembly::{Row, Rows};
use super::owner::RowOwner;
use crate::model::wide::Lanes;
use crate::sim::lcp::Bound;
use crate::sim::tracking::Spring;

/// Adds the row of joint `joint`, whose torque follows `line`.
///
/// `free` is the joint's velocity if no row acted; `half_solve` half-solves the row of a force
/// along the joint (see [`Rows::push`]).
pub fn add(
    rows: &mut Rows,
    joint: usize,
    line: Spring,
    free: f64,
    half_solve: impl FnOnce(usize, &mut Vec<Lanes>) -> Range<usize>,
) {
    let softness = 1.0 / line.resistance;
    let offset = free - line.at_rest * softness;
    let row = Row { softness, ..Row::new(RowOwner::Drive(joint), Bound::Free, offset) };
    rows.push([row], |numbers| half_solve(joint, numbers));
}

/// Adds the row that gives joint `joint` the velocity `wanted` (rad/s or m/s) whatever it takes: velocity
/// control (Tokizaki & Hasegawa eq. 17). The others as for [`add`].
pub fn prescribe_velocity(
    rows: &mut Rows,
    joint: usize,
    wanted: f64,
    free: f64,
    half_solve: impl FnOnce(usize, &mut Vec<Lanes>) -> Range<usize>,
) {
    let row = Row::new(RowOwner::Drive(joint), Bound::Free, free - wanted);
    rows.push([row], |numbers| half_solve(joint, numbers));
}
