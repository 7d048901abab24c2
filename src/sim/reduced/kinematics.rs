//! Where bodies are and how they move, from joint coordinates.

use nalgebra::{Matrix3, Vector3};

use crate::model::{Freedom, Model};
use crate::sim::spatial::{Motion, RigidInertia};
use crate::sim::state::State;

/// Pose, motion and inertia of a body, along the world axes about the common point (the origin of
/// the root link).
#[derive(Debug, Clone, Copy)]
pub struct BodyMotion {
    /// Orientation in the world.
    pub rotation: Matrix3<f64>,
    /// Origin of the body frame relative to the common point, m.
    pub origin: Vector3<f64>,
    /// Velocity per unit of joint rate; zero for the root.
    pub freedom: Motion,
    /// Velocity.
    pub velocity: Motion,
    /// Centre of mass relative to the common point, m.
    pub center: Vector3<f64>,
    /// Inertia.
    pub inertia: RigidInertia,
}

impl BodyMotion {
    /// A body at the common point, at rest.
    pub const REST: Self = Self {
        rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
        origin: Vector3::new(0.0, 0.0, 0.0),
        freedom: Motion::ZERO,
        velocity: Motion::ZERO,
        center: Vector3::new(0.0, 0.0, 0.0),
        inertia: RigidInertia::ZERO,
    };

    /// A point given in the body frame, relative to the common point, m.
    #[inline]
    pub fn point(&self, local: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.rotation * local
    }
}

/// Fills `bodies`, one for every body of `model`, from `state`.
pub fn place(model: &Model, state: &State, bodies: &mut [BodyMotion]) {
    let root = &state.root;
    for (index, body) in model.bodies.iter().enumerate() {
        let (rotation, origin, freedom, velocity) = if index == 0 {
            let velocity = Motion { angular: root.angular_velocity, linear: root.linear_velocity };
            (*root.orientation.to_rotation_matrix().matrix(), Vector3::zeros(), Motion::ZERO, velocity)
        } else {
            let parent = &bodies[body.parent];
            let angle = state.angles[index - 1];
            let joint_origin = parent.point(body.offset);
            let (rotation, origin, freedom) = match body.freedom {
                Freedom::Revolute => {
                    let (sine, cosine) = angle.sin_cos();
                    let turn = body.turn + body.turn_sine * sine + body.turn_versine * (1.0 - cosine);
                    let rotation = parent.rotation * turn;
                    let axis = rotation * body.axis;
                    (rotation, joint_origin, Motion { angular: axis, linear: joint_origin.cross(&axis) })
                }
                Freedom::Prismatic => {
                    let rotation = parent.rotation * body.turn;
                    let axis = rotation * body.axis;
                    let freedom = Motion { angular: Vector3::zeros(), linear: axis };
                    (rotation, joint_origin + axis * angle, freedom)
                }
            };
            let velocity = parent.velocity.plus_scaled(freedom, state.velocities[index - 1]);
            (rotation, origin, freedom, velocity)
        };
        let center = origin + rotation * body.center;
        let inertia = RigidInertia::new(body.mass, center, rotation * body.inertia * rotation.transpose());
        bodies[index] = BodyMotion { rotation, origin, freedom, velocity, center, inertia };
    }
}
