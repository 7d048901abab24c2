//! Vectors and frames of `nalgebra` as those of `parry`, and back.

use nalgebra::{Matrix3, Vector3};
use parry3d::math::{Matrix, Pose, Rotation, Vector};

/// A vector of `nalgebra` as one of `parry`.
#[inline]
pub fn vector(from: Vector3<f64>) -> Vector {
    Vector::new(from.x, from.y, from.z)
}

/// A vector of `parry` as one of `nalgebra`.
#[inline]
pub fn from_vector(from: Vector) -> Vector3<f64> {
    Vector3::new(from.x, from.y, from.z)
}

/// A frame of `nalgebra` as one of `parry`.
pub fn frame(rotation: &Matrix3<f64>, origin: Vector3<f64>) -> Pose {
    let columns = [0, 1, 2].map(|column| vector(rotation.column(column).into()));
    let matrix = Matrix::from_cols(columns[0], columns[1], columns[2]);
    Pose { rotation: Rotation::from_mat3(&matrix), translation: vector(origin) }
}
