//! Contact of the character's shapes with each other and with the obstacles of the scene.
//!
//! Shapes whose enclosing balls can meet within two steps are found by sweeping along the world axis along
//! which they are spread most; of those that may touch at all ([`crate::model::collision::pairs`]), the
//! points where they meet follow from their closest features.

use nalgebra::{Matrix3, Vector3};
use rapier3d::parry::math::{Pose, Vector};

use super::manifold::Manifold;
use super::{Against, Outlook, Touch, keep_four, tangents};
use crate::model::collision::convex::{self, Convex, Place, from_vector};
use crate::model::{Model, SOLID_SLOTS};
use crate::sim::reduced::kinematics::BodyMotion;

/// Beyond this distance from the common point or at this reach, m, a shape is left out: the numbers of the
/// state are about to become infinite.
const FARTHEST: f64 = 1e9;

/// A direction of a body, fixed and aligned with nothing, along which the points of a pair are put in order.
const ORDER: Vector3<f64> = Vector3::new(0.48, 0.62, 0.6208);

/// Scratch memory for finding touches of solids.
#[derive(Debug, Clone)]
pub struct Solids {
    /// Whether the character's shapes are tested against each other.
    itself: bool,
    /// Enclosing balls of the shapes and then of the obstacles, larger by what they move within two steps.
    balls: Vec<Ball>,
    /// Where the cores of the shapes and of the obstacles are, relative to the common point.
    places: Vec<Place>,
    /// Indices of the balls in the order of their lower ends along the sweep.
    order: Vec<usize>,
    /// Pairs whose balls meet, in ascending order, at this step and at the last.
    near: Vec<Near>,
    before: Vec<Near>,
    /// Number of slots of each shape that this step has used.
    used: Vec<usize>,
    manifold: Manifold,
}

#[derive(Debug, Clone, Copy)]
struct Ball {
    /// Relative to the common point, m.
    center: Vector3<f64>,
    radius: f64,
}

/// Two colliders whose balls meet, the first of them a shape.
#[derive(Debug, Clone, Copy)]
struct Near {
    pair: [usize; 2],
    /// An axis that separates them, or did at an earlier step, in the frame of the first's core: where it
    /// still does, nothing else is computed, so that what it is never matters to the result.
    axis: Vector,
}

impl Solids {
    /// For the shapes of `model` against `obstacles` obstacles and, if so, against each other (`itself`).
    pub fn new(model: &Model, itself: bool, obstacles: usize) -> Self {
        let shapes = model.solids.len();
        let colliders = shapes + obstacles;
        let pairs = shapes * 8;
        Self {
            itself,
            balls: Vec::with_capacity(colliders),
            places: Vec::with_capacity(colliders),
            order: (0..colliders).collect(),
            near: Vec::with_capacity(pairs),
            before: Vec::with_capacity(pairs),
            used: vec![0; shapes],
            manifold: Manifold::new(),
        }
    }

    /// Adds all touches to `touches`, those of each pair together, in ascending order of the pairs.
    /// `origin` is the common point in the world.
    pub fn detect(
        &mut self,
        model: &Model,
        bodies: &[BodyMotion],
        obstacles: &[Convex],
        origin: Vector3<f64>,
        outlook: &Outlook,
        touches: &mut Vec<Touch>,
    ) {
        self.enclose(model, bodies, obstacles, origin, outlook);
        self.sweep(model);
        self.used.fill(0);
        let shapes = model.solids.len();
        let upright = Matrix3::identity();
        let world = (&upright, -origin);
        for near in &mut self.near {
            let [first, second] = near.pair;
            let shape = &model.ground_shapes[first];
            let (other, against, others) = match model.ground_shapes.get(second) {
                Some(other) => {
                    let body = &bodies[other.body];
                    let against = Against::Link { link: other.link, body: other.body };
                    (&model.solids[second], against, (&body.rotation, body.origin))
                }
                None => (&obstacles[second - shapes], Against::Obstacle(second - shapes), world),
            };
            let body = &bodies[shape.body];
            let own = (&body.rotation, body.origin);
            let solid = &model.solids[first];
            let within = self.balls[first].radius - solid.reach + self.balls[second].radius - other.reach;
            if solid.is_apart(&self.places[first], other, &self.places[second], within, near.axis) {
                continue;
            }
            let place = solid.placed(&convex::frame(own.0, own.1));
            let pose: Pose = place.inverse() * other.placed(&convex::frame(others.0, others.1));
            let approach = match solid.approach(other, &pose, within) {
                Ok(approach) => approach,
                Err(axis) => {
                    near.axis = axis;
                    continue;
                }
            };
            let up = from_vector(place.rotation * -approach.normal);
            let [across, beside] = tangents(up);
            let from = touches.len();
            for meeting in self.manifold.meet(solid, other, &pose, &approach) {
                let own = from_vector(place * meeting.first);
                let at = match against {
                    Against::Link { .. } => (own + from_vector(place * meeting.second)) / 2.0,
                    Against::Ground | Against::Obstacle(_) => own,
                };
                let mut touch = Touch {
                    slot: 0,
                    link: shape.link,
                    body: shape.body,
                    against,
                    at,
                    frame: [up, across, beside],
                    depth: -meeting.gap,
                    rebound: 0.0,
                };
                let speed = -up.dot(&touch.slip(|body| bodies[body].velocity));
                if meeting.gap <= outlook.margin(speed) {
                    touch.rebound = outlook.rebound(speed);
                    touches.push(touch);
                }
            }
            keep_four(touches, from);
            let place_in_order =
                |touch: &Touch| (body.rotation.tr_mul(&(touch.at - body.origin))).dot(&ORDER);
            touches[from..].sort_unstable_by(|a, b| place_in_order(a).total_cmp(&place_in_order(b)));
            for touch in &mut touches[from..] {
                // Touches beyond a shape's slots share the last one: what is remembered there is only where
                // the solver starts from.
                touch.slot = model.ground_slots + SOLID_SLOTS * first + self.used[first].min(SOLID_SLOTS - 1);
                self.used[first] += 1;
            }
        }
    }

    fn enclose(
        &mut self,
        model: &Model,
        bodies: &[BodyMotion],
        obstacles: &[Convex],
        origin: Vector3<f64>,
        outlook: &Outlook,
    ) {
        self.balls.clear();
        self.places.clear();
        for (shape, solid) in model.ground_shapes.iter().zip(&model.solids) {
            let body = &bodies[shape.body];
            let center = body.point(solid.center);
            // The fastest point of the shape is no faster than its centre plus the ball's rim.
            let speed = body.velocity.at(center).norm() + body.velocity.angular.norm() * solid.reach;
            self.balls.push(Ball { center, radius: solid.reach + outlook.margin(speed) });
            self.places.push(solid.place(&body.rotation, body.origin));
        }
        for obstacle in obstacles {
            self.balls.push(Ball { center: obstacle.center - origin, radius: obstacle.reach });
            self.places.push(obstacle.place(&Matrix3::identity(), -origin));
        }
    }

    /// Fills `near` with the pairs whose balls meet.
    fn sweep(&mut self, model: &Model) {
        let Self { itself, balls, order, near, before, .. } = self;
        std::mem::swap(near, before);
        near.clear();
        let within_reach = |ball: &Ball| ball.center.amax() + ball.radius < FARTHEST;
        let shapes = model.solids.len();
        let (mut lowest, mut highest) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for ball in &balls[..] {
            lowest = lowest.inf(&ball.center);
            highest = highest.sup(&ball.center);
        }
        let axis = (highest - lowest).imax();
        let lower = |index: usize| balls[index].center[axis] - balls[index].radius;
        order.sort_unstable_by(|a, b| lower(*a).total_cmp(&lower(*b)).then(a.cmp(b)));
        for (position, &one) in order.iter().enumerate() {
            let ball = &balls[one];
            if !within_reach(ball) {
                continue;
            }
            let upper = ball.center[axis] + ball.radius;
            for &two in &order[position + 1..] {
                let other = &balls[two];
                if other.center[axis] - other.radius > upper {
                    break;
                }
                let pair = [one.min(two), one.max(two)];
                let possible = match (pair[0] < shapes, pair[1] < shapes) {
                    (true, true) => *itself && model.pairs.can_touch(pair[0], pair[1]),
                    (true, false) => !(model.fixed_base && model.ground_shapes[pair[0]].body == 0),
                    (false, _) => false,
                };
                let reach = ball.radius + other.radius;
                if possible
                    && within_reach(other)
                    && (ball.center - other.center).norm_squared() < reach * reach
                {
                    near.push(Near { pair, axis: Vector::Z });
                }
            }
        }
        near.sort_unstable_by_key(|near| near.pair);
        let mut known = before.iter().peekable();
        for near in near.iter_mut() {
            while known.next_if(|other| other.pair < near.pair).is_some() {}
            if let Some(other) = known.next_if(|other| other.pair == near.pair) {
                near.axis = other.axis;
            }
        }
    }
}
