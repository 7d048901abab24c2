//! The character's shapes, recorded once.

use nalgebra::{Isometry3, Point3, Vector3};
use re_sdk::{EntityPath, RecordingStream, RecordingStreamError};
use re_sdk_types::archetypes::{Boxes3D, Capsules3D, Cylinders3D, Ellipsoids3D, Mesh3D};
use re_sdk_types::components::FillMode;
use re_sdk_types::datatypes::Quaternion;

use super::appearance::Appearance;
use super::paths;
use gaitwright_physics::character::{Character, Placed, Shape};

/// Logs every link's shapes, for all times.
pub(super) fn log(
    stream: &RecordingStream,
    character: &Character,
    appearance: &Appearance,
) -> Result<(), RecordingStreamError> {
    for (link, &color) in character.links.iter().zip(&appearance.colors) {
        let shapes = if link.visuals.is_empty() { &link.collisions } else { &link.visuals };
        log_shapes(stream, &paths::link(&link.name), shapes, color)?;
    }
    Ok(())
}

/// Logs the shapes of one thing, those of a kind together: an entity has one archetype of each kind.
pub(super) fn log_shapes(
    stream: &RecordingStream,
    path: &EntityPath,
    shapes: &[Placed],
    fallback: [u8; 4],
) -> Result<(), RecordingStreamError> {
    let mut boxes = Instances::default();
    let mut balls = Instances::default();
    let mut cylinders = Instances::default();
    let mut capsules = Instances::default();
    let mut mesh = Faces::default();
    for placed in shapes {
        let color = placed.color.map_or(fallback, |rgba| rgba.map(|c| (255.0 * c.clamp(0.0, 1.0)) as u8));
        match &placed.shape {
            Shape::Sphere { radius } => balls.push(&placed.pose, [*radius as f32; 3], color),
            Shape::Box { half_extents } => boxes.push(&placed.pose, float(half_extents), color),
            Shape::Cylinder { radius, half_length } => {
                cylinders.push(&placed.pose, [*radius as f32, 2.0 * *half_length as f32, 0.0], color);
            }
            Shape::Capsule { radius, half_length } => {
                // The viewer's capsule runs from its origin along z, ours is centred.
                let lower = placed.pose * nalgebra::Translation3::new(0.0, 0.0, -half_length);
                capsules.push(&lower, [*radius as f32, 2.0 * *half_length as f32, 0.0], color);
            }
            Shape::Hull { vertices, triangles } => mesh.push(&placed.pose, vertices, triangles, color),
        }
    }
    if !boxes.sizes.is_empty() {
        let shapes = Boxes3D::from_centers_and_half_sizes(boxes.centers, boxes.sizes)
            .with_quaternions(boxes.rotations)
            .with_colors(boxes.colors)
            .with_fill_mode(FillMode::Solid);
        stream.log_static(path.clone(), &shapes)?;
    }
    if !balls.sizes.is_empty() {
        let shapes = Ellipsoids3D::from_centers_and_half_sizes(balls.centers, balls.sizes)
            .with_colors(balls.colors)
            .with_fill_mode(FillMode::Solid);
        stream.log_static(path.clone(), &shapes)?;
    }
    if !cylinders.sizes.is_empty() {
        let (lengths, radii) = cylinders.lengths_and_radii();
        let shapes = Cylinders3D::from_lengths_and_radii(lengths, radii)
            .with_centers(cylinders.centers)
            .with_quaternions(cylinders.rotations)
            .with_colors(cylinders.colors)
            .with_fill_mode(FillMode::Solid);
        stream.log_static(path.clone(), &shapes)?;
    }
    if !capsules.sizes.is_empty() {
        let (lengths, radii) = capsules.lengths_and_radii();
        let shapes = Capsules3D::from_lengths_and_radii(lengths, radii)
            .with_translations(capsules.centers)
            .with_quaternions(capsules.rotations)
            .with_colors(capsules.colors)
            .with_fill_mode(FillMode::Solid);
        stream.log_static(path.clone(), &shapes)?;
    }
    if !mesh.positions.is_empty() {
        let shapes =
            Mesh3D::new(mesh.positions).with_vertex_normals(mesh.normals).with_vertex_colors(mesh.colors);
        stream.log_static(path.clone(), &shapes)?;
    }
    Ok(())
}

/// Shapes of one kind on one link.
#[derive(Default)]
struct Instances {
    centers: Vec<[f32; 3]>,
    rotations: Vec<Quaternion>,
    /// Half extents, m; or radius, length and nothing.
    sizes: Vec<[f32; 3]>,
    colors: Vec<[u8; 4]>,
}

impl Instances {
    fn push(&mut self, pose: &Isometry3<f64>, size: [f32; 3], color: [u8; 4]) {
        self.centers.push(float(&pose.translation.vector));
        self.rotations.push(quaternion(pose));
        self.sizes.push(size);
        self.colors.push(color);
    }

    fn lengths_and_radii(&self) -> (Vec<f32>, Vec<f32>) {
        self.sizes.iter().map(|&[radius, length, _]| (length, radius)).unzip()
    }
}

/// Triangles of all meshes of one link; each has its own corners, so that faces look flat.
#[derive(Default)]
struct Faces {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colors: Vec<[u8; 4]>,
}

impl Faces {
    fn push(
        &mut self,
        pose: &Isometry3<f64>,
        vertices: &[Point3<f64>],
        triangles: &[[u32; 3]],
        color: [u8; 4],
    ) {
        for triangle in triangles {
            let [Some(a), Some(b), Some(c)] = triangle.map(|corner| vertices.get(corner as usize)) else {
                continue;
            };
            let (a, b, c) = (pose * a, pose * b, pose * c);
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vector3::z);
            for corner in [a, b, c] {
                self.positions.push(float(&corner.coords));
                self.normals.push(float(&normal));
                self.colors.push(color);
            }
        }
    }
}

/// Single precision, as the viewer draws.
pub(super) fn float(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x as f32, vector.y as f32, vector.z as f32]
}

/// Rotation of a pose, as the viewer stores it.
pub(super) fn quaternion(pose: &Isometry3<f64>) -> Quaternion {
    let q = pose.rotation;
    Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32])
}
