//! Rows of the trunk's rotation lock: ω⁺ = 0 of the root, three rows e (Tokizaki & Hasegawa section 3.4).

use std::ops::Range;

use nalgebra::Vector3;

use super::assembly::{Row, Rows};
use super::owner::RowOwner;
use crate::model::wide::Lanes;
use crate::sim::lcp::Bound;
use crate::sim::spatial::{SpatialForce, SpatialMotion};

/// Adds the three rows; `free` is the root's velocity if no row acted, and `half_solve` half-solves
/// the row of a wrench on the root (see [`Rows::push`]).
pub fn add(
    rows: &mut Rows,
    free: SpatialMotion,
    mut half_solve: impl FnMut(SpatialForce, &mut Vec<Lanes>) -> Range<usize>,
) {
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        let offset = axis.dot(&free.angular);
        let row = Row::new(RowOwner::TrunkLock, Bound::Free, offset);
        rows.push([row], |numbers| {
            half_solve(SpatialForce { moment: axis, force: Vector3::zeros() }, numbers)
        });
    }
}
