//! Articulated-body dynamics (Featherstone 2008, chapter 7) with joint springs and dampers inside.
//!
//! One sweep from the leaves to the root gives every joint's share of the mass matrix's factor; another, and one
//! back, give the velocities that the character would have after the step if no row acted. The work grows with
//! the number of bodies.
//!
//! A joint that is driven toward a target has its spring and damper in the factor: eliminating
//! λ_s = f₀ − K (q − q*) − (D + K h)(q̇⁺ − v*) from the rows s (Tokizaki & Hasegawa eqs. 19-20) adds
//! h (D + K h) to the joint's entry of the mass matrix, so that tracking costs no row.

use multiversion::multiversion;

use super::root::RootFactor;
use crate::model::wide::{LANES, Lanes, Numbers, Wide};
use crate::model::{BodyGroup, Model};
use crate::sim::bodies::Bodies;
use crate::sim::joint_load::JointLoad;
use crate::sim::per_body::{Forces, Motions, PerBody};
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::{
    ArticulatedInertia, RigidInertia, SpatialForce, SpatialMotion, WideArticulated, WideForce, WideInertia,
    WideMotion,
};

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

impl JointFactor {
    /// Of a joint whose acceleration is given.
    const HELD: Self = Self { u: SpatialForce::ZERO, inverse_d: 0.0, root_inverse_d: 0.0 };
}

impl Numbers<8> for JointFactor {
    #[inline(always)] // part of the kernels
    fn numbers(self) -> [f64; 8] {
        let [mx, my, mz, fx, fy, fz] = self.u.components();
        [mx, my, mz, fx, fy, fz, self.inverse_d, self.root_inverse_d]
    }

    #[inline(always)] // part of the kernels
    fn from_numbers([mx, my, mz, fx, fy, fz, inverse_d, root_inverse_d]: [f64; 8]) -> Self {
        Self { u: SpatialForce::from_numbers([mx, my, mz, fx, fy, fz]), inverse_d, root_inverse_d }
    }
}

/// The factor of a step's mass matrix and the sweeps' intermediate values.
#[derive(Debug, Clone)]
pub struct Articulated {
    /// One a body: its joint's. Nothing for the root.
    pub joints: PerBody<JointFactor, 8>,
    /// The root's factor.
    pub root: RootFactor,
    /// Bias acceleration of each body: that by the velocities alone, if neither the root nor a joint accelerates. (prepare)
    pub bias_acceleration: Motions,
    /// Bias force of each body: what its velocity and its bias acceleration require. (prepare)
    pub bias_force: Forces,
    /// Articulated-body inertia of each body. The root's is in parts. (factorise)
    inertia: PerBody<ArticulatedInertia, 21>,
    /// What acts along the joints, by groups of bodies. (factorise)
    loads: Vec<GroupLoad>,
    /// What a group of bodies hands on to its parents.
    handed_on: WideArticulated,
    /// The root's articulated-body inertia. (factorise)
    whole: ArticulatedInertia,
    articulated_bias: Forces,
    /// Joint forces less that of the articulated bias, N m or N, by groups of bodies. (accelerate)
    net: Vec<Lanes>,
    /// Acceleration of each body besides its bias acceleration.
    acceleration: Motions,
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
    /// Room for `model`.
    pub fn new(model: &Model) -> Self {
        Self {
            joints: PerBody::new(model, JointFactor::HELD),
            root: RootFactor::EMPTY,
            bias_acceleration: PerBody::new(model, SpatialMotion::ZERO),
            bias_force: PerBody::new(model, SpatialForce::ZERO),
            inertia: PerBody::new(model, RigidInertia::ZERO.into()),
            loads: vec![GroupLoad::NONE; model.groups.len()],
            handed_on: Wide::ZERO,
            whole: RigidInertia::ZERO.into(),
            articulated_bias: PerBody::new(model, SpatialForce::ZERO),
            net: vec![[0.0; LANES]; model.groups.len()],
            acceleration: PerBody::new(model, SpatialMotion::ZERO),
        }
    }
}

/// Velocity-dependent forces of every body. In a simulation without them this is never called, and they
/// stay zero.
///
/// They are taken together with the acceleration that the velocities alone bring, S q̈ and the root's
/// acceleration left out, so that what remains to be solved is linear in those without a constant.
#[multiversion(targets("x86_64+avx2"))]
pub fn prepare(factor: &mut Articulated, model: &Model, bodies: &Bodies, joint_rates: &[f64]) {
    for index in 0..model.groups.len() {
        let group = &model.groups[index];
        let velocities = &bodies.velocity.groups[index];
        if index > 0 {
            let (parents, own) = factor.bias_acceleration.outward(index, group);
            let along = &bodies.groups[index].motion_subspace;
            turn_along(parents, velocities, along, &group.of_joints(joint_rates), own);
        }
        let accelerations = &factor.bias_acceleration.groups[index];
        require(
            &bodies.groups[index].inertia,
            velocities,
            accelerations,
            &mut factor.bias_force.groups[index],
        );
    }
}

/// Bias accelerations of bodies that move with `velocities`, whose parents have the bias accelerations `parents`, and whose joints
/// move at `rates` along `along`. A body's velocity and its parent's differ by what is along `along`, which does not
/// change the product.
#[multiversion(targets("x86_64+avx2"))]
fn turn_along(
    parents: &WideMotion,
    velocities: &WideMotion,
    along: &WideMotion,
    rates: &Lanes,
    bias: &mut WideMotion,
) {
    for lane in 0..LANES {
        let by_velocity = velocities.at(lane).cross_motion(along.at(lane));
        bias.set(lane, parents.at(lane).plus_scaled(by_velocity, rates[lane]));
    }
}

/// The forces that `velocities` and `accelerations` require.
#[multiversion(targets("x86_64+avx2"))]
fn require(
    inertias: &WideInertia,
    velocities: &WideMotion,
    accelerations: &WideMotion,
    forces: &mut WideForce,
) {
    for lane in 0..LANES {
        let (inertia, velocity) = (inertias.at(lane), velocities.at(lane));
        let by_velocity = velocity.cross_force(inertia.times(velocity));
        forces.set(lane, by_velocity.plus(inertia.times(accelerations.at(lane))));
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
    bodies: &Bodies,
    loads: &[JointLoad],
    freedom: RootFreedom,
) -> Result<(), Singular> {
    for (articulated, placed) in factor.inertia.groups.iter_mut().zip(&bodies.groups) {
        lock(&placed.inertia, articulated);
    }
    factor.inertia.part_root(bodies.at(0).inertia.into());
    for index in (1..model.groups.len()).rev() {
        let group = &model.groups[index];
        factor.loads[index] = GroupLoad::new(group, loads);
        let felt = release(
            &bodies.groups[index].motion_subspace,
            &factor.loads[index],
            &factor.inertia.groups[index],
            &mut factor.handed_on,
            &mut factor.joints.groups[index],
        );
        if let Some(lane) = felt.iter().position(|felt| felt.is_nan() || *felt <= 0.0) {
            return Err(Singular::Joint(group.bodies[lane] - 1));
        }
        factor.inertia.add_to_parents(group, &factor.handed_on);
    }
    factor.whole = factor.inertia.root_sum();
    factor.root = RootFactor::new(freedom, &factor.whole).ok_or(Singular::Root)?;
    Ok(())
}

/// What acts along the joints of a group of bodies.
#[derive(Debug, Clone, Copy)]
struct GroupLoad {
    inertia: Lanes,
    torque: Lanes,
    /// The accelerations that are given, 0 for the others.
    held: Lanes,
    /// 0 for joints whose acceleration is given, 1 for the others.
    free: Lanes,
}

impl GroupLoad {
    const NONE: Self =
        Self { inertia: [0.0; LANES], torque: [0.0; LANES], held: [0.0; LANES], free: [0.0; LANES] };

    #[inline(always)] // part of the kernels
    fn new(group: &BodyGroup, loads: &[JointLoad]) -> Self {
        let loads: [&JointLoad; LANES] = group.bodies.map(|body| &loads[body - 1]);
        Self {
            // Nothing resists an acceleration in a lane without a body.
            inertia: std::array::from_fn(|lane| loads[lane].inertia + group.empty[lane]),
            torque: loads.map(|load| load.torque),
            held: loads.map(|load| load.held.unwrap_or(0.0)),
            free: loads.map(|load| if load.held.is_some() { 0.0 } else { 1.0 }),
        }
    }
}

/// The inertias of bodies beyond which no joint moves.
#[multiversion(targets("x86_64+avx2"))]
fn lock(rigid: &WideInertia, articulated: &mut WideArticulated) {
    for lane in 0..LANES {
        articulated.set(lane, rigid.at(lane).into());
    }
}

/// Frees the joints of bodies of these `inertias`: their factors, and into `handed_on` the inertias as the parents feel them. The
/// inertias felt along the joints, kg m² or kg.
#[multiversion(targets("x86_64+avx2"))]
fn release(
    along: &WideMotion,
    load: &GroupLoad,
    inertias: &WideArticulated,
    handed_on: &mut WideArticulated,
    factors: &mut Wide<JointFactor, 8>,
) -> Lanes {
    let mut felt = [0.0; LANES];
    for lane in 0..LANES {
        let (along, inertia) = (along.at(lane), inertias.at(lane));
        let u = inertia.times(along);
        let d = along.dot(u) + load.inertia[lane];
        let inverse_d = load.free[lane] / d;
        felt[lane] = d;
        handed_on.set(lane, inertia.reduced(u, inverse_d));
        factors.set(lane, JointFactor { u, inverse_d, root_inverse_d: inverse_d.sqrt() });
    }
    felt
}

/// The accelerations without any row, under the factorised loads and the prepared bias forces: those of
/// the joints into `joint_acceleration`, and the root's as the result.
///
/// `minus_gravity` is the acceleration −g, which stands for the bodies' weights. `prescribed` is the acceleration of the
/// root in the directions in which it is not free.
#[allow(clippy::too_many_arguments)] // one call a step; every argument is a stage's result
#[multiversion(targets("x86_64+avx2"), attrs(allow(clippy::too_many_arguments)))]
pub fn accelerate(
    factor: &mut Articulated,
    model: &Model,
    bodies: &Bodies,
    freedom: RootFreedom,
    minus_gravity: SpatialMotion,
    prescribed: SpatialMotion,
    joint_acceleration: &mut [f64],
) -> SpatialMotion {
    factor.articulated_bias.copy_from(&factor.bias_force);
    factor.articulated_bias.part_root(factor.bias_force.at(0));
    for index in (1..model.groups.len()).rev() {
        let group = &model.groups[index];
        let mut handed_on = Wide::ZERO;
        balance(
            &bodies.groups[index].motion_subspace,
            &factor.loads[index],
            &factor.joints.groups[index],
            &factor.articulated_bias.groups[index],
            &mut factor.net[index],
            &mut handed_on,
        );
        factor.articulated_bias.add_to_parents(group, &handed_on);
    }
    let prescribed_minus_gravity = match freedom {
        RootFreedom::Fixed => minus_gravity,
        _ => prescribed,
    };
    let root = factor.root.accelerate(
        &factor.whole,
        factor.articulated_bias.root_sum().scaled(-1.0),
        prescribed_minus_gravity,
    );
    factor.acceleration.set_root(root);
    for index in 1..model.groups.len() {
        let group = &model.groups[index];
        let (parents, own) = factor.acceleration.outward(index, group);
        let joints = respond(
            parents,
            &bodies.groups[index].motion_subspace,
            &factor.loads[index],
            &factor.joints.groups[index],
            &factor.net[index],
            own,
        );
        group.put(joints, joint_acceleration);
    }
    root.plus(minus_gravity.scaled(-1.0))
}

/// Joint forces less those of the bodies' articulated `bias`, into `net`, and into `handed_on` the bias that the parents feel.
#[multiversion(targets("x86_64+avx2"))]
fn balance(
    along: &WideMotion,
    load: &GroupLoad,
    factors: &Wide<JointFactor, 8>,
    bias: &WideForce,
    net: &mut Lanes,
    handed_on: &mut WideForce,
) {
    for lane in 0..LANES {
        let (factor, bias) = (factors.at(lane), bias.at(lane));
        let left = load.torque[lane] - along.at(lane).dot(bias);
        // The inverse is 0 where the acceleration is given.
        let acceleration = load.held[lane] + left * factor.inverse_d;
        net[lane] = left;
        handed_on.set(lane, bias.plus_scaled(factor.u, acceleration));
    }
}

/// Accelerations of the joints of bodies whose parents accelerate with `parents`, as the result, and of the bodies.
#[multiversion(targets("x86_64+avx2"))]
fn respond(
    parents: &WideMotion,
    along: &WideMotion,
    load: &GroupLoad,
    factors: &Wide<JointFactor, 8>,
    net: &Lanes,
    accelerations: &mut WideMotion,
) -> Lanes {
    let mut joints = [0.0; LANES];
    for lane in 0..LANES {
        let (factor, parent) = (factors.at(lane), parents.at(lane));
        let joint = load.held[lane] + (net[lane] - parent.dot(factor.u)) * factor.inverse_d;
        joints[lane] = joint;
        accelerations.set(lane, parent.plus_scaled(along.at(lane), joint));
    }
    joints
}
