//! From new velocities to new positions.

use nalgebra::{UnitQuaternion, Vector3};

use super::state::State;

/// Moves all positions along the present velocities for `step` seconds (Tokizaki & Hasegawa eq. 9);
/// the orientation by the exponential map, so that it stays a rotation.
pub fn advance(state: &mut State, step: f64) {
    let root = &mut state.root;
    root.position += root.linear_velocity * step;
    let turn: Vector3<f64> = root.angular_velocity * step;
    root.orientation = UnitQuaternion::from_scaled_axis(turn) * root.orientation;
    root.orientation.renormalize_fast();
    for (angle, rate) in state.angles.iter_mut().zip(&state.velocities) {
        *angle += rate * step;
    }
    state.time += step;
}
