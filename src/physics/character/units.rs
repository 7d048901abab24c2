//! Signs that numbers are in other units than metres and radians. They are kept as given, and told.

use std::f64::consts::PI;

use nalgebra::Matrix3;

use super::draft::{At, Diagnostics, DraftJoint};
use super::{About, Inertial, JointKind, Link, NoteKind, Placed, Shape};

/// A range with an end beyond this, two turns, is hardly one of radians.
const MOST_RADIANS: f64 = 4.0 * PI;
/// Nor is a range with an end beyond this one of degrees: it stands for no limit.
const MOST_DEGREES: f64 = 360.0;
/// A shape that reaches so many times as far as the radius of gyration of its link is told. A solid ball reaches 1.6 times as far, a rod
/// 1.7 times, a light arm with a heavy motor farther; millimetres in place of metres are a factor of a thousand.
const TOO_FAR: f64 = 60.0;

/// Tells a revolute joint whose range looks like degrees.
pub fn tell_degrees(joint: &DraftJoint, diagnostics: &mut Diagnostics) {
    let Some(At { value: [lower, upper], place }) = &joint.limits else { return };
    let end = lower.abs().max(upper.abs());
    if joint.kind == JointKind::Revolute && end > MOST_RADIANS && end <= MOST_DEGREES {
        let message = format!("has a range of {lower} to {upper} rad, kept as given; are these degrees?");
        let about = About::Joint(joint.name.value.clone());
        diagnostics.note(place.as_str(), about, NoteKind::Kept, message);
    }
}

/// Tells links whose shapes are much larger than their inertia says; `places` are those of the links.
pub fn tell_millimetres(links: &[Link], places: &[String], diagnostics: &mut Diagnostics) {
    for (link, place) in links.iter().zip(places) {
        let Some(inertial) = &link.inertial else { continue };
        let (reach, gyration) = (reach(link, inertial), radius_of_gyration(inertial));
        if gyration > 0.0 && reach > TOO_FAR * gyration {
            let message = format!(
                "has collision shapes that reach {reach:.3} m from its centre of mass, {:.0} times as far as its inertia says; both \
                 are kept as given. Is a mesh in millimetres (`scale`), or the inertia too small?",
                reach / gyration
            );
            diagnostics.note(place.as_str(), About::Link(link.name.clone()), NoteKind::Kept, message);
        }
    }
}

/// Distance from the centre of mass to the farthest point of a ball about any collision shape, m.
fn reach(link: &Link, inertial: &Inertial) -> f64 {
    let far = |placed: &Placed| {
        let away = placed.pose.translation.vector - inertial.center_of_mass.coords;
        away.norm() + circumradius(&placed.shape)
    };
    link.collisions.iter().map(far).fold(0.0, f64::max)
}

/// Radius of a ball about the origin of `shape` that holds it, m.
fn circumradius(shape: &Shape) -> f64 {
    match shape {
        Shape::Sphere { radius } => *radius,
        Shape::Box { half_extents } => half_extents.norm(),
        Shape::Cylinder { radius, half_length } => radius.hypot(*half_length),
        Shape::Capsule { radius, half_length } => radius + half_length,
        Shape::Hull { vertices, .. } => {
            vertices.iter().map(|vertex| vertex.coords.norm()).fold(0.0, f64::max)
        }
    }
}

/// About the axis of the greatest inertia, m; 0 for a point.
fn radius_of_gyration(inertial: &Inertial) -> f64 {
    let greatest = |inertia: &Matrix3<f64>| inertia.symmetric_eigenvalues().max();
    if inertial.mass > 0.0 { (greatest(&inertial.inertia).max(0.0) / inertial.mass).sqrt() } else { 0.0 }
}
