//! From z up and x forward to y up and z forward, as glTF has it.

use nalgebra::{Quaternion, UnitQuaternion};

/// The rotation that takes x to z, y to x and z to y.
pub(super) fn y_up() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(0.5, -0.5, -0.5, -0.5))
}
