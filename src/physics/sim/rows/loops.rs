//! Rows of the joints that close loops: rows e like a tree joint's in maximal coordinates, in either
//! coordinates.
//!
//! The rows read the velocities that the bodies have in their old places, V⁺ = V + h (a − D) with the
//! bias acceleration D of a body, that of the tree's joints at constant rates (see `maximal`). A loop joint's two bodies
//! may accelerate relative to each other by S q̈ and by the rotation of S with the first body, V_a × (V_b − V_a)
//! (Featherstone 2008, section 3.5). So its rows require
//!
//! Tᵀ (V_b⁺ − V_a⁺) = h Tᵀ (V_a × (V_b − V_a) − (D_b − D_a)),
//!
//! the bias −h J̇ v; without it the rotation of the loop's axes is left to the next step, as in the paper's form.
//!
//! **Overconstrained loops.** A planar loop moves because its axes are parallel: its rows across the plane constrain
//! nothing. Axes in documents are parallel to a few digits only; such rows then have a very small moment arm, and would
//! lock the loop. In a real mechanism the clearance of the bearings prevents that. So a row whose force hardly changes
//! its own velocity is left out, and the loop may misalign there by as much as its axes are not parallel.

use std::ops::Range;

use super::assembly::Rows;
use super::joint::{self, Coupling};
use super::owner::RowOwner;
use super::stabilization::Recovery;
use crate::model::Model;
use crate::model::wide::Lanes;
use crate::sim::bodies::Bodies;
use crate::sim::per_body::Motions;
use crate::sim::spatial::{SpatialForce, SpatialMotion};

/// A row whose mobility is less than this share of the others of its loop is left out: axes count as
/// parallel within about its square root, rad.
const WEAK: f64 = 1e-6;

/// Adds the rows of all loops of `model`.
///
/// `bodies` are as they move at `rates` before the step, `free` gives each body's velocity if no row acted;
/// `joint_bias` adds the bias. A fifth of what loops are open by is taken back in every `period`, s. Which rows are left out is decided in joint coordinates, where the tree's joints hold
/// exactly: in maximal coordinates `reduced` are the rows of joint coordinates. `half_solve` half-solves the row of a
/// wrench on the first body and its opposite on the second (see [`Rows::push`]).
#[allow(clippy::too_many_arguments)] // the ingredients of eq. 27, each from another stage
pub fn add(
    rows: &mut Rows,
    model: &Model,
    bodies: &Bodies,
    rates: &[f64],
    free: &Motions,
    step: f64,
    joint_bias: bool,
    period: f64,
    recovery: Recovery,
    reduced: Option<&Rows>,
    mut half_solve: impl FnMut([usize; 2], SpatialForce, &mut Vec<Lanes>) -> Range<usize>,
) {
    let begin = rows.len();
    for index in 0..model.loops.len() {
        let first = rows.len();
        let coupling = Coupling::of_loop(model, bodies, index);
        let (child, parent) = (coupling.child, coupling.parent);
        let wanted = if joint_bias {
            let own = bodies.at(parent).velocity.cross_motion(bodies.at(child).velocity);
            let by_tree = bias_acceleration(model, bodies, rates, child)
                .plus(bias_acceleration(model, bodies, rates, parent).scaled(-1.0));
            own.plus(by_tree.scaled(-1.0)).scaled(step)
        } else {
            SpatialMotion::ZERO
        };
        joint::add(
            rows,
            RowOwner::Loop(index),
            &coupling,
            free,
            wanted,
            period,
            recovery,
            |wrench, numbers| half_solve([child, parent], wrench, numbers),
        );
        if reduced.is_none() {
            leave_out_weak(rows, first, coupling.translations(), model.size);
        }
    }
    if let Some(reduced) = reduced {
        let there = of_loops(reduced);
        for row in (begin..rows.len()).filter(|row| reduced.is_disabled(there + row - begin)) {
            rows.disable(row);
        }
    }
}

/// Disables the rows from `first` on whose mobility is next to none, of a loop whose first `shifts` rows are
/// translations. A rotation (1/(kg m²)) is compared with a translation (1/kg) by what it moves at the distance `size`, m.
fn leave_out_weak(rows: &mut Rows, first: usize, shifts: usize, size: f64) {
    let shift = |row: usize| row < first + shifts;
    let mobility = |rows: &Rows, row: usize| rows.mobility(row) * if shift(row) { 1.0 } else { size * size };
    let greatest = |range: Range<usize>| range.map(|row| mobility(rows, row)).fold(0.0, f64::max);
    let of_shifts = greatest(first..first + shifts);
    // Across a plane all rotations are weak: they are compared with translations too.
    let of_any = greatest(first..rows.len());
    for row in first..rows.len() {
        let beside = if shift(row) { of_shifts } else { of_any };
        if mobility(rows, row) < WEAK * beside {
            rows.disable(row);
        }
    }
}

/// The first row of a loop, or the number of rows without one.
fn of_loops(rows: &Rows) -> usize {
    rows.owner.iter().position(|owner| matches!(owner, RowOwner::Loop(_))).unwrap_or(rows.len())
}

/// The wrench that every loop's joint transmits from its first body to its second, about the common point, N m and N: into
/// `forces`, one a loop. The rows of all loops follow each other in `rows`.
pub fn forces(rows: &Rows, model: &Model, bodies: &Bodies, forces: &mut [SpatialForce]) {
    let mut numbers = rows.force[of_loops(rows)..].iter();
    for (index, sum) in forces.iter_mut().enumerate() {
        *sum = SpatialForce::ZERO;
        Coupling::of_loop(model, bodies, index).each(|wrench, _| {
            *sum = numbers.next().map_or(*sum, |number| sum.plus_scaled(wrench, *number));
        });
    }
}

/// D: bias acceleration of `body`, by the rates of the joints between it and the root.
fn bias_acceleration(model: &Model, bodies: &Bodies, rates: &[f64], mut body: usize) -> SpatialMotion {
    let mut sum = SpatialMotion::ZERO;
    while body > 0 {
        let parent = model.bodies[body].parent;
        sum = sum.plus_scaled(
            bodies.at(parent).velocity.cross_motion(bodies.at(body).motion_subspace),
            rates[body - 1],
        );
        body = parent;
    }
    sum
}
