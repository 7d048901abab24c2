//! Where bodies are and how they move, from joint coordinates.

use multiversion::multiversion;
use nalgebra::Vector3;

use super::trigonometry::{LANES, sines_and_cosines};
use crate::model::{Body, DofKind, Model};
use crate::sim::bodies::BodyMotion;
use crate::sim::spatial::{RigidInertia, SpatialMotion, rotated};
use crate::sim::state::State;

/// Fills `bodies`, one for every body of `model`, from `state`.
#[multiversion(targets("x86_64+avx2"))]
pub fn place(model: &Model, state: &State, bodies: &mut [BodyMotion]) {
    let root = &state.root;
    let placed = &mut bodies[0];
    placed.rotation = *root.orientation.to_rotation_matrix().matrix();
    placed.origin = Vector3::zeros();
    placed.motion_subspace = SpatialMotion::ZERO;
    placed.velocity = root.motion();
    for chunk in model.outward.chunks(LANES) {
        let mut angles = [0.0; LANES];
        for (angle, index) in angles.iter_mut().zip(chunk) {
            *angle = state.angles[index - 1];
        }
        for ((&index, angle), turned) in chunk.iter().zip(angles).zip(sines_and_cosines(angles)) {
            place_body(&model.bodies[index], index, angle, turned, state.velocities[index - 1], bodies);
        }
    }
    for (body, placed) in model.bodies.iter().zip(bodies) {
        placed.center = placed.point(body.center);
        placed.inertia =
            RigidInertia::new(body.mass, placed.center, rotated(&placed.rotation, &body.inertia));
    }
}

/// Fills in everything but mass and inertia of body `index`, whose joint is at `angle`, with this sine and cosine, and moves
/// at `rate`.
#[inline(always)] // the body of the loop
fn place_body(
    body: &Body,
    index: usize,
    angle: f64,
    [sine, cosine]: [f64; 2],
    rate: f64,
    bodies: &mut [BodyMotion],
) {
    let parent = &bodies[body.parent];
    let joint_origin = parent.point(body.offset);
    let (rotation, origin, motion_subspace) = match body.dof {
        DofKind::Revolute => {
            let turn = body.joint_rotation
                + body.joint_rotation_sine * sine
                + body.joint_rotation_versine * (1.0 - cosine);
            let rotation = parent.rotation * turn;
            let axis = rotation * body.axis;
            (rotation, joint_origin, SpatialMotion { angular: axis, linear: joint_origin.cross(&axis) })
        }
        DofKind::Prismatic => {
            let rotation = parent.rotation * body.joint_rotation;
            let axis = rotation * body.axis;
            let motion_subspace = SpatialMotion { angular: Vector3::zeros(), linear: axis };
            (rotation, joint_origin + axis * angle, motion_subspace)
        }
    };
    let velocity = parent.velocity.plus_scaled(motion_subspace, rate);
    let placed = &mut bodies[index];
    placed.rotation = rotation;
    placed.origin = origin;
    placed.motion_subspace = motion_subspace;
    placed.velocity = velocity;
}

/// Gives `bodies` the velocities that go with `root` and the joint velocities `rates`, where they are.
#[multiversion(targets("x86_64+avx2"))]
pub fn move_along(model: &Model, root: SpatialMotion, rates: &[f64], bodies: &mut [BodyMotion]) {
    bodies[0].velocity = root;
    for &index in &model.outward {
        let body = &model.bodies[index];
        let velocity =
            bodies[body.parent].velocity.plus_scaled(bodies[index].motion_subspace, rates[index - 1]);
        bodies[index].velocity = velocity;
    }
}

/// Composite-rigid-body inertia along each joint, with all joints beyond it fixed at zero, plus its rotor's; kg m² or kg.
pub fn composite_inertia(model: &Model) -> Vec<f64> {
    let mut bodies = vec![BodyMotion::REST; model.bodies.len()];
    place(model, &State::new(model), &mut bodies);
    let mut carried: Vec<RigidInertia> = bodies.iter().map(|body| body.inertia).collect();
    for index in (1..bodies.len()).rev() {
        let parent = model.bodies[index].parent;
        carried[parent] = carried[parent].plus(carried[index]);
    }
    let along =
        |index: usize| bodies[index].motion_subspace.dot(carried[index].times(bodies[index].motion_subspace));
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
