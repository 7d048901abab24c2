//! Rows of dry friction in joints: w = q̇⁺, |λ| ≤ friction, the force opposing the motion.

use std::ops::Range;

use super::assembly::{Row, Rows};
use super::owner::RowOwner;
use crate::model::wide::Lanes;
use crate::sim::lcp::Bound;

/// Adds a row for every joint with dry friction (N m or N) that `has_row`.
///
/// `free` are the joint velocities if no row acted, `warm_start` the last step's forces; `half_solve` half-solves
/// the row of a force along a joint (see [`Rows::push`]).
pub fn add(
    rows: &mut Rows,
    friction: &[f64],
    has_row: impl Fn(usize) -> bool,
    free: &[f64],
    warm_start: &[f64],
    mut half_solve: impl FnMut(usize, &mut Vec<Lanes>) -> Range<usize>,
) {
    let rubbing = friction.iter().copied().enumerate().filter(|(_, friction)| *friction > 0.0);
    for (joint, friction) in rubbing.filter(|(joint, _)| has_row(*joint)) {
        let bound = Bound::Box { lower: -friction, upper: friction };
        let owner = RowOwner::DryFriction(joint);
        let row = Row { warm_start: warm_start[joint], ..Row::new(owner, bound, free[joint]) };
        rows.push([row], |numbers| half_solve(joint, numbers));
    }
}
