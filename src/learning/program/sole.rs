//! What of a leg touches the ground.

use nalgebra::Vector3;

use gaitwright_physics::model::{Frame, Model, Surface};

use crate::gait::limb::{SOLE, first_long};

/// Shapes of a foot whose lowest points are within this share of the hip's height of each other stand together.
const ASTAND: f64 = 0.002;

/// A point that can touch, in the frame of its body, and the radius of the ball about it, m.
type Touching = (Vector3<f64>, f64);

/// Where a leg touches the ground.
pub(super) struct Sole {
    /// The middle of its lowest points, in the frame of the leg's last body, m.
    pub(super) point: Vector3<f64>,
    /// Of the ball about it, m.
    pub(super) radius: f64,
    /// Length of the leg from its first long segment to the farthest of what can touch, m.
    pub(super) reach: f64,
    /// Place of the body in the leg with which that begins.
    pub(super) first_long: usize,
    /// Whether it is more than a point or an edge.
    pub(super) flat: bool,
}

impl Sole {
    /// Of the leg of these bodies, as it stands; `None` where nothing of it can touch.
    pub(super) fn of(model: &Model, frames: &[Frame], chain: &[usize]) -> Option<Self> {
        let body = *chain.last()?;
        let (rotation, origin) = frames[body];
        let bottom = |(point, radius): &Touching| (origin + rotation * point).z - radius;
        let lowest_of = |points: &[Touching]| points.iter().map(bottom).fold(f64::INFINITY, f64::min);
        let mut shapes = touching(model, body);
        let lowest = shapes.iter().map(|points| lowest_of(points)).fold(f64::INFINITY, f64::min);
        // A strut that ends in a ball is not what stands; a heel beside a toe is.
        let height = (frames[chain[0]].1.z - lowest).abs();
        shapes.retain(|points| lowest_of(points) < lowest + ASTAND * height);
        let points: Vec<Touching> = shapes.concat();
        let far = points.iter().map(|(point, _)| point.norm()).fold(0.0, f64::max);
        // As it stands: a slide's part of a leg is as long as it is drawn out.
        let mut segments: Vec<f64> =
            chain.windows(2).map(|pair| (frames[pair[1]].1 - frames[pair[0]].1).norm()).collect();
        segments.push(far);
        let first_long = first_long(&segments);
        let reach: f64 = segments[first_long..].iter().sum();
        let sole: Vec<&Touching> =
            points.iter().filter(|point| bottom(point) < lowest + SOLE * reach).collect();
        let count = sole.len() as f64;
        (!sole.is_empty()).then(|| Self {
            point: sole.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / count,
            radius: sole.iter().map(|(_, radius)| radius).sum::<f64>() / count,
            reach,
            first_long,
            flat: sole.len() >= 3,
        })
    }
}

/// Points of each shape of `body` that can touch: of a cylinder four of either rim.
fn touching(model: &Model, body: usize) -> Vec<Vec<Touching>> {
    let shapes = model.ground_shapes.iter().filter(|shape| shape.body == body);
    let points = shapes.map(|shape| match &shape.surface {
        Surface::Points { first, count, radius } => {
            model.ground_points[*first..first + count].iter().map(|point| (*point, *radius)).collect()
        }
        Surface::Cylinder { axis, across, radius, half_length } => {
            let side = axis.cross(across);
            let at = |end: f64, rim: Vector3<f64>| shape.center + axis * (end * half_length) + rim * *radius;
            let rims = |end: f64| [*across, -across, side, -side].map(|rim| (at(end, rim), 0.0));
            [-1.0, 1.0].into_iter().flat_map(rims).collect()
        }
    });
    points.collect()
}
