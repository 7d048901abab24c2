//! Contact of balls and points with a height field.

use nalgebra::Vector3;

use super::candidate::tangents;
use super::detection::DetectionSettings;
use crate::scene::HeightField;

/// A point is on an edge or a corner of a triangle if it is this near, as a share of the triangle's size.
const RIM: f64 = 1e-9;

/// A place where a ball meets the field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldPoint {
    /// Unit normal and tangents.
    pub frame: [Vector3<f64>; 3],
    /// Distance of the ball from the surface along the normal, m; negative for the depth of penetration.
    pub gap: f64,
}

/// The places where the ball about `center` (in the world) meets `field`, within `settings` for its velocity.
///
/// A ball rests on every triangle that has a point of its inside straight below the centre, along the
/// triangle's normal, and on the edge or corner that is nearest of all. A ball whose centre is below
/// the surface is pushed out along the normal of the triangle above it.
pub fn meet(
    field: &HeightField,
    center: Vector3<f64>,
    radius: f64,
    velocity: Vector3<f64>,
    settings: &DetectionSettings,
    mut add: impl FnMut(FieldPoint),
) {
    let within = radius + settings.margin(velocity.norm());
    let Some(triangle) = field.triangle_at(center.x, center.y) else {
        return rim(field, center, radius, within, &mut add);
    };
    let up = normal(&triangle);
    let above = (center - triangle[0]).dot(&up);
    if above < 0.0 {
        add(field_point(up, above - radius));
        return;
    }
    faces(field, center, radius, within, &mut add);
    rim(field, center, radius, within, &mut add);
}

fn field_point(up: Vector3<f64>, gap: f64) -> FieldPoint {
    let [across, beside] = tangents(up);
    FieldPoint { frame: [up, across, beside], gap }
}

/// Every triangle whose inside has a point nearest to the centre.
fn faces(
    field: &HeightField,
    center: Vector3<f64>,
    radius: f64,
    within: f64,
    add: &mut impl FnMut(FieldPoint),
) {
    field.triangles_near(center.x, center.y, within, |triangle| {
        let up = normal(&triangle);
        let above = (center - triangle[0]).dot(&up);
        if (0.0..=within).contains(&above) && inside(&triangle, center - up * above, up) {
            add(field_point(up, above - radius));
        }
    });
}

/// The nearest edge or corner, if nothing of the field is nearer.
fn rim(
    field: &HeightField,
    center: Vector3<f64>,
    radius: f64,
    within: f64,
    add: &mut impl FnMut(FieldPoint),
) {
    let (mut nearest, mut face) = ((f64::INFINITY, Vector3::zeros(), 0.0), f64::INFINITY);
    field.triangles_near(center.x, center.y, within, |triangle| {
        let up = normal(&triangle);
        let above = (center - triangle[0]).dot(&up);
        if inside(&triangle, center - up * above, up) {
            face = face.min(above.abs());
        }
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let edge = triangle[to] - triangle[from];
            let share = ((center - triangle[from]).dot(&edge) / edge.norm_squared()).clamp(0.0, 1.0);
            let arm = center - triangle[from] - edge * share;
            if arm.norm() < nearest.0 {
                nearest = (arm.norm(), arm, edge.norm());
            }
        }
    });
    let (distance, arm, edge) = nearest;
    // On a flat or hollow edge a face is as near; a point on the edge itself has no direction of its own.
    if distance <= within && distance > RIM * edge && distance < face * (1.0 - RIM) && arm.z > 0.0 {
        add(field_point(arm / distance, distance - radius));
    }
}

/// Upward unit normal of a triangle.
fn normal(triangle: &[Vector3<f64>; 3]) -> Vector3<f64> {
    (triangle[1] - triangle[0]).cross(&(triangle[2] - triangle[0])).normalize()
}

/// Whether `point`, in the plane of `triangle` with normal `up`, is within it, rim included.
fn inside(triangle: &[Vector3<f64>; 3], point: Vector3<f64>, up: Vector3<f64>) -> bool {
    [(0, 1), (1, 2), (2, 0)].into_iter().all(|(from, to)| {
        let edge = triangle[to] - triangle[from];
        up.cross(&edge).dot(&(point - triangle[from])) >= -RIM * edge.norm_squared()
    })
}
