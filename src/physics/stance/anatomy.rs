//! Which bodies of a character are limbs and feet, and where its surface is in a pose.

use nalgebra::Vector3;

use crate::model::{DofKind, Model};
use crate::scene::Terrain;
use crate::sim::State;
use crate::sim::bodies::Bodies;
use crate::sim::contact::ground::{SurfacePoint, surface_points};
use crate::sim::coordinates::reduced::kinematics::place;

/// A segment shorter than this share of the limb's longest one does not count for its length.
const SHORT: f64 = 0.5;

/// A foot with three corners that span a plane within this share of the limb's length of its lowest point has a sole.
const SOLE: f64 = 0.02;

/// Least height of the triangle that the corners of a sole span, as a share of its longest side: those of a stretched shank lie in a row.
const WIDE: f64 = 0.05;

/// Limbs of as many bodies whose lengths differ by no more than this share are alike.
const ALIKE: f64 = 0.02;

/// A limb that can carry the character.
#[derive(Debug, Clone, PartialEq)]
pub struct Limb {
    /// Bodies from the one that is joined to the trunk to the foot.
    pub bodies: Vec<usize>,
    /// The body of `bodies` with which the long segments begin: a short one before it only spreads the
    /// limb (a hip's abduction).
    pub first_long: usize,
    /// The body of `bodies` that is the last long segment: the shank.
    pub last_long: usize,
    /// Length from there to the farthest surface point of the foot when stretched, m.
    pub length: f64,
    /// Whether the foot is a sole (corners) and not a ball.
    pub flat: bool,
    /// The vertical of the character as drawn, with every joint at zero, in the foot's frame.
    pub up: Vector3<f64>,
}

/// A character in a pose, root upright at the origin.
pub struct Posed {
    /// Poses of the bodies.
    pub bodies: Bodies,
    /// All surface points that could touch a ground.
    pub surface: Vec<SurfacePoint>,
    /// Centre of mass, m.
    pub center_of_mass: Vector3<f64>,
}

impl Posed {
    /// `model` with joints at `angles`, rad or m.
    pub fn new(model: &Model, angles: &[f64]) -> Self {
        let mut state = State::new(model);
        state.angles.copy_from_slice(angles);
        Self::of(model, &state)
    }

    /// `model` in `state`, relative to the root's origin.
    pub fn of(model: &Model, state: &State) -> Self {
        let mut bodies = Bodies::new(model);
        place(model, state, &mut bodies);
        let surface = surface_points(model, &bodies);
        let first: Vector3<f64> = bodies.iter().map(|body| body.inertia.first_moment).sum();
        Self { bodies, surface, center_of_mass: first / model.mass }
    }

    /// Height of the lowest surface point relative to the root's origin, m; 0 without a surface.
    pub fn lowest(&self) -> f64 {
        let lowest = self.surface.iter().map(|point| point.at.z).fold(f64::INFINITY, f64::min);
        if lowest.is_finite() { lowest } else { 0.0 }
    }

    /// Height of the root's origin at which the lowest part touches `ground`, with the origin at the
    /// world's z axis, m.
    pub fn resting_height(&self, ground: &Terrain) -> f64 {
        let heights = self.surface.iter().map(|point| ground.height(point.at.x, point.at.y) - point.at.z);
        let highest = heights.fold(f64::NEG_INFINITY, f64::max);
        if highest.is_finite() { highest } else { ground.height(0.0, 0.0) }
    }

    /// Where the end of `limb` would stand: the middle of its lowest points, m.
    pub fn foot(&self, limb: &Limb) -> Option<Vector3<f64>> {
        let foot = *limb.bodies.last()?;
        let points = || self.surface.iter().filter(|point| point.body == foot).map(|point| point.at);
        let lowest = points().map(|at| at.z).fold(f64::INFINITY, f64::min);
        let sole = || points().filter(|at| at.z < lowest + SOLE * limb.length);
        let middle = sole().sum::<Vector3<f64>>() / sole().count().max(1) as f64;
        lowest.is_finite().then_some(Vector3::new(middle.x, middle.y, lowest))
    }
}

/// Whether `points` do not all lie along a line.
fn span_a_plane(points: &[Vector3<f64>]) -> bool {
    let Some(first) = points.first() else { return false };
    let sides = || points.iter().map(|point| point - first);
    let longest = sides().max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default();
    let area = sides().map(|side| longest.cross(&side).norm()).fold(0.0, f64::max);
    area > WIDE * longest.norm_squared()
}

/// Greatest distance of the origin of `body` from that of its parent, m: a slide is drawn out as far as its range of motion lets it.
fn segment(model: &Model, body: usize) -> f64 {
    let joint = &model.bodies[body];
    match (joint.dof, model.limits[body - 1]) {
        (DofKind::Prismatic, Some(ends)) => {
            let axis = joint.joint_rotation * joint.axis;
            ends.into_iter().map(|end| (joint.offset + axis * end).norm()).fold(0.0, f64::max)
        }
        _ => joint.offset.norm(),
    }
}

/// A limb stands whose end, stretched down, is no higher above the lowest of all than this share of the longest limb: longer ones bend
/// as far.
const LOW: f64 = 0.4;

/// Limbs that reach the ground: chains of bodies from a branching of the tree (or the root) to its
/// end, of those nearly as low as the lowest when all hang down. Where some are alike, those that are like no other are none: a tail
/// may be longer than the legs.
pub fn limbs(model: &Model, posed: &Posed) -> Vec<Limb> {
    let children =
        |body: usize| (1..model.bodies.len()).filter(move |child| model.bodies[*child].parent == body);
    let drawn = Posed::new(model, &vec![0.0; model.joint_count()]);
    let mut limbs = Vec::new();
    for leaf in (1..model.bodies.len()).filter(|body| children(*body).next().is_none()) {
        let touching: Vec<&SurfacePoint> = posed.surface.iter().filter(|point| point.body == leaf).collect();
        if touching.is_empty() {
            continue;
        }
        let mut bodies = vec![leaf];
        let mut body = leaf;
        while model.bodies[body].parent != 0 && children(model.bodies[body].parent).count() == 1 {
            body = model.bodies[body].parent;
            bodies.push(body);
        }
        bodies.reverse();
        let origin = posed.bodies.at(leaf).origin;
        let end = touching.iter().map(|point| (point.at - origin).norm()).fold(0.0, f64::max);
        let mut segments: Vec<f64> = bodies.windows(2).map(|pair| segment(model, pair[1])).collect();
        segments.push(end);
        let longest = segments.iter().copied().fold(0.0, f64::max);
        let long = |segment: &f64| *segment > SHORT * longest;
        let first = segments.iter().position(long).unwrap_or(0);
        let last = segments.iter().rposition(long).unwrap_or(first);
        let length: f64 = segments[first..].iter().sum();
        let (first_long, last_long) = (bodies[first], bodies[last]);
        let lowest = touching.iter().map(|point| point.at.z).fold(f64::INFINITY, f64::min);
        let sole = touching.iter().map(|point| point.at).filter(|at| at.z < lowest + SOLE * length);
        limbs.push(Limb {
            bodies,
            first_long,
            last_long,
            length,
            flat: span_a_plane(&sole.collect::<Vec<_>>()),
            up: drawn.bodies.at(leaf).rotation.transpose() * Vector3::z(),
        });
    }
    let alike = |one: &Limb, other: &Limb| {
        one.bodies.len() == other.bodies.len()
            && (one.length - other.length).abs() <= ALIKE * one.length
            && one.bodies != other.bodies
    };
    let paired: Vec<Limb> =
        limbs.iter().filter(|one| limbs.iter().any(|other| alike(one, other))).cloned().collect();
    if !paired.is_empty() {
        limbs = paired;
    }
    let bottom = |limb: &Limb| posed.bodies.at(limb.first_long).origin.z - limb.length;
    let lowest = limbs.iter().map(&bottom).fold(f64::INFINITY, f64::min);
    let longest = limbs.iter().map(|limb| limb.length).fold(0.0, f64::max);
    limbs.retain(|limb| bottom(limb) < lowest + LOW * longest);
    // Of more than two legs the end of a shank is no sole, even if it is flat: level ones could not bend.
    if limbs.len() > 2 {
        limbs.iter_mut().for_each(|limb| limb.flat &= limb.bodies.last() != Some(&limb.last_long));
    }
    limbs
}
