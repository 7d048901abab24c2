//! Bodies that look and weigh the same however far they have spun about an axis: balls, wheels, rollers.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::body::{Body, DofKind, LinkPlace, LoopJoint};
use crate::character::{Character, Friction, Link, Shape};

/// Differences of this share of a length or of an inertia count as rounding.
const ROUNDING: f64 = 1e-6;

/// Which rotation of a body changes neither where its mass nor where its surface is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Spin {
    /// None.
    None,
    /// That about an axis through its origin, of unit length, in the body frame.
    About(Vector3<f64>),
    /// Any about its origin.
    Any,
}

/// The spin of every body. Of the root it counts only if nothing is joined to it, of other bodies only about their own joint and
/// if they carry nothing: the rotation that is left is their parent's.
pub fn spins(character: &Character, links: &[LinkPlace], bodies: &[Body], loops: &[LoopJoint]) -> Vec<Spin> {
    let carries = |index: usize| bodies.iter().skip(1).any(|body| body.parent == index);
    let looped = |index: usize| loops.iter().any(|closing| closing.bodies.contains(&index));
    let symmetric = |index: usize, axis: Vector3<f64>| {
        let mut own = character.links.iter().zip(links).filter(|(_, place)| place.body == index);
        is_about(&bodies[index], axis) && own.all(|(link, place)| is_alike(link, &place.pose, axis))
    };
    let spin = |index: usize| {
        let body = &bodies[index];
        if carries(index) || looped(index) {
            Spin::None
        } else if index > 0 {
            let about_joint = body.dof == DofKind::Revolute && symmetric(index, body.axis);
            if about_joint { Spin::About(body.axis) } else { Spin::None }
        } else if [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().all(|axis| symmetric(0, axis)) {
            Spin::Any
        } else {
            let eigen = body.inertia.symmetric_eigen();
            let axes = eigen.eigenvectors.column_iter().map(|axis| axis.into_owned());
            axes.into_iter().find(|axis| symmetric(0, *axis)).map_or(Spin::None, Spin::About)
        }
    };
    (0..bodies.len()).map(spin).collect()
}

/// Whether the mass of `body` is symmetric about `axis` through its origin.
fn is_about(body: &Body, axis: Vector3<f64>) -> bool {
    let off = body.center - axis * axis.dot(&body.center);
    let along = axis.dot(&(body.inertia * axis));
    let across = 0.5 * (body.inertia.trace() - along);
    let round = Matrix3::identity() * across + axis * axis.transpose() * (along - across);
    let moment = body.inertia.trace();
    body.mass * off.norm_squared() <= ROUNDING * ROUNDING * moment
        && (body.inertia - round).amax() <= ROUNDING * moment
}

/// Whether the surface of `link` at `pose` in the body frame is the same, and as slippery, however far it is turned about `axis` through
/// the body's origin.
fn is_alike(link: &Link, pose: &Isometry3<f64>, axis: Vector3<f64>) -> bool {
    let slides_alike = match &link.surface.friction {
        Some(Friction::Directional { axis: own, .. }) => is_along(pose.rotation * own.into_inner(), axis),
        Some(Friction::Uniform(_)) | None => true,
    };
    slides_alike && link.collisions.iter().all(|placed| is_round(&placed.shape, &(pose * placed.pose), axis))
}

/// Whether two unit vectors lie on one line.
fn is_along(own: Vector3<f64>, axis: Vector3<f64>) -> bool {
    own.cross(&axis).norm() <= ROUNDING
}

/// Whether `shape` at `pose` in the body frame is one of revolution about `axis` through the body's origin.
fn is_round(shape: &Shape, pose: &Isometry3<f64>, axis: Vector3<f64>) -> bool {
    let at = pose.translation.vector;
    let off = (at - axis * axis.dot(&at)).norm();
    match shape {
        Shape::Sphere { radius } => off <= ROUNDING * radius,
        Shape::Cylinder { radius, .. } | Shape::Capsule { radius, .. } => {
            off <= ROUNDING * radius && is_along(pose.rotation * Vector3::z(), axis)
        }
        Shape::Box { .. } | Shape::Hull { .. } => false,
    }
}
