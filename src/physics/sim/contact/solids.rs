//! Contact of the character's shapes with each other and with the obstacles of the scene.
//!
//! Near pairs are found by sweeping enclosing spheres along the world axis of their greatest spread, and kept until
//! the character has moved by the distance up to which a pair counts as near. Each pair has a lower bound of its
//! distance from the last time it was computed. Only where the motion since then may have used it up
//! ([`super::travel`]) is the distance computed again, and the contact points follow from the closest features. The
//! result never depends on what was kept.

use nalgebra::{Matrix3, Vector3};
use parry3d::math::{Pose, Vector};

use super::candidate::{Against, ContactCandidate, keep_four, tangents};
use super::detection::DetectionSettings;
use super::displacement::{BodyDisplacement, PENETRATION_ALLOWED};
use super::manifold::Manifold;
use super::travel::Travel;
use crate::model::collision::convex::{self, Convex, from_vector};
use crate::model::{Model, PAIR_POINTS};
use crate::scene::StepPlan;
use crate::sim::bodies::Bodies;
use crate::sim::per_body::Motions;
use crate::sim::spatial::SpatialMotion;

/// Beyond this distance from the common point or at this reach, m, a shape is left out: the numbers of the
/// state are about to become infinite.
const FARTHEST: f64 = 1e9;

/// A direction of a body, fixed and aligned with nothing, along which the points of a pair are put in order.
const ORDER: Vector3<f64> = Vector3::new(0.48, 0.62, 0.6208);

/// Pairs count as near up to this share of the mean reach of the shapes.
const NEAR: f64 = 0.5;

/// How far beyond the detection margin the distance of a pair is computed, as a share of the distance within which pairs count as near.
const AHEAD: f64 = 0.25;

/// Distances are distinguished down to this share of what counts as near.
const ROUNDING: f64 = 1e-6;

/// How many points of a pair may be added to those that the detection found.
const ADDED_POINTS: usize = 3;

/// Slots of a pair: for the points that are found in a step, for others that are found after an impact in it, and for those added.
const PAIR_SLOTS: usize = 2 * PAIR_POINTS + ADDED_POINTS;

/// Scratch memory for the detection of contacts between solids.
#[derive(Debug, Clone)]
pub struct Solids {
    /// Whether the character's shapes are tested against each other.
    self_collision: bool,
    /// Whether the joints are limited to their ranges, which keep some pairs apart.
    limited: bool,
    /// How far the character has moved.
    travel: Travel,
    /// Until shapes have come nearer to each other by this since the pairs were found, only those pairs can be in contact, m.
    valid: f64,
    /// Until they have come nearer by this, there is no contact, m.
    quiet: f64,
    /// Up to this distance pairs are near, m.
    reach: f64,
    /// Enclosing spheres of the shapes and then of the obstacles.
    spheres: Vec<BoundingSphere>,
    /// Indices of the spheres in the order of their lower ends along the sweep.
    order: Vec<usize>,
    /// Pairs that are near, in ascending order, and those before.
    near: Vec<NearPair>,
    before: Vec<NearPair>,
    /// Pairs that can be in contact within the detection margin.
    close: Vec<[usize; 2]>,
    manifold: Manifold,
}

/// The first slot of a pair of solids among the model's shapes and `obstacles` obstacles. Every point of a pair has a slot of its own,
/// whichever other pairs are in contact.
fn first_slot(model: &Model, obstacles: usize, [first, second]: [usize; 2]) -> usize {
    model.ground_slots + PAIR_SLOTS * (first * (model.solids.len() + obstacles) + second)
}

/// The first slot from `slot` on that none of `candidates` has.
pub fn free_slot(candidates: &[ContactCandidate], mut slot: usize) -> usize {
    while candidates.iter().any(|candidate| candidate.slot == slot) {
        slot += 1;
    }
    slot
}

#[derive(Debug, Clone, Copy)]
struct BoundingSphere {
    /// Relative to the common point, m.
    center: Vector3<f64>,
    radius: f64,
}

/// Two colliders that are near, the first of them a shape.
#[derive(Debug, Clone, Copy)]
struct NearPair {
    pair: [usize; 2],
    /// Until they have come nearer to each other by this since the pairs were found, they are not in contact, m.
    separation: f64,
    /// The axis along which they were apart when their distance was last computed, in the frame of the first's core.
    axis: Option<Vector>,
}

impl Solids {
    /// For the shapes of `model` against the obstacles of `plan` and, if it says so, against each other.
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let obstacles = plan.obstacles.len();
        let shapes = model.solids.len();
        let colliders = shapes + obstacles;
        let pairs = shapes * 16;
        let mean_reach = model.solids.iter().map(|solid| solid.reach).sum::<f64>() / shapes.max(1) as f64;
        Self {
            self_collision: plan.self_collision,
            // Without any limit in the model, joints go everywhere as it is.
            limited: plan.limits.is_some() || model.limits.iter().all(Option::is_none),
            travel: Travel::new(model, obstacles > 0),
            valid: 0.0,
            quiet: 0.0,
            reach: NEAR * mean_reach,
            spheres: Vec::with_capacity(colliders),
            order: (0..colliders).collect(),
            near: Vec::with_capacity(pairs),
            before: Vec::with_capacity(pairs),
            close: Vec::with_capacity(pairs),
            manifold: Manifold::new(),
        }
    }

    /// Adds all contact candidates to `candidates`, those of each pair together, in ascending order of the pairs.
    /// `angles` are those of the joints if `bodies` follow from them, `origin` is the common point in the world.
    #[allow(clippy::too_many_arguments)] // one call a step; every argument is a stage's result
    pub fn detect(
        &mut self,
        model: &Model,
        bodies: &Bodies,
        angles: Option<&[f64]>,
        obstacles: &[Convex],
        origin: Vector3<f64>,
        settings: &DetectionSettings,
        candidates: &mut Vec<ContactCandidate>,
    ) {
        let nearer = 2.0 * self.travel.update(model, bodies, origin, angles);
        let within = self.travel.measure_speeds(bodies, settings);
        self.close.clear();
        // A step with velocities beyond all bounds fails for them.
        if nearer + within < self.quiet || !within.is_finite() {
            return;
        }
        if nearer + within >= self.valid {
            // Without joint angles the motion until the next detection is unknown, so a longer range is of no use.
            let far = if angles.is_some() { self.reach } else { 0.0 };
            self.find(model, bodies, obstacles, origin, far + 2.0 * within);
        }
        self.quiet = self.valid;
        let shapes = model.solids.len();
        let upright = Matrix3::identity();
        let world = (&upright, -origin);
        for near in &mut self.near {
            let [first, second] = near.pair;
            let shape = &model.ground_shapes[first];
            let facing = model.ground_shapes.get(second);
            let bound = facing.map(|other| other.body);
            let (nearer, within) =
                (self.travel.nearer(shape.body, bound), self.travel.within(shape.body, bound, settings));
            if nearer + within < near.separation {
                self.quiet = self.quiet.min(near.separation);
                continue;
            }
            let opposite = facing.map(|other| bodies.at(other.body));
            let (other, against, others) = match (facing, &opposite) {
                (Some(other), Some(body)) => {
                    let against = Against::Link { link: other.link, body: other.body };
                    (&model.solids[second], against, (&body.rotation, body.origin))
                }
                _ => (&obstacles[second - shapes], Against::Obstacle(second - shapes), world),
            };
            let body = &bodies.at(shape.body);
            let own = (&body.rotation, body.origin);
            let solid = &model.solids[first];
            let known = nearer - ROUNDING * self.reach;
            if let Some(axis) = near.axis {
                let places = [solid.place(own.0, own.1), other.place(others.0, others.1)];
                near.separation = known + solid.apart_along(other, places, axis);
                if nearer + within < near.separation {
                    self.quiet = self.quiet.min(near.separation);
                    continue;
                }
            }
            let far = within + AHEAD * self.reach;
            let place = solid.placed(&convex::frame(own.0, own.1));
            let pose: Pose = place.inverse() * other.placed(&convex::frame(others.0, others.1));
            let approach = match solid.approach(other, &pose, far) {
                Ok(approach) => approach,
                Err(axis) => {
                    (near.axis, near.separation) = (Some(axis), known + far);
                    self.quiet = self.quiet.min(near.separation);
                    continue;
                }
            };
            (near.axis, near.separation) = (Some(approach.normal), known + approach.gap);
            self.quiet = self.quiet.min(near.separation);
            if approach.gap > within {
                continue;
            }
            self.close.push(near.pair);
            let up = from_vector(place.rotation * -approach.normal);
            let [across, beside] = tangents(up);
            let from = candidates.len();
            for manifold_point in self.manifold.meet(solid, other, &pose, &approach) {
                let own = from_vector(place * manifold_point.first);
                let at = match against {
                    Against::Link { .. } => (own + from_vector(place * manifold_point.second)) / 2.0,
                    Against::Ground | Against::Obstacle(_) => own,
                };
                let mut candidate = ContactCandidate {
                    slot: 0,
                    link: shape.link,
                    body: shape.body,
                    against,
                    at,
                    frame: [up, across, beside],
                    depth: -manifold_point.gap,
                    rebound: 0.0,
                    material: ContactCandidate::SMOOTH,
                };
                let speed = -up.dot(&candidate.slip(|body| bodies.at(body).velocity));
                if manifold_point.gap <= settings.margin(speed).min(within) {
                    candidate.rebound = settings.rebound(speed);
                    candidates.push(candidate);
                }
            }
            keep_four(candidates, from);
            let place_in_order = |candidate: &ContactCandidate| {
                (body.rotation.tr_mul(&(candidate.at - body.origin))).dot(&ORDER)
            };
            candidates[from..].sort_unstable_by(|a, b| place_in_order(a).total_cmp(&place_in_order(b)));
            let first_slot = first_slot(model, obstacles.len(), near.pair);
            for (index, candidate) in candidates[from..].iter_mut().enumerate() {
                candidate.slot = first_slot + index;
            }
        }
    }

    /// Adds the points of close pairs that the step would drive into each other at the bodies' velocities `new`, as
    /// [`super::ground::add_driven_in`] does; whether there are any.
    #[allow(clippy::too_many_arguments)] // as of `detect`
    pub fn add_driven_in(
        &self,
        model: &Model,
        bodies: &Bodies,
        new: &Motions,
        obstacles: &[Convex],
        origin: Vector3<f64>,
        step: f64,
        candidates: &mut Vec<ContactCandidate>,
    ) -> bool {
        let before = candidates.len();
        let shapes = model.solids.len();
        let allowed = PENETRATION_ALLOWED * model.size;
        for &[first, second] in &self.close {
            let shape = &model.ground_shapes[first];
            let other = model.ground_shapes.get(second);
            let against = match other {
                Some(other) => Against::Link { link: other.link, body: other.body },
                None => Against::Obstacle(second - shapes),
            };
            let same =
                |candidate: &&ContactCandidate| (candidate.link, candidate.against) == (shape.link, against);
            if candidates.iter().filter(same).count() >= PAIR_POINTS + ADDED_POINTS {
                continue;
            }
            let moves = other.map_or(SpatialMotion::ZERO, |other| new.at(other.body));
            let passing = new.at(shape.body).minus(moves);
            let solid = &model.solids[first];
            let center = bodies.at(shape.body).point(solid.center);
            if (passing.at(center).norm() + passing.angular.norm() * solid.reach) * step < allowed {
                continue;
            }
            let moved = |body: usize| BodyDisplacement::new(&bodies.at(body), new.at(body), step);
            let placed = |solid: &Convex, body: usize, moved: &BodyDisplacement| {
                let rotation = moved.rotation.matrix() * bodies.at(body).rotation;
                solid.placed(&convex::frame(&rotation, moved.origin + moved.shift))
            };
            let own = moved(shape.body);
            let others = other.map(|other| moved(other.body));
            let place = placed(solid, shape.body, &own);
            let (facing, facing_place) = match (other, &others) {
                (Some(other), Some(moved)) => {
                    (&model.solids[second], placed(&model.solids[second], other.body, moved))
                }
                _ => {
                    let obstacle = &obstacles[second - shapes];
                    (obstacle, obstacle.placed(&convex::frame(&Matrix3::identity(), -origin)))
                }
            };
            let Ok(approach) = solid.approach(facing, &(place.inverse() * facing_place), 0.0) else {
                continue;
            };
            let up = from_vector(place.rotation * -approach.normal);
            let [across, beside] = tangents(up);
            let [own_end, other_end] =
                [approach.first, approach.second].map(|point| from_vector(place * point));
            let own_at = own.point_back(own_end);
            let (other_at, at) = match &others {
                Some(moved) => {
                    let other_at = moved.point_back(other_end);
                    (other_at, (own_at + other_at) / 2.0)
                }
                None => (other_end, own_at),
            };
            let depth = (other_at - own_at).dot(&up);
            if -approach.gap < depth.max(0.0) + allowed {
                continue;
            }
            candidates.push(ContactCandidate {
                slot: free_slot(candidates, first_slot(model, obstacles.len(), [first, second])),
                link: shape.link,
                body: shape.body,
                against,
                at,
                frame: [up, across, beside],
                depth,
                rebound: 0.0,
                material: ContactCandidate::SMOOTH,
            });
        }
        candidates.len() > before
    }

    /// Finds the pairs that are less than `distance` apart, and restarts the bounds of travel.
    fn find(
        &mut self,
        model: &Model,
        bodies: &Bodies,
        obstacles: &[Convex],
        origin: Vector3<f64>,
        distance: f64,
    ) {
        self.spheres.clear();
        for (shape, solid) in model.ground_shapes.iter().zip(&model.solids) {
            self.spheres.push(BoundingSphere {
                center: bodies.at(shape.body).point(solid.center),
                radius: solid.reach,
            });
        }
        for obstacle in obstacles {
            self.spheres.push(BoundingSphere { center: obstacle.center - origin, radius: obstacle.reach });
        }
        std::mem::swap(&mut self.near, &mut self.before);
        self.sweep(model, distance);
        let mut known = self.before.iter().peekable();
        for near in &mut self.near {
            while known.next_if(|other| other.pair < near.pair).is_some() {}
            if let Some(other) = known.next_if(|other| other.pair == near.pair) {
                let [body, bound] =
                    other.pair.map(|shape| model.ground_shapes.get(shape).map(|shape| shape.body));
                let nearer = body.map_or(f64::INFINITY, |body| self.travel.nearer(body, bound));
                *near = NearPair { separation: other.separation - nearer, ..*other };
            }
        }
        self.valid = distance;
        self.travel.measure(model, distance);
    }

    /// Fills `near` with the pairs whose spheres are less than `distance` apart.
    fn sweep(&mut self, model: &Model, distance: f64) {
        let Self { self_collision, limited, spheres, order, near, .. } = self;
        near.clear();
        let within_reach = |sphere: &BoundingSphere| sphere.center.amax() + sphere.radius < FARTHEST;
        let shapes = model.solids.len();
        let (mut lowest, mut highest) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for sphere in &spheres[..] {
            lowest = lowest.inf(&sphere.center);
            highest = highest.sup(&sphere.center);
        }
        let axis = (highest - lowest).imax();
        let lower = |index: usize| spheres[index].center[axis] - spheres[index].radius;
        order.sort_unstable_by(|a, b| lower(*a).total_cmp(&lower(*b)).then(a.cmp(b)));
        for (position, &one) in order.iter().enumerate() {
            let sphere = &spheres[one];
            if !within_reach(sphere) {
                continue;
            }
            let upper = sphere.center[axis] + sphere.radius + distance;
            for &two in &order[position + 1..] {
                let other = &spheres[two];
                if other.center[axis] - other.radius > upper {
                    break;
                }
                let pair = [one.min(two), one.max(two)];
                let possible = match (pair[0] < shapes, pair[1] < shapes) {
                    (true, true) => *self_collision && model.pairs.can_touch(pair[0], pair[1], *limited),
                    (true, false) => !(model.fixed_base && model.ground_shapes[pair[0]].body == 0),
                    (false, _) => false,
                };
                let reach = sphere.radius + other.radius + distance;
                if possible
                    && within_reach(other)
                    && (sphere.center - other.center).norm_squared() < reach * reach
                {
                    near.push(NearPair { pair, separation: f64::NEG_INFINITY, axis: None });
                }
            }
        }
        near.sort_unstable_by_key(|near| near.pair);
    }
}
