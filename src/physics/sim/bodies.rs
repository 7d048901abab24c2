//! The bodies of a character at one moment, whatever the coordinates.

use nalgebra::{Matrix3, Vector3};

use super::spatial::{RigidInertia, SpatialMotion};

/// Pose, velocity and inertia of a body, along the world axes about the common point (the origin of
/// the root link).
#[derive(Debug, Clone, Copy)]
pub struct BodyMotion {
    /// Orientation: from the body's to the world's axes.
    pub rotation: Matrix3<f64>,
    /// Origin of the body frame relative to the common point, m.
    pub origin: Vector3<f64>,
    /// S of the body's joint: velocity per unit of joint rate, about the common point; zero for the root.
    pub motion_subspace: SpatialMotion,
    /// Velocity, about the common point.
    pub velocity: SpatialMotion,
    /// Centre of mass relative to the common point, m.
    pub center: Vector3<f64>,
    /// Inertia about the common point.
    pub inertia: RigidInertia,
}

impl BodyMotion {
    /// A body at the common point, at rest.
    pub const REST: Self = Self {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        origin: Vector3::new(0.0, 0.0, 0.0),
        motion_subspace: SpatialMotion::ZERO,
        velocity: SpatialMotion::ZERO,
        center: Vector3::new(0.0, 0.0, 0.0),
        inertia: RigidInertia::ZERO,
    };

    /// A point given in the body frame, relative to the common point, m.
    #[inline]
    pub fn point(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.rotation * local
    }
}
