//! Articulated-body dynamics (Featherstone 2008, chapter 7) with joint springs and dampers inside.
//!
//! One sweep from the leaves to the root gives every joint's share of the mass matrix's factor; another, and one
//! back, give the velocities that the character would have after the step if no row acted. The work grows with
//! the number of bodies.
//!
//! A joint that is driven toward a target has its spring and damper in the factor: eliminating
//! λ_s = f₀ − K (q − q*) − (D + K h)(q̇⁺ − v*) from the rows s (Tokizaki & Hasegawa eqs. 19-20) adds
//! h (D + K h) to the joint's entry of the mass matrix, so that tracking costs no row.

use super::root::RootFactor;
use crate::model::Model;
use crate::sim::bodies::BodyMotion;
use crate::sim::joint_load::JointLoad;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::{ArticulatedInertia, SpatialForce, SpatialMotion};
use multiversion::multiversion;

/// A joint's share of the factorised mass matrix.
#[derive(Debug, Clone, Copy)]
pub struct JointFactor {
    /// Force on the joint's body that goes with a unit of joint acceleration.
    pub u: SpatialForce,
    /// Inverse of the inertia felt along the joint, 1/(kg m²); 0 for a joint whose acceleration is given.
    pub inverse_d: f64,
    /// Its square root.
    pub root_inverse_d: f64,
}

/// The factor of a step's mass matrix and the sweeps' intermediate values.
#[derive(Debug, Clone)]
pub struct Articulated {
    /// One a joint.
    pub joints: Vec<JointFactor>,
    /// The root's factor.
    pub root: RootFactor,
    /// Bias acceleration of each body: that by the velocities alone, if neither the root nor a joint accelerates. (prepare)
    bias_acceleration: Vec<SpatialMotion>,
    /// Bias force of each body: what its velocity and its bias acceleration require. (prepare)
    bias_force: Vec<SpatialForce>,
    inertia: Vec<ArticulatedInertia>,
    articulated_bias: Vec<SpatialForce>,
    /// Joint force less that of the articulated bias, N m or N. (accelerate)
    net: Vec<f64>,
    /// Acceleration of each body besides its bias acceleration.
    acceleration: Vec<SpatialMotion>,
}

/// The mass matrix is not positive definite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Singular {
    /// Nothing resists the acceleration of this joint.
    Joint(usize),
    /// Nothing resists some acceleration of the root.
    Root,
}

impl Articulated {
    /// Room for a model of `bodies` bodies.
    pub fn new(bodies: usize) -> Self {
        let zero = ArticulatedInertia::from(crate::sim::spatial::RigidInertia::ZERO);
        let factor = JointFactor { u: SpatialForce::ZERO, inverse_d: 0.0, root_inverse_d: 0.0 };
        Self {
            joints: vec![factor; bodies - 1],
            root: RootFactor::EMPTY,
            bias_acceleration: vec![SpatialMotion::ZERO; bodies],
            bias_force: vec![SpatialForce::ZERO; bodies],
            inertia: vec![zero; bodies],
            articulated_bias: vec![SpatialForce::ZERO; bodies],
            net: vec![0.0; bodies - 1],
            acceleration: vec![SpatialMotion::ZERO; bodies],
        }
    }

    /// Acceleration of body `index` by the velocities alone, with neither the root nor a joint accelerating.
    #[inline]
    pub fn bias_acceleration(&self, index: usize) -> SpatialMotion {
        self.bias_acceleration[index]
    }

    /// Bias force of body `index`: what it requires if neither the root nor a joint accelerates.
    #[inline]
    pub fn bias_force(&self, index: usize) -> SpatialForce {
        self.bias_force[index]
    }
}

/// Velocity-dependent forces of every body. In a simulation without them this is never called, and they
/// stay zero.
///
/// They are taken together with the acceleration that the velocities alone bring, S q̈ and the root's
/// acceleration left out, so that what remains to be solved is linear in those without a constant.
#[multiversion(targets("x86_64+avx2"))]
pub fn prepare(factor: &mut Articulated, model: &Model, bodies: &[BodyMotion], joint_rates: &[f64]) {
    for &index in &model.outward {
        let parent = model.bodies[index].parent;
        let by_velocity = bodies[parent].velocity.cross_motion(bodies[index].motion_subspace);
        factor.bias_acceleration[index] =
            factor.bias_acceleration[parent].plus_scaled(by_velocity, joint_rates[index - 1]);
    }
    for ((bias_force, bias_acceleration), body) in
        factor.bias_force.iter_mut().zip(&factor.bias_acceleration).zip(bodies)
    {
        let momentum = body.inertia.times(body.velocity);
        *bias_force = body.velocity.cross_force(momentum).plus(body.inertia.times(*bias_acceleration));
    }
}

/// Factorises the mass matrix under `loads`.
///
/// # Errors
/// [`Singular`] where nothing resists an acceleration.
#[multiversion(targets("x86_64+avx2"))]
pub fn factorise(
    factor: &mut Articulated,
    model: &Model,
    bodies: &[BodyMotion],
    loads: &[JointLoad],
    freedom: RootFreedom,
) -> Result<(), Singular> {
    for (inertia, body) in factor.inertia.iter_mut().zip(bodies) {
        *inertia = body.inertia.into();
    }
    for &index in model.outward.iter().rev() {
        let joint = index - 1;
        let along = bodies[index].motion_subspace;
        let (before, after) = factor.inertia.split_at_mut(index);
        let u = after[0].times(along);
        let d = along.dot(u) + loads[joint].inertia;
        if d.is_nan() || d <= 0.0 {
            return Err(Singular::Joint(joint));
        }
        let inverse_d = if loads[joint].held.is_some() { 0.0 } else { 1.0 / d };
        before[model.bodies[index].parent].add_reduced(&after[0], u, inverse_d);
        factor.joints[joint] = JointFactor { u, inverse_d, root_inverse_d: inverse_d.sqrt() };
    }
    factor.root = RootFactor::new(freedom, &factor.inertia[0]).ok_or(Singular::Root)?;
    Ok(())
}

/// The accelerations without any row, under the factorised `loads` and the prepared bias forces: those of
/// the joints into `joint_acceleration`, and the root's as the result.
///
/// `minus_gravity` is the acceleration −g, which stands for the bodies' weights. `prescribed` is the acceleration of the
/// root in the directions in which it is not free.
#[allow(clippy::too_many_arguments)] // one call a step; every argument is a stage's result
#[multiversion(targets("x86_64+avx2"), attrs(allow(clippy::too_many_arguments)))]
pub fn accelerate(
    factor: &mut Articulated,
    model: &Model,
    bodies: &[BodyMotion],
    loads: &[JointLoad],
    freedom: RootFreedom,
    minus_gravity: SpatialMotion,
    prescribed: SpatialMotion,
    joint_acceleration: &mut [f64],
) -> SpatialMotion {
    factor.articulated_bias.copy_from_slice(&factor.bias_force);
    for &index in model.outward.iter().rev() {
        let joint = index - 1;
        let share = &factor.joints[joint];
        let net = loads[joint].torque - bodies[index].motion_subspace.dot(factor.articulated_bias[index]);
        let by_itself = loads[joint].held.unwrap_or(net * share.inverse_d);
        let handed_on = factor.articulated_bias[index].plus_scaled(share.u, by_itself);
        let parent = model.bodies[index].parent;
        factor.articulated_bias[parent] = factor.articulated_bias[parent].plus(handed_on);
        factor.net[joint] = net;
    }
    let prescribed_minus_gravity = match freedom {
        RootFreedom::Fixed => minus_gravity,
        _ => prescribed,
    };
    let root = factor.root.accelerate(
        &factor.inertia[0],
        factor.articulated_bias[0].scaled(-1.0),
        prescribed_minus_gravity,
    );
    factor.acceleration[0] = root;
    for &index in &model.outward {
        let joint = index - 1;
        let share = &factor.joints[joint];
        let of_parent = factor.acceleration[model.bodies[index].parent];
        let by_itself = (factor.net[joint] - of_parent.dot(share.u)) * share.inverse_d;
        let acceleration = loads[joint].held.unwrap_or(by_itself);
        joint_acceleration[joint] = acceleration;
        factor.acceleration[index] = of_parent.plus_scaled(bodies[index].motion_subspace, acceleration);
    }
    root.plus(minus_gravity.scaled(-1.0))
}
