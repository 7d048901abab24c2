//! The points at which two convex solids meet.

use parry3d::math::{Pose, Vector};
use parry3d::query::{ContactManifold, TrackedContact};
use parry3d::shape::{PackedFeatureId, PolygonalFeature};

use crate::model::collision::convex::{Approach, Convex};

/// Most points that the edges and corners of two faces of four corners give.
const POINTS: usize = 24;

/// A clipped point this much farther than the closest points of the solids, as a share of their size, does not
/// stand for them.
const SAME: f64 = 1e-6;

/// Scratch memory for the points of one pair of solids.
#[derive(Debug, Clone)]
pub struct Manifold {
    clipped: ContactManifold<(), ()>,
}

/// A point of the first solid and one of the second, in the frame of the first, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManifoldPoint {
    pub first: Vector,
    pub second: Vector,
    /// Their distance along the normal, m; negative for the depth of penetration.
    pub gap: f64,
}

impl Manifold {
    pub fn new() -> Self {
        let mut clipped = ContactManifold::new();
        clipped.points = Vec::with_capacity(POINTS);
        Self { clipped }
    }

    /// The corners of the area in which the faces (or edges) that face each other overlap, seen along
    /// the normal of `approach`, and the closest points of the solids where those corners are not among them.
    /// `pose` is the frame of `second` in that of `first`.
    pub fn meet<'a>(
        &'a mut self,
        first: &Convex,
        second: &Convex,
        pose: &'a Pose,
        approach: &Approach,
    ) -> impl Iterator<Item = ManifoldPoint> + 'a {
        let points = &mut self.clipped.points;
        points.clear();
        let skins = first.skin() + second.skin();
        if !first.is_ball() && !second.is_ball() {
            let back = pose.inverse();
            let facing = back.rotation * -approach.normal;
            let feature = first.feature(approach.normal, approach.first);
            let other = second.feature(facing, back * approach.second);
            PolygonalFeature::contacts(
                pose,
                &back,
                approach.normal,
                facing,
                &feature,
                &other,
                &mut self.clipped,
                false,
            );
            for point in &mut self.clipped.points {
                point.local_p1 += approach.normal * first.skin();
                point.local_p2 += facing * second.skin();
                point.dist -= skins;
            }
        }
        let points = &mut self.clipped.points;
        let closest = points.iter().map(|point| point.dist).fold(f64::INFINITY, f64::min);
        if closest > approach.gap + SAME * (first.reach + second.reach) {
            let unknown = PackedFeatureId::UNKNOWN;
            let second = pose.inverse() * approach.second;
            points.push(TrackedContact::new(approach.first, second, unknown, unknown, approach.gap));
        }
        points.iter().map(|point| ManifoldPoint {
            first: point.local_p1,
            second: *pose * point.local_p2,
            gap: point.dist,
        })
    }
}
