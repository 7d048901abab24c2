//! Bounds on lengths, shapes and axes that every reader and check shares.

use nalgebra::{Unit, Vector3};

use super::Shape;
use super::draft::{At, Diagnostics};

/// Greatest length and distance, m. Volumes and inertias of such shapes are still far from overflow.
pub const LENGTH: f64 = 1e6;

/// Reports a fault at `place` where a component of `lengths`, m, is not finite or beyond [`LENGTH`]; `what` names the
/// quantity.
pub fn check_lengths(lengths: &Vector3<f64>, what: &str, place: &str, diagnostics: &mut Diagnostics) {
    if !lengths.iter().all(|length| length.abs() <= LENGTH) {
        diagnostics.fault(place, format!("{what} must be finite and within {LENGTH:e} m"));
    }
}

/// The field of a shape's document that makes it impossible, and why.
pub fn shape_fault(shape: &Shape) -> Option<(&'static str, String)> {
    let positive = |field: &'static str, name: &str, length: f64| {
        let good = length > 0.0 && length <= LENGTH;
        let reason = || format!("the {name} is {length} m; it must be positive and at most {LENGTH:e} m");
        (!good).then(|| (field, reason()))
    };
    match shape {
        Shape::Sphere { radius } => positive("radius", "radius", *radius),
        Shape::Box { half_extents } => {
            half_extents.iter().find_map(|half| positive("size", "size of the box along an edge", half * 2.0))
        }
        Shape::Cylinder { radius, half_length } => {
            positive("radius", "radius", *radius).or_else(|| positive("length", "length", half_length * 2.0))
        }
        Shape::Capsule { radius, half_length } => positive("radius", "radius", *radius).or_else(|| {
            // A capsule of length 0 is a ball.
            (*half_length != 0.0).then(|| positive("length", "length", half_length * 2.0)).flatten()
        }),
        Shape::Hull { vertices, .. } => {
            let far =
                vertices.iter().flat_map(|vertex| vertex.iter()).any(|x| x.is_nan() || x.abs() > LENGTH);
            far.then(|| ("vertices", format!("every corner must be finite and within {LENGTH:e} m")))
        }
    }
}

/// Reports a fault where `axis` is too short or too long to give a direction.
pub fn check_axis(axis: &At<Vector3<f64>>, diagnostics: &mut Diagnostics) {
    let length = axis.value.norm();
    if !(1e-6..=LENGTH).contains(&length) {
        let reason = if length == 0.0 { "the axis is zero" } else { "the axis must have a length near 1" };
        diagnostics.fault(axis.place.as_str(), reason);
    }
}

/// The direction of an axis whose length has been checked.
pub fn unit(axis: Vector3<f64>) -> Unit<Vector3<f64>> {
    Unit::try_new(axis, 1e-6).unwrap_or(Vector3::x_axis())
}
