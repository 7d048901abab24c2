//! Volume, centroid and inertia of solid shapes of unit density.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::{Placed, Shape};

/// Mass properties of a solid of unit density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Solid {
    /// m³.
    pub volume: f64,
    /// In the frame the solid is described in, m.
    pub centroid: Point3<f64>,
    /// About the centroid along the axes of that frame, m⁵.
    pub inertia: Matrix3<f64>,
}

impl Solid {
    /// The solid that `shape` encloses, in the shape's own frame. A [`Shape::Hull`] is taken as a closed
    /// surface with outward faces.
    pub fn of(shape: &Shape) -> Self {
        use std::f64::consts::PI;
        let about_origin = |volume: f64, [x, y, z]: [f64; 3]| Self {
            volume,
            centroid: Point3::origin(),
            inertia: Matrix3::from_diagonal(&Vector3::new(x, y, z)),
        };
        match shape {
            Shape::Sphere { radius } => {
                let volume = 4.0 / 3.0 * PI * radius.powi(3);
                about_origin(volume, [0.4 * volume * radius.powi(2); 3])
            }
            Shape::Box { half_extents } => {
                let volume = 8.0 * half_extents.product();
                let [x, y, z] = half_extents.map(|half| half * half * volume / 3.0).into();
                about_origin(volume, [y + z, x + z, x + y])
            }
            Shape::Cylinder { radius, half_length } => {
                let volume = 2.0 * PI * radius.powi(2) * half_length;
                let across = volume * (radius.powi(2) / 4.0 + half_length.powi(2) / 3.0);
                about_origin(volume, [across, across, volume * radius.powi(2) / 2.0])
            }
            Shape::Capsule { radius, half_length } => {
                // A cylinder and two half balls; the centroid of a half ball lies 3/8 of the radius
                // beyond the cylinder's end.
                let middle = 2.0 * PI * radius.powi(2) * half_length;
                let ends = 4.0 / 3.0 * PI * radius.powi(3);
                let across = middle * (radius.powi(2) / 4.0 + half_length.powi(2) / 3.0)
                    + ends * (0.4 * radius.powi(2) + half_length.powi(2) + 0.75 * radius * half_length);
                let along = middle * radius.powi(2) / 2.0 + ends * 0.4 * radius.powi(2);
                about_origin(middle + ends, [across, across, along])
            }
            Shape::Hull { vertices, triangles } => Self::bounded_by(vertices, triangles),
        }
    }

    /// The polyhedron bounded by outward faces, as a sum of signed tetrahedra over one common apex
    /// (Blow & Binstock 2004, "How to find the inertia tensor (or other mass properties) of a 3D solid
    /// body represented by a triangle mesh"). The apex is a corner, so that a body far from the origin
    /// loses no digits.
    fn bounded_by(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let apex = vertices.first().copied().unwrap_or_default();
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| vertices[corner as usize] - apex);
            let determinant = a.dot(&b.cross(&c));
            let sum = a + b + c;
            volume += determinant / 6.0;
            first += sum * (determinant / 24.0);
            second += (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose())
                * (determinant / 120.0);
        }
        let centroid = if volume == 0.0 { Vector3::zeros() } else { first / volume };
        let covariance = second - centroid * centroid.transpose() * volume;
        Self {
            volume,
            centroid: apex + centroid,
            inertia: Matrix3::identity() * covariance.trace() - covariance,
        }
    }

    /// The same solid described in the frame in which its present frame is `pose`.
    fn moved(self, pose: &Isometry3<f64>) -> Self {
        let rotation = pose.rotation.to_rotation_matrix();
        Self {
            volume: self.volume,
            centroid: pose * self.centroid,
            inertia: rotation * self.inertia * rotation.transpose(),
        }
    }

    /// The shapes of a link together, in the link frame; where they overlap, both count. `None` when
    /// there is no volume.
    pub fn of_all<'a>(shapes: impl IntoIterator<Item = &'a Placed>) -> Option<Self> {
        let parts: Vec<_> =
            shapes.into_iter().map(|placed| Self::of(&placed.shape).moved(&placed.pose)).collect();
        let volume: f64 = parts.iter().map(|part| part.volume).sum();
        if !(volume.is_finite() && volume > 0.0) {
            return None;
        }
        let first: Vector3<f64> = parts.iter().map(|part| part.centroid.coords * part.volume).sum();
        let centroid = Point3::from(first / volume);
        let inertia = parts
            .iter()
            .map(|part| part.inertia + parallel_axis(part.volume, part.centroid - centroid))
            .fold(Matrix3::zeros(), |sum, inertia| sum + inertia);
        Some(Self { volume, centroid, inertia })
    }
}

/// What the inertia of `mass` about its centroid gains about a point `offset` away from it
/// (Huygens-Steiner).
pub fn parallel_axis(mass: f64, offset: Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * offset.norm_squared() - offset * offset.transpose()) * mass
}
