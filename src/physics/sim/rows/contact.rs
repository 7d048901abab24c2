//! Rows of contacts.
//!
//! For a contact candidate at point p with unit normal n, where v_p is the velocity of the body there relative to
//! the other side: w_n = n · v_p⁺ + bias ≥ 0, λ_n ≥ 0, w_n λ_n = 0 (Tokizaki & Hasegawa eq. 16). The bias is
//! that of the gap. A contact that would close within the step and has a speed of rebound u instead asks for
//! n · v_p⁺ ≥ u, Newton's law of restitution (Moreau 1988 for its place in time stepping), as far as the impact then
//! returns no more energy than its restitution (see `sim/restitution.rs`). Coulomb
//! friction adds two rows along tangents t: w_t = t · v_p⁺ and |λ_t| ≤ μ λ_n, the force opposing the sliding (Anitescu & Potra
//! 1997 for the pyramid; the circular cone projects both tangents together).

use std::ops::Range;

use super::assembly::{Row, Rows};
use super::owner::RowOwner;
use super::stabilization::{Recovery, gap_bias, gap_recovery};
use crate::model::wide::Lanes;
use crate::sim::contact::ContactCandidate;
use crate::sim::lcp::Bound;
use crate::sim::memory::ContactForces;
use crate::sim::per_body::Motions;
use crate::sim::spatial::SpatialForce;

/// Compliance of contacts in the feedforward pass, as a share of the whole character's mobility.
///
/// A rigid character on four feet has twelve contact forces for six degrees of freedom: many distributions solve its
/// equations, and a solver would find one that depends on its warm start. With compliance the distribution is unique,
/// and the sum of the forces is less by no more than a hundredth.
const COMPLIANCE: f64 = 1e-2;

/// The compliance of contacts in the feedforward pass, for a character of `mass` kg and a step of `step` seconds,
/// (m/s)/N.
pub fn compliance(mass: f64, step: f64) -> f64 {
    COMPLIANCE * step / mass
}

/// Adds the rows of all `candidates`.
///
/// `free` is each body's velocity if no row acted; `warm_start` holds the forces to start from, by slot; `compliance`
/// is that of ground and obstacles, (m/s)/N; `half_solve` half-solves the rows of forces on a candidate's body
/// (see [`Rows::push`]).
#[allow(clippy::too_many_arguments)] // the ingredients of eq. 27, each from another stage
#[inline(always)] // compiled for the processor of `step`
pub fn add(
    rows: &mut Rows,
    candidates: &[ContactCandidate],
    free: &Motions,
    friction: Option<f64>,
    step: f64,
    recovery: Recovery,
    warm_start: &ContactForces,
    compliance: f64,
    mut half_solve: impl FnMut(&ContactCandidate, &[SpatialForce], &mut Vec<Lanes>) -> Range<usize>,
) {
    for candidate in candidates {
        let owner = RowOwner::Contact { link: candidate.link };
        let velocity = candidate.slip(|body| free.at(body));
        let softness = if candidate.against.body().is_none() { compliance } else { 0.0 };
        let remembered = warm_start.at(candidate.slot);
        let normal = rows.len();
        let [up, tangents @ ..] = candidate.frame;
        let free = up.dot(&velocity);
        let gap = -candidate.depth;
        let mut bias = gap_bias(gap, step);
        if gap + step * free < 0.0 && candidate.rebound > 0.0 {
            bias = bias.min(-candidate.rebound);
            rows.rebound_next(free, candidate.rebound);
        }
        let recovery = gap_recovery(gap, step, recovery.translation);
        let warm_start = remembered[0];
        let above =
            Row { warm_start, recovery, softness, ..Row::new(owner, Bound::NonNegative, free + bias) };
        let push = SpatialForce::at(candidate.at, up);
        if friction.is_none() {
            rows.push([above], |numbers| half_solve(candidate, &[push], numbers));
            continue;
        }
        let bound = Bound::Friction { normal, coefficient: candidate.material.friction };
        let [first, second] = std::array::from_fn(|index| Row {
            warm_start: remembered[index + 1],
            softness,
            ..Row::new(owner, bound, tangents[index].dot(&velocity))
        });
        let [along, across] = tangents.map(|tangent| SpatialForce::at(candidate.at, tangent));
        rows.push([above, first, second], |numbers| half_solve(candidate, &[push, along, across], numbers));
    }
}

/// Number of rows of a contact.
pub fn rows_per_contact(friction: Option<f64>) -> usize {
    if friction.is_some() { 3 } else { 1 }
}
