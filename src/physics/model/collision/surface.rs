//! Places at which a character can make contact with the ground, as fixed slots of the model.
//!
//! The points of a convex solid that are lowest over a plane are corners (box, hull), points of a ball
//! about a fixed centre (sphere, capsule), or points of a rim (cylinder). Each such place keeps its
//! slot for as long as the model lives, so that contact forces of one step are found by slot in the next, as
//! a warm start.

use std::ops::Range;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::character::{Character, Shape};
use crate::model::body::LinkPlace;

/// Slots of a cylinder: three points of each rim, and three more of each that may be added as it tilts.
pub const CYLINDER_SLOTS: usize = 12;

/// A shape that can make contact with the ground.
#[derive(Debug, Clone)]
pub struct GroundShape {
    /// Index of the character's link.
    pub link: usize,
    /// Index of the body it is part of.
    pub body: usize,
    /// Centre of a bounding sphere of the shape, in the body frame, m.
    pub center: Vector3<f64>,
    /// Radius of that sphere, m.
    pub reach: f64,
    /// How far the shape reaches from there along each axis of the body frame, m.
    pub extent: Vector3<f64>,
    /// Distance of the sphere's farthest point from the body's origin, m.
    pub farthest: f64,
    /// First of the shape's slots.
    pub first_slot: usize,
    /// The shape itself.
    pub surface: Surface,
}

/// Shapes of one body that follow each other.
#[derive(Debug, Clone)]
pub struct GroundBody {
    /// Index of the body.
    pub body: usize,
    /// Indices of the shapes.
    pub shapes: Range<usize>,
    /// Distance of their farthest point from the body's origin, m.
    pub farthest: f64,
}

/// The bodies of `shapes` that can move, in the order of the shapes.
pub(in crate::model) fn ground_bodies(shapes: &[GroundShape], fixed_base: bool) -> Vec<GroundBody> {
    let mut bodies: Vec<GroundBody> = Vec::new();
    for (index, shape) in shapes.iter().enumerate().filter(|(_, shape)| !(fixed_base && shape.body == 0)) {
        match bodies.last_mut() {
            Some(last) if last.body == shape.body => {
                last.shapes.end = index + 1;
                last.farthest = last.farthest.max(shape.farthest);
            }
            _ => bodies.push(GroundBody {
                body: shape.body,
                shapes: index..index + 1,
                farthest: shape.farthest,
            }),
        }
    }
    bodies
}

/// The places of a shape that can make contact with a plane.
#[derive(Debug, Clone)]
pub enum Surface {
    /// Balls about points of [`crate::model::Model::ground_points`]; one slot each.
    Points {
        /// Index of the first point.
        first: usize,
        /// Number of points.
        count: usize,
        /// Radius of the balls, m; 0 for corners.
        radius: f64,
    },
    /// Two rims; [`CYLINDER_SLOTS`] slots.
    Cylinder {
        /// Axis in the body frame, of unit length.
        axis: Vector3<f64>,
        /// A direction across the axis, of unit length.
        across: Vector3<f64>,
        /// m.
        radius: f64,
        /// m.
        half_length: f64,
    },
}

/// The candidates of all collision shapes, their points, and the number of slots.
pub(in crate::model) fn candidates(
    character: &Character,
    links: &[LinkPlace],
) -> (Vec<GroundShape>, Vec<Vector3<f64>>, usize) {
    let mut shapes = Vec::new();
    let mut points: Vec<Vector3<f64>> = Vec::new();
    let mut slots = 0;
    for (index, (link, place)) in character.links.iter().zip(links).enumerate() {
        for placed in &link.collisions {
            let pose = place.pose * placed.pose;
            let surface = surface(&placed.shape, &pose, &mut points);
            let (center, reach) = enclosing_ball(&placed.shape, &pose);
            let first_slot = slots;
            slots += match surface {
                Surface::Points { count, .. } => count,
                Surface::Cylinder { .. } => CYLINDER_SLOTS,
            };
            let (body, farthest) = (place.body, center.norm() + reach);
            let extent = extent(&surface, &points, center, reach);
            shapes.push(GroundShape {
                link: index,
                body,
                center,
                reach,
                extent,
                farthest,
                first_slot,
                surface,
            });
        }
    }
    (shapes, points, slots)
}

fn surface(shape: &Shape, pose: &Isometry3<f64>, points: &mut Vec<Vector3<f64>>) -> Surface {
    let first = points.len();
    let mut add = |point: Point3<f64>| points.push((pose * point).coords);
    let radius = match shape {
        Shape::Sphere { radius } => {
            add(Point3::origin());
            *radius
        }
        Shape::Capsule { radius, half_length } => {
            add(Point3::new(0.0, 0.0, *half_length));
            add(Point3::new(0.0, 0.0, -half_length));
            *radius
        }
        Shape::Box { half_extents } => {
            for corner in 0..8_u8 {
                let sign = |bit: u8| if corner & bit == 0 { -1.0 } else { 1.0 };
                let signs = Vector3::new(sign(1), sign(2), sign(4));
                add(Point3::from(half_extents.component_mul(&signs)));
            }
            0.0
        }
        Shape::Hull { vertices, .. } => {
            vertices.iter().copied().for_each(add);
            0.0
        }
        Shape::Cylinder { radius, half_length } => {
            return Surface::Cylinder {
                axis: pose.rotation * Vector3::z(),
                across: pose.rotation * Vector3::x(),
                radius: *radius,
                half_length: *half_length,
            };
        }
    };
    Surface::Points { first, count: points.len() - first, radius }
}

/// How far a shape of which no point is farther than `reach` from `center` reaches from there along each axis of its body, m.
fn extent(surface: &Surface, points: &[Vector3<f64>], center: Vector3<f64>, reach: f64) -> Vector3<f64> {
    match *surface {
        Surface::Points { first, count, radius } => {
            let points = points[first..first + count].iter();
            let farthest = points.fold(Vector3::zeros(), |farthest: Vector3<f64>, point| {
                farthest.sup(&(point - center).abs())
            });
            farthest.add_scalar(radius)
        }
        Surface::Cylinder { .. } => Vector3::repeat(reach),
    }
}

/// Centre (body frame) and radius of a bounding sphere of the shape, m.
pub(super) fn enclosing_ball(shape: &Shape, pose: &Isometry3<f64>) -> (Vector3<f64>, f64) {
    let (center, reach) = match shape {
        Shape::Sphere { radius } => (Point3::origin(), *radius),
        Shape::Capsule { radius, half_length } => (Point3::origin(), radius + half_length),
        Shape::Box { half_extents } => (Point3::origin(), half_extents.norm()),
        Shape::Cylinder { radius, half_length } => (Point3::origin(), radius.hypot(*half_length)),
        Shape::Hull { vertices, .. } => {
            let sum: Vector3<f64> = vertices.iter().map(|vertex| vertex.coords).sum();
            let center = Point3::from(sum / vertices.len().max(1) as f64);
            let reach = vertices.iter().map(|vertex| (vertex - center).norm()).fold(0.0, f64::max);
            (center, reach)
        }
    };
    ((pose * center).coords, reach)
}
