//! Where bodies are and how they move, from joint coordinates.

use multiversion::multiversion;
use nalgebra::Matrix3;

use super::trigonometry::sines_and_cosines;
use crate::model::wide::{LANES, Lanes, Wide, WideMatrix, WideVector};
use crate::model::{BodyGroup, DofKind, Model};
use crate::sim::bodies::{Bodies, BodyLanes};
use crate::sim::per_body::Motions;
use crate::sim::spatial::{RigidInertia, SpatialMotion, WideInertia, WideMotion, rotated};
use crate::sim::state::State;

/// Fills `bodies`, one for every body of `model`, from `state`.
#[multiversion(targets("x86_64+avx2"))]
pub fn place(model: &Model, state: &State, bodies: &mut Bodies) {
    let (root, whole) = (&state.root, &mut bodies.groups[0]);
    whole.rotation = Wide::all(*root.orientation.to_rotation_matrix().matrix());
    whole.origin = Wide::ZERO;
    whole.motion_subspace = Wide::ZERO;
    weigh(&model.groups[0], &whole.rotation, &whole.origin, &mut whole.center, &mut whole.inertia);
    bodies.velocity.set_root(root.motion());
    // Angles and rates are gathered before they are needed: what is written one by one can be read at once only some time later.
    let gathered = |index: usize| {
        let group = model.groups.get(index)?;
        Some((group, group.of_joints(&state.angles), group.of_joints(&state.velocities)))
    };
    let mut next = gathered(1);
    for index in 1.. {
        let Some((group, angles, rates)) = next else { break };
        next = gathered(index + 1);
        let turned = sines_and_cosines(&angles);
        let (rotations, origins, own) = bodies.outward(index, group);
        let BodyLanes { rotation, origin, motion_subspace, center, inertia } = own;
        turn(group, rotations, origins, &angles, &turned, rotation, origin, motion_subspace);
        weigh(group, rotation, origin, center, inertia);
        let (parents, velocities) = bodies.velocity.outward(index, group);
        let along = &bodies.groups[index].motion_subspace;
        follow(parents, along, &rates, velocities);
    }
}

/// Poses and motion subspaces of the bodies of `group`, whose joints are at `angles`, which have these sines and cosines.
#[allow(clippy::too_many_arguments)] // see `wide`
#[multiversion(targets("x86_64+avx2"), attrs(allow(clippy::too_many_arguments)))]
fn turn(
    group: &BodyGroup,
    parent_rotations: &WideMatrix,
    parent_origins: &WideVector,
    angles: &Lanes,
    turned: &[Lanes; 2],
    rotations: &mut WideMatrix,
    origins: &mut WideVector,
    along: &mut WideMotion,
) {
    let [sines, cosines] = turned;
    for lane in 0..LANES {
        let (parent, slides) = (parent_rotations.at(lane), group.slides[lane]);
        let joint_origin = parent_origins.at(lane) + parent * group.offset.at(lane);
        // The matrices of a sliding joint's sine and versine are zero.
        let turn = group.joint_rotation.at(lane)
            + group.joint_rotation_sine.at(lane) * sines[lane]
            + group.joint_rotation_versine.at(lane) * (1.0 - cosines[lane]);
        let rotation = parent * turn;
        let axis = rotation * group.axis.at(lane);
        let angular = axis * (1.0 - slides);
        rotations.set(lane, rotation);
        origins.set(lane, joint_origin + axis * (slides * angles[lane]));
        along.set(lane, SpatialMotion { angular, linear: joint_origin.cross(&angular) + axis * slides });
    }
}

/// Velocities of bodies whose parents move with `parents`, and whose joints move at `rates` along `along`.
#[multiversion(targets("x86_64+avx2"))]
fn follow(parents: &WideMotion, along: &WideMotion, rates: &Lanes, velocities: &mut WideMotion) {
    for lane in 0..LANES {
        velocities.set(lane, parents.at(lane).plus_scaled(along.at(lane), rates[lane]));
    }
}

/// Centres of mass and inertias of the bodies of `group`, where they are.
#[multiversion(targets("x86_64+avx2"))]
fn weigh(
    group: &BodyGroup,
    rotations: &WideMatrix,
    origins: &WideVector,
    centers: &mut WideVector,
    inertias: &mut WideInertia,
) {
    for lane in 0..LANES {
        let rotation: Matrix3<f64> = rotations.at(lane);
        let center = origins.at(lane) + rotation * group.center.at(lane);
        centers.set(lane, center);
        let about_center = rotated(&rotation, &group.inertia.at(lane));
        inertias.set(lane, RigidInertia::new(group.mass[lane], center, about_center));
    }
}

/// The velocities of all bodies, `placed` in their groups, when the root moves with `root` and the joints at `rates`, into
/// `velocities`.
#[multiversion(targets("x86_64+avx2"))]
pub fn move_along(
    model: &Model,
    placed: &[BodyLanes],
    root: SpatialMotion,
    rates: &[f64],
    velocities: &mut Motions,
) {
    velocities.set_root(root);
    for index in 1..model.groups.len() {
        let group = &model.groups[index];
        let (parents, own) = velocities.outward(index, group);
        follow(parents, &placed[index].motion_subspace, &group.of_joints(rates), own);
    }
}

/// Composite-rigid-body inertia along each joint, with all joints beyond it fixed at zero, plus its rotor's; kg m² or kg.
pub fn composite_inertia(model: &Model) -> Vec<f64> {
    let mut bodies = Bodies::new(model);
    place(model, &State::new(model), &mut bodies);
    let mut carried: Vec<RigidInertia> = bodies.iter().map(|body| body.inertia).collect();
    for index in (1..bodies.len()).rev() {
        let parent = model.bodies[index].parent;
        carried[parent] = carried[parent].plus(carried[index]);
    }
    let along = |index: usize| {
        let along = bodies.at(index).motion_subspace;
        along.dot(carried[index].times(along))
    };
    model.armature.iter().enumerate().map(|(joint, rotor)| rotor + along(joint + 1)).collect()
}

/// Distance from each joint to the farthest of its body's centre of mass and of the joints beyond, m; 0 for
/// a prismatic joint, whose body is no pendulum.
pub fn moment_arms(model: &Model) -> Vec<f64> {
    let mut moment_arms: Vec<f64> = model.bodies.iter().skip(1).map(|body| body.center.norm()).collect();
    for body in model.bodies.iter().skip(1).filter(|body| body.parent > 0) {
        moment_arms[body.parent - 1] = moment_arms[body.parent - 1].max(body.offset.norm());
    }
    for (moment_arm, body) in moment_arms.iter_mut().zip(&model.bodies[1..]) {
        if body.dof == DofKind::Prismatic {
            *moment_arm = 0.0;
        }
    }
    moment_arms
}
