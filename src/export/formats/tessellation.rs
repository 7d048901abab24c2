//! Triangles of a shape, for display.

use std::f64::consts::{PI, TAU};

use nalgebra::{Isometry3, Point3, Vector3};

use gaitwright_physics::character::Shape;

/// Sides of what is round about its axis.
const SIDES: usize = 24;

/// Rings from a pole of a ball to its equator.
const RINGS: usize = 6;

/// Triangles with a normal at each corner, in the frame of a link.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct DisplayMesh {
    /// m.
    pub(super) positions: Vec<[f32; 3]>,
    /// Unit vectors, as many.
    pub(super) normals: Vec<[f32; 3]>,
    /// Three for each triangle, counter-clockwise seen from outside.
    pub(super) indices: Vec<u32>,
}

/// A point of a profile that is turned about the z axis: distance from it, height, and the normal's two parts.
type ProfilePoint = [f64; 4];

impl DisplayMesh {
    /// Adds a shape whose frame is `pose`.
    pub(super) fn add(&mut self, shape: &Shape, pose: &Isometry3<f64>) {
        match shape {
            Shape::Sphere { radius } => {
                self.turned(pose, &[arc(*radius, 0.0, -0.5 * PI), arc(*radius, 0.0, 0.0)].concat());
            }
            Shape::Capsule { radius, half_length } => {
                let profile = [arc(*radius, -half_length, -0.5 * PI), arc(*radius, *half_length, 0.0)];
                self.turned(pose, &profile.concat());
            }
            Shape::Cylinder { radius: r, half_length: h } => {
                self.turned(pose, &[[0.0, -h, 0.0, -1.0], [*r, -h, 0.0, -1.0]]);
                self.turned(pose, &[[*r, -h, 1.0, 0.0], [*r, *h, 1.0, 0.0]]);
                self.turned(pose, &[[*r, *h, 0.0, 1.0], [0.0, *h, 0.0, 1.0]]);
            }
            Shape::Box { half_extents } => self.faces_of_box(pose, half_extents),
            Shape::Hull { vertices, triangles } => {
                for triangle in triangles {
                    let [Some(a), Some(b), Some(c)] = triangle.map(|at| vertices.get(at as usize)) else {
                        continue;
                    };
                    // Without an area there is no normal and nothing to see.
                    if let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-14) {
                        let corners = [a, b, c].map(|corner| self.corner(pose, corner, &normal));
                        self.indices.extend(corners);
                    }
                }
            }
        }
    }

    fn corner(&mut self, pose: &Isometry3<f64>, position: &Point3<f64>, normal: &Vector3<f64>) -> u32 {
        let index = self.positions.len() as u32;
        self.positions.push((pose * position).coords.cast::<f32>().into());
        self.normals.push((pose * normal).cast::<f32>().into());
        index
    }

    fn faces_of_box(&mut self, pose: &Isometry3<f64>, half: &Vector3<f64>) {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut normal = Vector3::zeros();
                normal[axis] = side;
                let corners =
                    [(-1.0, -1.0), (side, -side), (1.0, 1.0), (-side, side)].map(|(along_u, along_v)| {
                        let mut corner = normal;
                        (corner[u], corner[v]) = (along_u, along_v);
                        self.corner(pose, &corner.component_mul(half).into(), &normal)
                    });
                let [a, b, c, d] = corners;
                self.indices.extend([a, b, c, a, c, d]);
            }
        }
    }

    /// The surface that a profile sweeps when it is turned about the z axis; it runs upward with the outside on its
    /// right.
    fn turned(&mut self, pose: &Isometry3<f64>, profile: &[ProfilePoint]) {
        let first = self.positions.len() as u32;
        for &[radius, height, outward, upward] in profile {
            for side in 0..=SIDES {
                let angle = TAU * side as f64 / SIDES as f64;
                let (sin, cos) = angle.sin_cos();
                let position = Point3::new(radius * cos, radius * sin, height);
                self.corner(pose, &position, &Vector3::new(outward * cos, outward * sin, upward));
            }
        }
        let row = SIDES as u32 + 1;
        for (ring, pair) in profile.windows(2).enumerate() {
            // Two arcs may meet in one circle.
            if pair[0][..2] == pair[1][..2] {
                continue;
            }
            let lower = first + ring as u32 * row;
            for side in 0..SIDES as u32 {
                let [a, b, c, d] =
                    [lower + side, lower + side + 1, lower + row + side + 1, lower + row + side];
                // At the axis one of the two triangles has no area.
                if pair[0][0] > 0.0 {
                    self.indices.extend([a, b, c]);
                }
                if pair[1][0] > 0.0 {
                    self.indices.extend([a, c, d]);
                }
            }
        }
    }
}

/// A quarter of a circle about the height `center`, upward from the latitude `from`, rad.
fn arc(radius: f64, center: f64, from: f64) -> Vec<ProfilePoint> {
    let point = |step: usize| {
        let (sin, cos) = (from + 0.5 * PI * step as f64 / RINGS as f64).sin_cos();
        // The poles lie on the axis exactly.
        let cos = if cos.abs() < 1e-12 { 0.0 } else { cos };
        [radius * cos, center + radius * sin, cos, sin]
    };
    (0..=RINGS).map(point).collect()
}
