//! Displacement of a body by a step.

use nalgebra::{Rotation3, Vector3};

use crate::sim::bodies::BodyMotion;
use crate::sim::spatial::SpatialMotion;

/// Penetration that a step may cause without the point becoming a candidate, in lengths ℓ of the character
/// ([`Model::size`](crate::model::Model::size)).
pub(super) const PENETRATION_ALLOWED: f64 = 8e-5;

/// The displacement of a body by a step at constant velocity.
pub(super) struct BodyDisplacement {
    /// Its origin at the beginning, relative to the common point, m.
    pub(super) origin: Vector3<f64>,
    /// Displacement of the origin, m.
    pub(super) shift: Vector3<f64>,
    pub(super) rotation: Rotation3<f64>,
}

impl BodyDisplacement {
    /// For `step` seconds of the velocity `new`.
    pub(super) fn new(body: &BodyMotion, new: SpatialMotion, step: f64) -> Self {
        let shift = new.at(body.origin) * step;
        Self { origin: body.origin, shift, rotation: Rotation3::new(new.angular * step) }
    }

    /// Place after the step of the body's point at `at`, m.
    pub(super) fn point(&self, at: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.shift + self.rotation * (at - self.origin)
    }

    /// Place before the step of the body's point that arrives at `at`, m.
    pub(super) fn point_back(&self, at: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.rotated_back(at - self.origin - self.shift)
    }

    pub(super) fn rotated(&self, direction: Vector3<f64>) -> Vector3<f64> {
        self.rotation * direction
    }

    pub(super) fn rotated_back(&self, direction: Vector3<f64>) -> Vector3<f64> {
        self.rotation.inverse_transform_vector(&direction)
    }
}
