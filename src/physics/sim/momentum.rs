//! The momentum of a character, and the rigid motion that restores it.
//!
//! A step solves for velocities at one pose and then moves the bodies to another, where the same joint velocities
//! belong to another momentum: the difference is the scheme's error, of second order in the step for the paper's scheme
//! and of third order for Moreau and Jean's. Between joints, motors, limits and links of the same character forces come
//! in opposite pairs, so that in flight the momentum at the new pose is known: it is the old one and the impulse of the
//! weight. A rigid motion of the whole character makes up the difference. It leaves every joint velocity and every
//! velocity of one link relative to another as they are, and it costs one composite inertia: with the bodies fixed to
//! each other the kinetic energy is a sum of that of the rigid motion and that of the joint velocities, which do not mix
//! (Wieber 2006, "Holonomy and nonholonomy in the dynamics of articulated motion").

use multiversion::multiversion;
use nalgebra::Vector3;

use super::bodies::Bodies;
use super::spatial::{RigidInertia, SpatialForce, SpatialMotion, WideForce, WideInertia, WideMotion};
use crate::model::wide::{LANES, Wide};

/// Momentum of a character in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Momentum {
    /// Linear momentum, kg m/s.
    pub linear: Vector3<f64>,
    /// Angular momentum about the centre of mass, kg m²/s.
    pub angular: Vector3<f64>,
}

impl Momentum {
    /// Kinetic energy of the centre of mass of `mass` kg, J.
    pub(super) fn energy_of_center(self, mass: f64) -> f64 {
        0.5 * self.linear.norm_squared() / mass
    }

    /// This momentum after `time` seconds in which only the weight of `mass` kg under `gravity` acted.
    pub(super) fn after_flight(self, mass: f64, gravity: Vector3<f64>, time: f64) -> Self {
        Self { linear: self.linear + gravity * (mass * time), ..self }
    }
}

/// Inertia of all bodies together, and the momentum that the joint velocities alone give them, about the common point.
///
/// Neither depends on the root's velocity, so that both still hold when that has been corrected.
#[derive(Debug, Clone, Copy)]
pub(super) struct Composite {
    inertia: RigidInertia,
    of_joints: SpatialForce,
}

impl Composite {
    /// Of no bodies.
    pub const EMPTY: Self = Self { inertia: RigidInertia::ZERO, of_joints: SpatialForce::ZERO };

    /// Of `bodies` that move as they do while the root is at rest.
    pub fn new(bodies: &Bodies) -> Self {
        add_up(bodies)
    }

    /// The momentum when the root moves with `root`.
    pub fn momentum(&self, root: SpatialMotion) -> Momentum {
        let SpatialForce { moment, force } = self.of_joints.plus(self.inertia.times(root));
        Momentum { linear: force, angular: moment - self.center().cross(&force) }
    }

    /// The rigid motion, about the common point, that gives the momentum `wanted` when it is added to the velocities of all
    /// bodies, of which the root's is `root`; `None` for bodies without mass or without inertia about some axis.
    pub fn correction(&self, root: SpatialMotion, wanted: Momentum) -> Option<SpatialMotion> {
        let RigidInertia { mass, first_moment, rotational } = self.inertia;
        let center = self.center();
        let Momentum { linear, angular } = self.momentum(root);
        let (push, turn) = (wanted.linear - linear, wanted.angular - angular);
        // Steiner: the inertia about the centre of mass.
        let [x, y, z] = [center.x, center.y, center.z];
        let [mx, my, mz] = [first_moment.x, first_moment.y, first_moment.z];
        let [xx, yy, zz] = [
            rotational[(0, 0)] - (my * y + mz * z),
            rotational[(1, 1)] - (mx * x + mz * z),
            rotational[(2, 2)] - (mx * x + my * y),
        ];
        let [xy, xz, yz] =
            [rotational[(0, 1)] + mx * y, rotational[(0, 2)] + mx * z, rotational[(1, 2)] + my * z];
        // L D Lᵀ of three rows.
        let by_xx = 1.0 / xx;
        let (l21, l31) = (xy * by_xx, xz * by_xx);
        let d2 = yy - l21 * xy;
        let by_d2 = 1.0 / d2;
        let l32 = (yz - l31 * xy) * by_d2;
        let d3 = zz - l31 * xz - l32 * l32 * d2;
        let positive = mass > 0.0 && xx > 0.0 && d2 > 0.0 && d3 > 0.0;
        let below = turn.y - l21 * turn.x;
        let last = (turn.z - l31 * turn.x - l32 * below) / d3;
        let middle = below * by_d2 - l32 * last;
        let angular = Vector3::new(turn.x * by_xx - l21 * middle - l31 * last, middle, last);
        let motion = SpatialMotion { angular, linear: push * (1.0 / mass) - angular.cross(&center) };
        (positive && motion.amax().is_finite()).then_some(motion)
    }

    /// The rigid motion, about the common point, that has the momentum `wanted` by itself; `None` as in
    /// [`correction`](Self::correction).
    pub fn rigid_motion(&self, wanted: Momentum) -> Option<SpatialMotion> {
        Self { of_joints: SpatialForce::ZERO, ..*self }.correction(SpatialMotion::ZERO, wanted)
    }

    /// Kinetic energy of the rigid motion `motion`, J.
    pub fn kinetic_energy(&self, motion: SpatialMotion) -> f64 {
        0.5 * motion.dot(self.inertia.times(motion))
    }

    fn center(&self) -> Vector3<f64> {
        self.inertia.first_moment * (1.0 / self.inertia.mass)
    }
}

/// Adds up `bodies` and their momentum.
#[multiversion(targets("x86_64+avx2"))]
fn add_up(bodies: &Bodies) -> Composite {
    let mut inertia = Wide::all(RigidInertia::ZERO);
    let mut momentum = Wide::all(SpatialForce::ZERO);
    for (placed, velocities) in bodies.groups.iter().zip(&bodies.velocity.groups).skip(1) {
        gather(&placed.inertia, velocities, &mut inertia, &mut momentum);
    }
    let root = bodies.at(0);
    Composite {
        inertia: inertia.sum().plus(root.inertia),
        of_joints: momentum.sum().plus(root.inertia.times(root.velocity)),
    }
}

/// Adds bodies of these inertias and velocities, and their momentum, to what is in the lanes already.
#[multiversion(targets("x86_64+avx2"))]
fn gather(
    inertias: &WideInertia,
    velocities: &WideMotion,
    inertia: &mut WideInertia,
    momentum: &mut WideForce,
) {
    for lane in 0..LANES {
        let own = inertias.at(lane);
        momentum.set(lane, momentum.at(lane).plus(own.times(velocities.at(lane))));
    }
    inertia.add(inertias);
}
