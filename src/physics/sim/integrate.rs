//! From velocities to positions.

use nalgebra::UnitQuaternion;

use super::spatial::SpatialMotion;
use super::state::State;

/// Moves all positions for `step` seconds (Tokizaki & Hasegawa eq. 9): the root along `root`, the velocity
/// of its origin and its angular velocity, and the joints along `rates`. The orientation moves by the
/// exponential map, so that it stays a rotation.
pub fn advance(state: &mut State, root: SpatialMotion, rates: &[f64], step: f64) {
    let place = &mut state.root;
    place.position += root.linear * step;
    place.orientation = UnitQuaternion::from_scaled_axis(root.angular * step) * place.orientation;
    place.orientation.renormalize_fast();
    for (angle, rate) in state.angles.iter_mut().zip(rates) {
        *angle += rate * step;
    }
}
