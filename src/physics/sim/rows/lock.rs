//! Rows of the trunk's rotation lock: ω⁺ = 0 of the root, three rows e (Tokizaki & Hasegawa section 3.4).

use std::ops::Range;

use nalgebra::Vector3;

use super::assembly::{Row, Rows};
use super::lanes::Lanes;
use super::owner::Owner;
use crate::sim::lcp::Bound;
use crate::sim::spatial::{Force, Motion};

/// Adds the three rows; `free` is the root's velocity if no row acted, and `half_solve` half-solves
/// the row of a wrench on the root (see [`Rows::push`]).
pub fn add(
    rows: &mut Rows,
    free: Motion,
    mut half_solve: impl FnMut(Force, &mut Vec<Lanes>) -> Range<usize>,
) {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let offset = axis.dot(&free.angular);
        let row = Row::new(Owner::TrunkLock, Bound::Free, offset);
        rows.push([row], |numbers| half_solve(Force { moment: axis, force: Vector3::zeros() }, numbers));
    }
}
