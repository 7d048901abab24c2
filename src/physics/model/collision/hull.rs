//! Convex hulls as cores of solids.

use nalgebra::{Point3, Vector3};
use parry3d::math::Vector;
use parry3d::shape::{PolygonalFeature, SupportMap};

use super::convert::vector;

/// Triangles belong to one face if their normals differ by no more than this, rad.
const FLAT: f64 = 1e-3;

/// The corners and faces of a convex polyhedron, in the frame of the solid it is the core of.
#[derive(Debug, Clone, PartialEq)]
pub struct HullCore {
    corners: Vec<Vector>,
    faces: Vec<Face>,
}

/// A face and up to four of its corners, which span as much of it as four can.
#[derive(Debug, Clone, PartialEq)]
struct Face {
    normal: Vector,
    corners: [Vector; 4],
    count: usize,
}

impl HullCore {
    /// From corners and triangles (counter-clockwise seen from outside).
    pub fn new(corners: &[Point3<f64>], triangles: &[[u32; 3]]) -> Self {
        let mut flats: Vec<(Vector3<f64>, Vec<u32>)> = Vec::new();
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
            let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
            match flats
                .iter_mut()
                .find(|(other, _)| other.cross(&normal).norm() < FLAT && other.dot(&normal) > 0.0)
            {
                Some((_, members)) => members.extend(triangle),
                None => flats.push((normal, triangle.to_vec())),
            }
        }
        let faces = flats.into_iter().map(|(normal, members)| Face::new(normal, &members, corners)).collect();
        Self { corners: corners.iter().map(|corner| vector(corner.coords)).collect(), faces }
    }

    /// Outward normals of the faces.
    pub fn normals(&self) -> impl Iterator<Item = Vector> + '_ {
        self.faces.iter().map(|face| face.normal)
    }

    /// The face that looks most along `direction`.
    pub fn feature(&self, direction: Vector, feature: &mut PolygonalFeature) {
        let best =
            self.faces.iter().max_by(|a, b| a.normal.dot(direction).total_cmp(&b.normal.dot(direction)));
        if let Some(face) = best {
            feature.vertices = face.corners;
            feature.num_vertices = face.count;
        }
    }
}

impl Face {
    fn new(normal: Vector3<f64>, members: &[u32], corners: &[Point3<f64>]) -> Self {
        let mut members = members.to_vec();
        members.sort_unstable();
        members.dedup();
        let points: Vec<Vector3<f64>> =
            members.iter().map(|corner| corners[*corner as usize].coords).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let across = (points[0] - middle).try_normalize(0.0).unwrap_or_else(Vector3::x);
        let beside = normal.cross(&across);
        let angle = |point: &Vector3<f64>| {
            let arm = point - middle;
            arm.dot(&beside).atan2(arm.dot(&across))
        };
        let mut around = points;
        around.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
        let count = around.len().min(4);
        let kept = |index: usize| vector(around[index.min(count - 1) * around.len() / count]);
        Self { normal: vector(normal), corners: [0, 1, 2, 3].map(kept), count }
    }
}

impl SupportMap for HullCore {
    fn local_support_point(&self, direction: Vector) -> Vector {
        let mut best = (f64::NEG_INFINITY, Vector::ZERO);
        for corner in &self.corners {
            let along = corner.dot(direction);
            if along > best.0 {
                best = (along, *corner);
            }
        }
        best.1
    }
}
