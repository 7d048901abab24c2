//! Body states from joint coordinates and back.

use std::f64::consts::TAU;

use nalgebra::{Point3, Rotation3, UnitQuaternion, Vector3};

use crate::model::{DofKind, Model};
use crate::sim::bodies::{Bodies, BodyMotion};
use crate::sim::coordinates::reduced;
use crate::sim::spatial::{RigidInertia, SpatialMotion};
use crate::sim::state::{BodyState, State};

/// Fills the body states of `state` from its joint coordinates, and `bodies` with the same poses.
pub fn bodies_from_joints(model: &Model, state: &mut State, bodies: &mut Bodies) {
    reduced::kinematics::place(model, state, bodies);
    state.body_states.clear();
    for body in bodies.iter() {
        let rotation = Rotation3::from_matrix_unchecked(body.rotation);
        state.body_states.push(BodyState {
            center: state.root.position + body.center,
            orientation: UnitQuaternion::from_rotation_matrix(&rotation),
            linear_velocity: body.velocity.at(body.center),
            angular_velocity: body.velocity.angular,
        });
    }
}

/// Fills `bodies`, one for every body of `model`, from the bodies of `state` themselves; the common
/// point is the root's origin as it is there.
pub fn place(model: &Model, state: &State, bodies: &mut Bodies) {
    for (index, (body_state, body)) in state.body_states.iter().zip(&model.bodies).enumerate() {
        let rotation = *body_state.orientation.to_rotation_matrix().matrix();
        let center = body_state.center - state.root.position;
        let origin = center - rotation * body.center;
        let axis = rotation * body.axis;
        let motion_subspace = match body.dof {
            _ if index == 0 => SpatialMotion::ZERO,
            DofKind::Revolute => SpatialMotion { angular: axis, linear: origin.cross(&axis) },
            DofKind::Prismatic => SpatialMotion { angular: Vector3::zeros(), linear: axis },
        };
        let angular = body_state.angular_velocity;
        let velocity = SpatialMotion { angular, linear: body_state.linear_velocity + center.cross(&angular) };
        let inertia = RigidInertia::new(body.mass, center, rotation * body.inertia * rotation.transpose());
        bodies.set(index, BodyMotion { rotation, origin, motion_subspace, velocity, center, inertia });
    }
}

/// Fills the root's pose and the joint angles of `state` from its body states. The number of whole rotations of an angle
/// is that nearest to the angle expected from its velocity over `step` seconds.
pub fn joints_from_bodies(model: &Model, state: &mut State, step: f64) {
    let frame = |index: usize| {
        let body_state = &state.body_states[index];
        let origin: Point3<f64> = body_state.center - body_state.orientation * model.bodies[index].center;
        (origin, body_state.orientation)
    };
    (state.root.position, state.root.orientation) = frame(0);
    for (joint, angle) in state.angles.iter_mut().enumerate() {
        let body = &model.bodies[joint + 1];
        let (parent_origin, parent) = frame(body.parent);
        let (origin, orientation) = frame(joint + 1);
        let turn =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(body.joint_rotation));
        let joint_frame = parent * turn;
        *angle = match body.dof {
            DofKind::Revolute => {
                let relative = joint_frame.inverse() * orientation;
                let turned = 2.0 * body.axis.dot(&relative.imag()).atan2(relative.scalar());
                let expected = *angle + step * state.velocities[joint];
                turned + TAU * ((expected - turned) / TAU).round()
            }
            DofKind::Prismatic => {
                let from = parent_origin + parent * body.offset;
                (joint_frame * body.axis).dot(&(origin - from))
            }
        };
    }
}
