//! The direction in which a motion is to go.

use nalgebra::Vector3;

/// `direction` (world frame) without its height and of unit length; along x where nothing is left of it.
pub fn ahead([x, y, _]: [f64; 3]) -> Vector3<f64> {
    let length = x.hypot(y);
    if length.is_normal() { Vector3::new(x / length, y / length, 0.0) } else { Vector3::x() }
}

/// The same in the plane.
pub fn ahead_in_plane(direction: [f64; 3]) -> [f64; 2] {
    let ahead = ahead(direction);
    [ahead.x, ahead.y]
}
