//! How far a link that stands on the ground slides from one pose to the next.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Vector3};

use gaitwright_physics::character::{Link, Shape};

/// Height over the lowest point within which other points take part in carrying a link, m: a flat foot stands on its sole,
/// not on one of its corners.
const SOLE: f64 = 0.001;

/// Points on each rim of a cylinder.
const RIM: u32 = 16;

/// Where a link whose shapes may stand on the ground touches it with the link at `pose`, in the frame of that pose, m: the
/// mean of its low points, the lowest counting most; `None` without shapes.
pub(in crate::export::formats) fn sole(link: &Link, pose: &Isometry3<f64>) -> Option<Point3<f64>> {
    let mut points = Vec::new();
    for placed in &link.collisions {
        let at = pose * placed.pose;
        let down = at.inverse_transform_vector(&-Vector3::z());
        points.extend(low_points(&placed.shape, &down).into_iter().map(|point| at * point));
    }
    let lowest = points.iter().map(|point| point.z).min_by(f64::total_cmp)?;
    let weighed = |point: &Point3<f64>| ((lowest - point.z) / SOLE).exp();
    let weight: f64 = points.iter().map(weighed).sum();
    let sum = points.iter().fold(Vector3::zeros(), |sum, point| sum + point.coords * weighed(point));
    Some(Point3::new(sum.x / weight, sum.y / weight, lowest))
}

/// The points of a shape that may be lowest where `down` is the direction of the ground, both in the shape's frame.
fn low_points(shape: &Shape, down: &Vector3<f64>) -> Vec<Point3<f64>> {
    let ends = |half_length: f64| [-half_length, half_length].map(|z| Vector3::z() * z);
    match shape {
        Shape::Sphere { radius } => vec![Point3::from(*radius * down)],
        Shape::Capsule { radius, half_length } => {
            ends(*half_length).map(|end| Point3::from(end + *radius * down)).to_vec()
        }
        Shape::Box { half_extents } => {
            let side = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            let corner = |corner| Vector3::from_fn(|axis, _| side(corner, axis) * half_extents[axis]);
            (0..8).map(|index| Point3::from(corner(index))).collect()
        }
        Shape::Cylinder { radius, half_length } => {
            let around = (0..RIM).map(|index| TAU * f64::from(index) / f64::from(RIM));
            let rim = around.map(|angle| Vector3::new(angle.cos(), angle.sin(), 0.0) * *radius);
            rim.flat_map(|rim| ends(*half_length).map(|end| Point3::from(end + rim))).collect()
        }
        Shape::Hull { vertices, .. } => vertices.clone(),
    }
}

/// How far the part of a link that touches the ground moves over it from one pose of the link to another, m, in the frame
/// of the poses: the mean of what touches before and of what touches after. A ball that rolls
/// does not slide, up to the cube of the angle between the poses.
pub(super) fn slide(link: &Link, before: &Isometry3<f64>, after: &Isometry3<f64>) -> Vector3<f64> {
    let (Some(from), Some(to)) = (sole(link, before), sole(link, after)) else {
        return Vector3::zeros();
    };
    let moved = after * before.inverse();
    let motion = ((moved * from - from) + (to - moved.inverse() * to)) / 2.0;
    Vector3::new(motion.x, motion.y, 0.0)
}
