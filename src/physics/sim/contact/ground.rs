//! Contact with the ground.

use multiversion::multiversion;
use nalgebra::{Matrix3, Vector3};

use super::candidate::{Against, ContactCandidate, keep_four};
use super::detection::DetectionSettings;
use super::displacement::{BodyDisplacement, PENETRATION_ALLOWED};
use super::field;
use crate::model::{CYLINDER_SLOTS, GroundShape, Model, Surface};
use crate::scene::Terrain;
use crate::sim::bodies::{Bodies, BodyMotion};
use crate::sim::per_body::Motions;
use crate::sim::spatial::SpatialMotion;

/// Normal and tangents of a horizontal plane.
const FRAME: [Vector3<f64>; 3] =
    [Vector3::new(0.0, 0.0, 1.0), Vector3::new(1.0, 0.0, 0.0), Vector3::new(0.0, 1.0, 0.0)];

/// Number of points of a cylinder's two rims that are always tested, and of each rim's points that may be added
/// as the cylinder tilts.
const RIM_POINTS: usize = 6;
const ADDED_POINTS: usize = (CYLINDER_SLOTS - RIM_POINTS) / 2;

/// A corner-only shape of more corners than this is represented by its deepest and widest four.
pub const CORNERS_KEPT_WHOLE: usize = 8;

/// A place of the surface that could touch a ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Index of the shape among the model's [`ground_shapes`](Model::ground_shapes).
    pub shape: usize,
    /// Index of the character's link.
    pub link: usize,
    /// Index of the body it is part of.
    pub body: usize,
    /// Where it is, from the common point of `bodies`, world axes, m.
    pub at: Vector3<f64>,
}

/// Every place of the surface of `bodies` that could touch a horizontal ground, near or far.
pub fn surface_points(model: &Model, bodies: &Bodies) -> Vec<SurfacePoint> {
    let mut points = Vec::new();
    for (index, shape) in model.ground_shapes.iter().enumerate() {
        if model.fixed_base && shape.body == 0 {
            continue;
        }
        let body = bodies.at(shape.body);
        let mut add = |at: Vector3<f64>| {
            points.push(SurfacePoint { shape: index, link: shape.link, body: shape.body, at });
        };
        match shape.surface {
            Surface::Points { first, count, radius } => {
                let below = Vector3::new(0.0, 0.0, radius);
                model.ground_points[first..first + count]
                    .iter()
                    .for_each(|point| add(body.point(*point) - below));
            }
            Surface::Cylinder { axis, across, radius, half_length } => {
                let center = body.point(shape.center);
                rim_points(body.rotation, center, axis, across, radius, half_length)
                    .into_iter()
                    .for_each(add);
            }
        }
    }
    points
}

/// Adds all contact candidates on `ground` to `candidates`, in the order of the model's slots. `origin` is the common
/// point in the world. `close` receives the indices of the shapes that may touch the ground at other points than those
/// tested: round ones, and those with so many corners that only some are kept.
#[allow(clippy::too_many_arguments)] // one call a step; every argument is a stage's result
#[multiversion(targets("x86_64+avx2"), attrs(allow(clippy::too_many_arguments)))]
pub fn detect(
    model: &Model,
    bodies: &Bodies,
    ground: &Terrain,
    origin: Vector3<f64>,
    settings: &DetectionSettings,
    candidates: &mut Vec<ContactCandidate>,
    close: &mut Vec<usize>,
) {
    close.clear();
    let highest = ground.highest() - origin.z;
    for of_body in &model.ground_bodies {
        let body = bodies.at(of_body.body);
        let velocity = body.velocity;
        // No point is faster than its body's origin plus the farthest point's rotation about it. Sums are no less than the norms and
        // take no roots.
        let (moving, turning) = (velocity.at(body.origin).abs().sum(), velocity.angular.abs().sum());
        // Most bodies are too high as a whole.
        if body.origin.z - of_body.farthest - highest > settings.margin(moving + turning * of_body.farthest) {
            continue;
        }
        // The whole motion is looked up here only: most bodies need no more than the parts above.
        let BodyMotion { rotation, origin: place, velocity, .. } = bodies.at(of_body.body);
        let mut near = NearGround { ground, origin, settings, rotation, place, velocity, candidates };
        for (index, shape) in of_body.shapes.clone().zip(&model.ground_shapes[of_body.shapes.clone()]) {
            let margin = settings.margin(moving + turning * shape.farthest);
            let upright = near.rotation.row(2).transpose();
            let center = place.z + upright.dot(&shape.center);
            if center - shape.reach - highest > margin {
                continue;
            }
            match shape.surface {
                Surface::Points { first, count, radius } => {
                    if count > CORNERS_KEPT_WHOLE {
                        close.push(index);
                    }
                    // A long shape that lies flat reaches down less far than its bounding sphere: none of its corners is near.
                    if count == 1 || center - upright.abs().dot(&shape.extent) - highest <= margin {
                        near.points(
                            shape,
                            &model.ground_points[first..first + count],
                            radius,
                            highest + margin,
                        );
                    }
                }
                Surface::Cylinder { axis, across, radius, half_length } => {
                    close.push(index);
                    let center = near.point(shape.center);
                    let rims = rim_points(rotation, center, axis, across, radius, half_length);
                    for (index, at) in rims.into_iter().enumerate() {
                        near.meet(shape, index, at, 0.0);
                    }
                }
            }
        }
    }
}

/// A shape that may be near the ground, and where its contact candidates go. Its functions are compiled for the processor of [`detect`].
struct NearGround<'a> {
    ground: &'a Terrain,
    origin: Vector3<f64>,
    settings: &'a DetectionSettings,
    rotation: Matrix3<f64>,
    place: Vector3<f64>,
    velocity: SpatialMotion,
    candidates: &'a mut Vec<ContactCandidate>,
}

impl NearGround<'_> {
    /// A point given in the body frame, relative to the common point, m.
    #[inline(always)] // part of `detect`
    fn point(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.place + self.rotation * local
    }

    /// Adds those of the balls of `radius` about the shape's `points` that touch the ground or may come to; none whose lowest point is
    /// higher than `highest` above the common point.
    #[inline(always)]
    fn points(&mut self, shape: &GroundShape, points: &[Vector3<f64>], radius: f64, highest: f64) {
        let from = self.candidates.len();
        let upright = self.rotation.row(2).into_owned();
        let lowest = highest + radius - self.place.z;
        for (index, point) in points.iter().enumerate() {
            // Most corners are too high whatever their speed.
            if upright[0] * point.x + upright[1] * point.y + upright[2] * point.z <= lowest {
                self.meet(shape, index, self.point(*point), radius);
            }
        }
        if points.len() > CORNERS_KEPT_WHOLE {
            keep_four(self.candidates, from);
        }
    }

    /// Adds the ball of `radius` about `midpoint`, which has the slots from `slot`, wherever it touches the ground or may come to.
    #[inline(always)]
    fn meet(&mut self, shape: &GroundShape, index: usize, midpoint: Vector3<f64>, radius: f64) {
        match self.ground {
            Terrain::Plane { height } => {
                let at = midpoint - Vector3::new(0.0, 0.0, radius);
                self.add(shape, index, FRAME, at, at.z - (height - self.origin.z));
            }
            Terrain::Field(heights) => {
                let (center, velocity) = (midpoint + self.origin, self.velocity.at(midpoint));
                field::meet(heights, center, radius, velocity, self.settings, |met| {
                    self.add(shape, index, met.frame, midpoint - met.frame[0] * radius, met.gap);
                });
            }
        }
    }

    /// Adds the point `at` of the surface, `gap` above a plane of the ground with normal and tangents `frame`, if it may touch it.
    #[inline(always)]
    fn add(
        &mut self,
        shape: &GroundShape,
        index: usize,
        frame: [Vector3<f64>; 3],
        at: Vector3<f64>,
        gap: f64,
    ) {
        let approach = -frame[0].dot(&self.velocity.at(at));
        if gap <= self.settings.margin(approach) {
            self.candidates.push(ContactCandidate {
                slot: shape.first_slot + index,
                link: shape.link,
                body: shape.body,
                against: Against::Ground,
                at,
                frame,
                depth: -gap,
                rebound: self.settings.rebound(approach),
                material: ContactCandidate::SMOOTH,
            });
        }
    }
}

/// The lowest point of each rim and the two points 120° away from it.
fn rim_points(
    rotation: Matrix3<f64>,
    center: Vector3<f64>,
    axis: Vector3<f64>,
    across: Vector3<f64>,
    radius: f64,
    half_length: f64,
) -> [Vector3<f64>; RIM_POINTS] {
    let axis = rotation * axis;
    // An upright cylinder has no lowest point of its rim; any direction fixed in the body will do.
    let lowest = lowest(axis).unwrap_or_else(|| rotation * across);
    let sideways = axis.cross(&lowest);
    let third = 3.0_f64.sqrt() / 2.0;
    let rim = [lowest, sideways * third - lowest * 0.5, -sideways * third - lowest * 0.5];
    let mut points = [center; RIM_POINTS];
    for (end, direction) in [axis * half_length, -axis * half_length].into_iter().enumerate() {
        for (corner, rim) in rim.iter().enumerate() {
            points[3 * end + corner] += direction + rim * radius;
        }
    }
    points
}

/// The direction from the middle of a rim about `axis` to its lowest point; `None` if no point is lowest.
fn lowest(axis: Vector3<f64>) -> Option<Vector3<f64>> {
    (axis * axis.z - Vector3::z()).try_normalize(1e-9)
}

/// Adds the points of the shapes in `close` that the step would drive into `ground` at the bodies' velocities `new`;
/// whether there are any. As a disc tilts, its lowest point moves round its rim, so that no candidate of the
/// beginning needs to be the lowest point at the end.
#[allow(clippy::too_many_arguments)] // as of `detect`
pub fn add_driven_in(
    model: &Model,
    close: &[usize],
    bodies: &Bodies,
    new: &Motions,
    ground: &Terrain,
    origin: Vector3<f64>,
    step: f64,
    candidates: &mut Vec<ContactCandidate>,
) -> bool {
    let before = candidates.len();
    let allowed = PENETRATION_ALLOWED * model.size;
    for shape in close.iter().map(|index| &model.ground_shapes[*index]) {
        let body = &bodies.at(shape.body);
        let step = BodyDisplacement::new(body, new.at(shape.body), step);
        let mut add = |slot: usize, at: Vector3<f64>, radius: f64| {
            if candidates.iter().any(|candidate| candidate.slot == slot) {
                return false;
            }
            let arrived = step.point(at);
            let mut meet = |frame: [Vector3<f64>; 3], gap: f64| {
                let below = at - frame[0] * radius;
                let depth = frame[0].dot(&(arrived - at)) - gap;
                if -gap > depth.max(0.0) + allowed {
                    candidates.push(ContactCandidate {
                        slot,
                        link: shape.link,
                        body: shape.body,
                        against: Against::Ground,
                        at: below,
                        frame,
                        depth,
                        rebound: 0.0,
                        material: ContactCandidate::SMOOTH,
                    });
                }
            };
            match ground {
                Terrain::Plane { height } => meet(FRAME, arrived.z - radius - (height - origin.z)),
                Terrain::Field(heights) => {
                    let still = Vector3::zeros();
                    field::meet(
                        heights,
                        arrived + origin,
                        radius,
                        still,
                        &DetectionSettings::PRESENT,
                        |field_point| {
                            meet(field_point.frame, field_point.gap);
                        },
                    );
                }
            }
            true
        };
        match shape.surface {
            Surface::Cylinder { axis, radius, half_length, .. } => {
                let axis = body.rotation * axis;
                let Some(lowest) = lowest(step.rotated(axis)) else { continue };
                let (center, outward) = (body.point(shape.center), step.rotated_back(lowest));
                for (end, side) in [half_length, -half_length].into_iter().enumerate() {
                    let first = shape.first_slot + RIM_POINTS + end * ADDED_POINTS;
                    let at = center + axis * side + outward * radius;
                    let _ = (first..first + ADDED_POINTS).any(|slot| add(slot, at, 0.0));
                }
            }
            Surface::Points { first, count, radius } => {
                let corners =
                    model.ground_points[first..first + count].iter().map(|point| body.point(*point));
                let height = |at: &Vector3<f64>| step.point(*at).z;
                let lowest = corners.enumerate().min_by(|(_, a), (_, b)| height(a).total_cmp(&height(b)));
                if let Some((index, at)) = lowest {
                    add(shape.first_slot + index, at, radius);
                }
            }
        }
    }
    candidates.len() > before
}
