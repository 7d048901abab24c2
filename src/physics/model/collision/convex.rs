//! Convex solids, and how far apart two of them are.
//!
//! A solid is a core (segment, box, cylinder or hull) with a skin of constant thickness: a ball is a point
//! with a skin, a capsule a segment with one. The distance of two cores is found by the algorithm of
//! Gilbert, Johnson & Keerthi 1988 on the simplices of `parry`. That algorithm loses all digits of the
//! normal where cores touch, so they are first moved apart along the best axis known, and the normal that
//! is found there is improved until it no longer changes: see [`Convex::approach`].

use nalgebra::{Isometry3, Matrix3, Vector3};
use parry3d::math::{Matrix, Pose, Rotation, Vector};
use parry3d::query::gjk::{CsoPoint, VoronoiSimplex};
use parry3d::shape::{Cuboid, Cylinder, PolygonalFeature, PolygonalFeatureMap, Segment, SupportMap};

use super::hull::HullCore;
use crate::character::{Placed, Shape};

pub use super::convert::{frame, from_vector, vector};

/// How far cores are moved apart before their normal is computed, as a share of the smaller solid's bounding radius.
const MOVED_APART: f64 = 0.05;
/// Greatest number of improvements of a normal.
const IMPROVEMENTS: usize = 8;
/// Greatest number of support points that the search for the closest points may visit.
const VISITS: usize = 100;
/// An axis is better than another if it separates by this share of the solids' size more.
const BETTER: f64 = 1e-12;
/// How near a simplex comes to the true distance, as a share of the solids' size.
const EXACT: f64 = 1e-15;

/// A convex solid at its place in a frame: a body's, or the world's.
#[derive(Debug, Clone, PartialEq)]
pub struct Convex {
    core: Core,
    /// Thickness of the skin, m.
    skin: f64,
    /// Frame of the core in the body or the world.
    pose: Pose,
    /// Rotation matrix of that frame.
    rotation: Matrix,
    /// Centre of a bounding sphere, in the same frame as `pose`, m.
    pub center: Vector3<f64>,
    /// Radius of that sphere, m.
    pub reach: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Core {
    Segment(Segment),
    Cuboid(Cuboid),
    /// Along y.
    Cylinder(Cylinder),
    Hull(HullCore),
}

/// Where the core of a solid is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Its axes as columns.
    axes: Matrix,
    /// Its origin, m.
    origin: Vector,
}

/// How two solids lie to each other, in the frame of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// Unit normal from the first to the second.
    pub normal: Vector,
    /// Distance along the normal, m; negative for the depth of penetration.
    pub gap: f64,
    /// The first solid's point closest to the second.
    pub first: Vector,
    /// The second solid's point closest to the first.
    pub second: Vector,
}

impl Convex {
    /// The solid of `placed`, whose own frame is seen from the body or the world through `pose`.
    pub fn new(placed: &Placed, pose: &Isometry3<f64>) -> Self {
        let place = pose * placed.pose;
        let mut pose = frame(place.rotation.to_rotation_matrix().matrix(), place.translation.vector);
        let along = |half: f64| Segment::new(Vector::new(0.0, 0.0, -half), Vector::new(0.0, 0.0, half));
        let (core, skin) = match &placed.shape {
            Shape::Sphere { radius } => (Core::Segment(along(0.0)), *radius),
            Shape::Capsule { radius, half_length } => (Core::Segment(along(*half_length)), *radius),
            Shape::Box { half_extents } => (Core::Cuboid(Cuboid::new(vector(*half_extents))), 0.0),
            Shape::Cylinder { radius, half_length } => {
                // A cylinder of parry stands along y.
                pose.rotation *= Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2);
                (Core::Cylinder(Cylinder::new(*half_length, *radius)), 0.0)
            }
            Shape::Hull { vertices, triangles } => (Core::Hull(HullCore::new(vertices, triangles)), 0.0),
        };
        let (center, reach) = super::surface::enclosing_ball(&placed.shape, &place);
        let rotation = Matrix::from_quat(pose.rotation);
        Self { core, skin, pose, rotation, center, reach }
    }

    /// Frame of the solid in the world, for a body whose frame is `body`.
    pub fn placed(&self, body: &Pose) -> Pose {
        *body * self.pose
    }

    /// Whether the core is a mere point: the solid is a ball.
    pub fn is_ball(&self) -> bool {
        matches!(self.core, Core::Segment(segment) if segment.a == segment.b)
    }

    /// Thickness of the skin, m.
    pub fn skin(&self) -> f64 {
        self.skin
    }

    /// Where the core is in the world for a body with the rotation matrix `rotation` and the origin `origin`.
    pub fn place(&self, rotation: &Matrix3<f64>, origin: Vector3<f64>) -> Place {
        let columns = [0, 1, 2].map(|column| vector(rotation.column(column).into()));
        let rotation = Matrix::from_cols(columns[0], columns[1], columns[2]);
        Place { axes: rotation * self.rotation, origin: vector(origin) + rotation * self.pose.translation }
    }

    /// How far this solid and `other`, whose cores are at `places`, are apart along `axis`, which is given in the frame
    /// of this one's core, m. They are no nearer to each other.
    pub fn apart_along(&self, other: &Self, [own, others]: [Place; 2], axis: Vector) -> f64 {
        let normal = own.axes * axis;
        let backward = others.axes.transpose() * -normal;
        let first = self.core.local_support_point(axis).dot(axis);
        let second = other.core.local_support_point(backward).dot(backward);
        (others.origin - own.origin).dot(normal) - first - second - self.skin - other.skin
    }

    /// How this solid and `other`, whose frame in this one's is `pose`, lie to each other.
    ///
    /// Along every axis n the solids are apart by s(n), the distance of their support planes, and the gap is
    /// the greatest s(n). Moved apart along n₀ by t > −s(n₀), they do not touch, and their normal n₁ there has
    /// s(n₁) ≥ s(n₀) + t (1 − n₀ · n₁): a better axis, or the same one. Where they touch deeply, the
    /// result is the best axis near the best of the seeds (normals of faces, directions between centres).
    ///
    /// # Errors
    /// If they are farther apart than `within`, an axis along which they are (see [`Convex::apart_along`]).
    pub fn approach(&self, other: &Self, pose: &Pose, within: f64) -> Result<Approach, Vector> {
        let skins = self.skin + other.skin;
        let within = within + skins;
        let mut best = (f64::NEG_INFINITY, Vector::Z);
        let mut seed = |normal: Vector| {
            if let Some(normal) = normal.try_normalize() {
                let apart = self.apart(other, pose, normal);
                if apart > best.0 {
                    best = (apart, normal);
                }
            }
        };
        let toward = pose.translation;
        seed(toward);
        self.core.axes(toward, &mut seed);
        other.core.axes(pose.rotation.inverse() * toward, |normal| seed(pose.rotation * normal));
        let size = self.reach + other.reach + toward.length();
        let margin = MOVED_APART * self.reach.min(other.reach);
        let mut ends = (Vector::ZERO, Vector::ZERO);
        for _ in 0..IMPROVEMENTS {
            let (apart, normal) = best;
            if apart > within {
                return Err(normal);
            }
            let shift = normal * (margin - apart).max(0.0);
            let drawn = Pose { translation: pose.translation + shift, ..*pose };
            let (first, second) = closest(&drawn, self, other, normal, size);
            ends = (first, second - shift);
            // If the axis found is no better, the present one is kept: seeds are often exact.
            let Some(found) = (second - first).try_normalize() else { break };
            let gap = self.apart(other, pose, found);
            if gap <= apart + BETTER * size {
                break;
            }
            best = (gap, found);
        }
        let (gap, normal) = best;
        if gap > within {
            return Err(normal);
        }
        Ok(Approach {
            normal,
            gap: gap - skins,
            first: ends.0 + normal * self.skin,
            second: ends.1 - normal * other.skin,
        })
    }

    /// s(n): how far the cores are apart along `normal`.
    #[inline]
    fn apart(&self, other: &Self, pose: &Pose, normal: Vector) -> f64 {
        let first = self.core.local_support_point(normal);
        let second = *pose * other.core.local_support_point(pose.rotation.inverse() * -normal);
        (second - first).dot(normal)
    }

    /// The face, edge or corner of the core that is farthest along `direction`, near `near`.
    pub fn feature(&self, direction: Vector, near: Vector) -> PolygonalFeature {
        let mut feature = PolygonalFeature::default();
        match &self.core {
            Core::Segment(segment) => feature = PolygonalFeature::from(*segment),
            Core::Cuboid(cuboid) => cuboid.local_support_feature(direction, &mut feature),
            Core::Cylinder(cylinder) => {
                cylinder.local_support_feature_toward(direction, near, &mut feature);
            }
            Core::Hull(hull) => hull.feature(direction, &mut feature),
        }
        feature
    }
}

impl Core {
    /// Candidate separating axes between the core and a solid that lies in the direction `toward`.
    fn axes(&self, toward: Vector, mut seed: impl FnMut(Vector)) {
        match self {
            Self::Segment(segment) => {
                let along = segment.b - segment.a;
                seed(toward - along * (toward.dot(along) / along.length_squared().max(f64::MIN_POSITIVE)));
            }
            Self::Cuboid(_) => {
                for axis in [Vector::X, Vector::Y, Vector::Z] {
                    seed(axis);
                    seed(-axis);
                }
            }
            Self::Cylinder(_) => {
                seed(Vector::Y);
                seed(-Vector::Y);
                seed(Vector::new(toward.x, 0.0, toward.z));
            }
            Self::Hull(hull) => hull.normals().for_each(seed),
        }
    }
}

impl SupportMap for Core {
    #[inline]
    fn local_support_point(&self, direction: Vector) -> Vector {
        match self {
            Self::Segment(segment) => segment.local_support_point(direction),
            Self::Cuboid(cuboid) => cuboid.local_support_point(direction),
            Self::Cylinder(cylinder) => cylinder.local_support_point(direction),
            Self::Hull(hull) => hull.local_support_point(direction),
        }
    }
}

/// The closest points of two cores that do not touch, in the frame of the first, which the search looks
/// for from `start` on.
fn closest(pose: &Pose, first: &Convex, second: &Convex, start: Vector, size: f64) -> (Vector, Vector) {
    let corner = |direction| CsoPoint::from_shapes(pose, &first.core, &second.core, direction);
    let mut simplex = VoronoiSimplex::new();
    simplex.reset(corner(start));
    let mut points = (Vector::ZERO, Vector::ZERO);
    let mut distance = f64::INFINITY;
    for _ in 0..VISITS {
        let nearest = simplex.project_origin_and_reduce();
        let shorter = nearest.length();
        // A full simplex holds the origin: what is left of the distance is rounding.
        if shorter >= distance || simplex.dimension() == 3 {
            break;
        }
        distance = shorter;
        points = (Vector::ZERO, Vector::ZERO);
        for index in 0..=simplex.dimension() {
            let (share, corner) = (simplex.proj_coord(index), simplex.point(index));
            points.0 += corner.orig1 * share;
            points.1 += corner.orig2 * share;
        }
        let direction = -nearest / distance;
        let next = corner(direction);
        // No corner lies farther than `next`, so the distance is at least −direction · next.
        if distance + direction.dot(next.point) <= EXACT * size || !simplex.add_point(next) {
            break;
        }
    }
    points
}
