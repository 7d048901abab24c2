//! Rows of contacts.
//!
//! For a touch at point p with unit normal n, where v_p is the velocity of the body there against what it
//! touches: w_n = n · v_p⁺ + bias ≥ 0, λ_n ≥ 0, w_n λ_n = 0 (Tokizaki & Hasegawa eq. 16). The bias is
//! that of the gap. A contact that would close within the step and has a speed of rebound u instead asks for
//! n · v_p⁺ ≥ u, Newton's law of restitution (Moreau 1988 for its place in time stepping). Coulomb
//! friction adds two rows along tangents t: w_t = t · v_p⁺ and |λ_t| ≤ μ λ_n, the force opposing the sliding (Anitescu & Potra
//! 1997 for the pyramid; the circular cone projects both tangents together).

use nalgebra::Vector3;

use super::{Owner, Rows, gap_bias, gap_recovery};
use crate::sim::contact::Touch;
use crate::sim::lcp::Bound;
use crate::sim::spatial::Motion;

/// Greatest speed at which a penetrating contact is pushed apart, m/s.
const FASTEST_RECOVERY: f64 = 0.5;

/// Adds the rows of all `touches`.
///
/// `free` gives each body's velocity if no row acted; `guess` the last step's forces by slot;
/// `half_solve` fills the half-solved row of a unit force at a touch in a direction.
#[allow(clippy::too_many_arguments)] // the ingredients of eq. 27, each from another stage
pub fn add(
    rows: &mut Rows,
    touches: &[Touch],
    free: &[Motion],
    friction: Option<f64>,
    step: f64,
    stabilization: bool,
    guess: &[[f64; 3]],
    mut half_solve: impl FnMut(&Touch, Vector3<f64>, &mut [f64]),
) {
    for touch in touches {
        let owner = Owner::Contact { link: touch.link };
        let velocity = touch.slip(|body| free[body]);
        let remembered = guess[touch.slot];
        let normal = rows.len();
        let [up, tangents @ ..] = touch.frame;
        let free = up.dot(&velocity);
        let gap = -touch.depth;
        let mut bias = gap_bias(gap, step);
        if gap + step * free < 0.0 && touch.rebound > 0.0 {
            bias = bias.min(-touch.rebound);
        }
        let half = rows.push(owner, Bound::NonNegative, free + bias, 0.0, remembered[0]);
        half_solve(touch, up, half);
        if stabilization {
            rows.recover(gap_recovery(gap, step, FASTEST_RECOVERY));
        }
        let Some(coefficient) = friction else { continue };
        for (tangent, remembered) in tangents.into_iter().zip(&remembered[1..]) {
            let bound = Bound::Friction { normal, coefficient };
            let half = rows.push(owner, bound, tangent.dot(&velocity), 0.0, *remembered);
            half_solve(touch, tangent, half);
        }
    }
}

/// Number of rows of a touch.
pub fn rows_per_touch(friction: Option<f64>) -> usize {
    if friction.is_some() { 3 } else { 1 }
}
