//! Rows of contacts with the ground.
//!
//! For a touch at point p of a body with unit normal n: w_n = n · v_p⁺ + bias ≥ 0, λ_n ≥ 0,
//! w_n λ_n = 0 (Tokizaki & Hasegawa eq. 16), with the bias of the gap. Coulomb friction adds two rows
//! along tangents t: w_t = t · v_p⁺ and |λ_t| ≤ μ λ_n, the force opposing the sliding (Anitescu & Potra
//! 1997 for the pyramid; the circular cone projects both tangents together).

use nalgebra::Vector3;

use super::{Owner, Rows, gap_bias};
use crate::sim::contact::Touch;
use crate::sim::lcp::Bound;
use crate::sim::spatial::{Force, Motion};

/// Normal and tangents of a horizontal plane.
pub const FRAME: [Vector3<f64>; 3] =
    [Vector3::new(0.0, 0.0, 1.0), Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0)];

/// Greatest speed at which a penetrating contact is pushed apart, m/s.
const FASTEST_RECOVERY: f64 = 0.2;

/// Adds the rows of all `touches`.
///
/// `free` gives each body's velocity if no row acted; `guess` the last step's forces by slot;
/// `half_solve` fills the half-solved row of a force on a body.
#[allow(clippy::too_many_arguments)] // the ingredients of eq. 27, each from another stage
pub fn add(
    rows: &mut Rows,
    touches: &[Touch],
    free: &[Motion],
    friction: Option<f64>,
    step: f64,
    stabilization: bool,
    guess: &[[f64; 3]],
    mut half_solve: impl FnMut(usize, Force, &mut [f64]),
) {
    for touch in touches {
        let owner = Owner::Contact { link: touch.link };
        let velocity = free[touch.body].at(touch.at);
        let remembered = guess[touch.slot];
        let normal = rows.len();
        let bias = gap_bias(-touch.depth, step, stabilization, FASTEST_RECOVERY);
        let half = rows.push(owner, Bound::NonNegative, FRAME[0].dot(&velocity) + bias, 0.0, remembered[0]);
        half_solve(touch.body, Force::at(touch.at, FRAME[0]), half);
        let Some(coefficient) = friction else { continue };
        for (tangent, remembered) in FRAME.iter().zip(remembered).skip(1) {
            let bound = Bound::Friction { normal, coefficient };
            let half = rows.push(owner, bound, tangent.dot(&velocity), 0.0, remembered);
            half_solve(touch.body, Force::at(touch.at, *tangent), half);
        }
    }
}

/// Number of rows of a touch.
pub fn rows_per_touch(friction: Option<f64>) -> usize {
    if friction.is_some() { 3 } else { 1 }
}
