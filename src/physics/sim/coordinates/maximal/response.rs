//! The response of single bodies to wrenches: M = L Lᵀ of every body, and rows half-solved by it.

use std::ops::Range;

use nalgebra::{Matrix3, Vector3};

use crate::model::wide::{LANES, Lanes};
use crate::model::{Body, Model};
use crate::sim::bodies::{Bodies, BodyMotion};
use crate::sim::per_body::Motions;
use crate::sim::rows::ROOT;
use crate::sim::spatial::{SpatialForce, SpatialMotion};

/// Numbers of a half-solved row that belong to a body: of the force, and of the moment about its
/// centre of mass.
const BODY: usize = ROOT;

/// The factor of a body's inertia about its centre of mass, in the body frame. It never changes.
#[derive(Debug, Clone, Copy)]
pub struct BodyFactor {
    /// 1 / √mass.
    root_inverse_mass: f64,
    /// The inverse of Cholesky's factor of the rotational inertia.
    inverse_lower: Matrix3<f64>,
}

impl BodyFactor {
    /// Of a body that is fixed to the world.
    pub const FIXED: Self = Self {
        root_inverse_mass: 0.0,
        inverse_lower: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// Of `body`. Without mass or a positive definite inertia
    /// ([`Model::body_without_inertia`](crate::model::Model::body_without_inertia)) there is none, and the
    /// body does not move.
    pub fn new(body: &Body) -> Self {
        let lower = body.inertia.cholesky().map(|factor| factor.l());
        match lower.and_then(|lower| lower.solve_lower_triangular(&Matrix3::identity())) {
            Some(inverse_lower) if body.mass > 0.0 => {
                Self { root_inverse_mass: 1.0 / body.mass.sqrt(), inverse_lower }
            }
            _ => Self::FIXED,
        }
    }

    /// Whether the body is fixed to the world.
    pub fn is_fixed(&self) -> bool {
        self.root_inverse_mass == 0.0
    }

    /// L⁻¹ of `force`, which is about the common point.
    #[inline]
    fn half_solve(&self, body: &BodyMotion, force: SpatialForce) -> [f64; BODY] {
        let moment = force.moment - body.center.cross(&force.force);
        let linear = force.force * self.root_inverse_mass;
        let angular = self.inverse_lower * body.rotation.tr_mul(&moment);
        [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
    }

    /// L⁻ᵀ of `half`: the change of velocity about the common point.
    #[inline]
    fn finish(&self, body: &BodyMotion, half: &[f64]) -> SpatialMotion {
        let number = |index: usize| half.get(index).copied().unwrap_or_default();
        let linear = Vector3::new(number(0), number(1), number(2)) * self.root_inverse_mass;
        let angular =
            body.rotation * self.inverse_lower.tr_mul(&Vector3::new(number(3), number(4), number(5)));
        SpatialMotion { angular, linear: linear + body.center.cross(&angular) }
    }

    /// Acceleration of the body under `force`, both about the common point.
    #[inline]
    pub fn accelerate(&self, body: &BodyMotion, force: SpatialForce) -> SpatialMotion {
        self.finish(body, &self.half_solve(body, force))
    }
}

/// The changes of velocity of all `bodies` by the half-solved impulse `half`, about the common point.
pub fn finish(factors: &[BodyFactor], bodies: &Bodies, half: &[f64], changes: &mut Motions) {
    for (index, (factor, half)) in factors.iter().zip(half.chunks_exact(BODY)).enumerate() {
        changes.set(index, factor.finish(&bodies.at(index), half));
    }
}

/// Half-solves units of the rows that are `forces`, no more than [`LANES`], on body `body`, and the opposite on body
/// `other` if there is one: appends side by side to `numbers` [`BODY`] of the root and then as many for each body in the
/// range of places that it gives.
pub fn of_bodies(
    factors: &[BodyFactor],
    bodies: &Bodies,
    body: usize,
    other: Option<usize>,
    forces: &[SpatialForce],
    numbers: &mut Vec<Lanes>,
) -> Range<usize> {
    let of = |body: usize| BODY * body.max(1)..BODY * (body + 1);
    let places = match (body, other) {
        (_, None | Some(0)) => of(body),
        (0, Some(other)) => of(other),
        (body, Some(other)) => of(body.min(other)).start..of(body.max(other)).end,
    };
    let start = numbers.len();
    numbers.resize(start + BODY + places.len(), [0.0; LANES]);
    let added = &mut numbers[start..];
    let mut fill = |body: usize, sign: f64| {
        let at = if body == 0 { 0 } else { BODY + BODY * body - places.start };
        for (lane, force) in forces.iter().enumerate() {
            let half = factors[body].half_solve(&bodies.at(body), force.scaled(sign));
            for (lanes, number) in added[at..].iter_mut().zip(half) {
                lanes[lane] = number;
            }
        }
    };
    fill(body, 1.0);
    if let Some(other) = other {
        fill(other, -1.0);
    }
    places
}

/// The wrench on its child body of a unit of force along the joint of `body`: a moment about its
/// axis, or a force along it.
pub fn along(body: &BodyMotion) -> SpatialForce {
    let axis = body.motion_subspace.angular;
    if axis == Vector3::zeros() {
        SpatialForce::at(body.origin, body.motion_subspace.linear)
    } else {
        SpatialForce { moment: axis, force: Vector3::zeros() }
    }
}

/// Velocity of joint `joint` when its bodies have the velocities `velocities`, rad/s or m/s.
pub fn rate(model: &Model, bodies: &Bodies, joint: usize, velocities: &Motions) -> f64 {
    let (child, parent) = (joint + 1, model.bodies[joint + 1].parent);
    velocities.at(child).minus(velocities.at(parent)).dot(along(&bodies.at(child)))
}
