//! Feet: the points with which a link touches the ground, how high it is lifted, and on what it stands.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Vector3};

use super::footfall::Footing;
use gaitwright_physics::character::{Link, Shape};
use gaitwright_physics::playback::{Sample, Trace};

/// Points of each rim of a cylinder: its lowest point is missed by at most 2 % of the radius.
const RIM: usize = 16;

/// What of a link can touch the ground: balls about points in the link's frame, m.
#[derive(Debug, Clone, Default)]
pub(super) struct FootShape {
    balls: Vec<(Point3<f64>, f64)>,
}

impl FootShape {
    /// Of the link's collision shapes; of its origin where it has none.
    pub(super) fn of(link: &Link) -> Self {
        let mut balls = Vec::new();
        for placed in &link.collisions {
            let (points, radius) = cores(&placed.shape);
            balls.extend(points.into_iter().map(|point| (placed.pose * point, radius)));
        }
        if balls.is_empty() {
            balls.push((Point3::origin(), 0.0));
        }
        Self { balls }
    }

    /// Height of the lowest point with the link at `frame`, world frame, m.
    pub(super) fn lowest(&self, frame: &Isometry3<f64>) -> f64 {
        self.balls.iter().map(|(point, radius)| (frame * point).z - radius).fold(f64::INFINITY, f64::min)
    }

    /// The point on which the link stands at `frame`, in the link's frame, m: the middle of all centres of balls whose
    /// lowest points are within `thickness` (m) of the lowest.
    pub(super) fn sole(&self, frame: &Isometry3<f64>, thickness: f64) -> Point3<f64> {
        let highest = self.lowest(frame) + thickness;
        let sole: Vec<Vector3<f64>> = self
            .balls
            .iter()
            .filter(|(point, radius)| (frame * point).z - radius <= highest)
            .map(|(point, _)| point.coords)
            .collect();
        Point3::from(sole.iter().sum::<Vector3<f64>>() / sole.len().max(1) as f64)
    }
}

/// Points and the radius of the balls about them that together reach as far down as the shape.
fn cores(shape: &Shape) -> (Vec<Point3<f64>>, f64) {
    let ends = |half: f64| [-half, half].map(|z| Point3::new(0.0, 0.0, z));
    match shape {
        Shape::Sphere { radius } => (vec![Point3::origin()], *radius),
        Shape::Capsule { radius, half_length } => (ends(*half_length).to_vec(), *radius),
        Shape::Box { half_extents } => {
            let signs = |bit: usize, corner: usize| if (corner >> bit) & 1 == 0 { -1.0 } else { 1.0 };
            let corner = |corner: usize| {
                let sign = Vector3::new(signs(0, corner), signs(1, corner), signs(2, corner));
                Point3::from(half_extents.component_mul(&sign))
            };
            ((0..8).map(corner).collect(), 0.0)
        }
        Shape::Cylinder { radius, half_length } => {
            let rim = |end: Point3<f64>| {
                (0..RIM).map(move |index| {
                    let (sine, cosine) = (TAU * index as f64 / RIM as f64).sin_cos();
                    Point3::new(radius * cosine, radius * sine, end.z)
                })
            };
            (ends(*half_length).into_iter().flat_map(rim).collect(), 0.0)
        }
        Shape::Hull { vertices, .. } => (vertices.clone(), 0.0),
    }
}

/// Mean over the whole swings in `trace` of the greatest height of the foot's lowest point over the ground at height
/// `ground`, m; `None` without a whole swing. `shapes` are those of the foot's links.
pub(super) fn clearance(trace: &Trace, footing: &Footing, shapes: &[FootShape], ground: f64) -> Option<f64> {
    let lowest = |sample: &Sample| {
        let links = footing.links.iter().zip(shapes);
        let heights = links.filter_map(|(&link, shape)| Some(shape.lowest(sample.link_poses.get(link)?)));
        heights.min_by(f64::total_cmp)
    };
    let heights: Vec<f64> = swings(footing)
        .filter_map(|(from, to)| {
            let heights = trace.samples.get(from..to)?.iter().filter_map(lowest);
            heights.map(|height| height - ground).max_by(f64::total_cmp)
        })
        .collect();
    super::stride::mean(&heights)
}

/// First sample and the one after the last of every swing that a stance precedes and follows.
fn swings(footing: &Footing) -> impl Iterator<Item = (usize, usize)> {
    footing.touch_downs.iter().filter_map(|&to| {
        let from = footing.stance[..to].iter().rposition(|&stands| stands)? + 1;
        Some((from, to))
    })
}
