//! What can be simulated: a character compiled into flat arrays over a kinematic tree.

pub mod collision;
mod compile;

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix3, Vector3};

use crate::character::{Character, LoopKind};
use collision::convex::Convex;
use collision::pairs::Pairs;

pub use collision::{CYLINDER_SLOTS, GroundShape, Surface};

/// A character with its rigid parts merged: bodies joined by joints of one degree of freedom.
///
/// Body 0 is the root, with the frame of the root link. Joint `j` carries body `j + 1`, whose frame
/// is that of the joint's child link; its parent body has a smaller index. All arrays over joints
/// have [`Model::joint_count`] entries. A model never changes once it is compiled.
#[derive(Debug, Clone)]
pub struct Model {
    /// The character this was compiled from.
    pub character: Arc<Character>,
    /// Whether the root link is bolted to the world.
    pub fixed_base: bool,
    /// Bodies, parents before children.
    pub bodies: Vec<Body>,
    /// All bodies but the root by their distance from it. Each comes after its parent, and those that follow each other
    /// seldom wait for each other's results, which lets a processor work at several limbs at a time.
    pub outward: Vec<usize>,
    /// Joint names.
    pub joint_names: Vec<String>,
    /// Range of motion, rad or m; `None` is unlimited.
    pub limits: Vec<Option<[f64; 2]>>,
    /// Whether an actuator drives the joint; without one it is passive, whatever its target.
    pub driven: Vec<bool>,
    /// Greatest torque or force of the actuator, N m or N; `None` is unbounded.
    pub effort: Vec<Option<f64>>,
    /// Greatest speed of the actuator, rad/s or m/s; `None` is unbounded.
    pub speed: Vec<Option<f64>>,
    /// Viscous damping, N m s/rad or N s/m.
    pub damping: Vec<f64>,
    /// Dry friction, N m or N.
    pub friction: Vec<f64>,
    /// Reflected inertia of the rotor, kg m² or kg.
    pub armature: Vec<f64>,
    /// Total mass, kg.
    pub mass: f64,
    /// Joints that close loops over the tree.
    pub loops: Vec<LoopJoint>,
    /// Where each link of the character sits, in the order of the character's links.
    pub links: Vec<LinkPlace>,
    /// Shapes that can touch something, and where they can touch the ground.
    pub ground_shapes: Vec<GroundShape>,
    /// Points of those shapes, in the frames of their bodies, m.
    pub ground_points: Vec<Vector3<f64>>,
    /// Number of slots of contact with the ground: every place at which the character can touch it has
    /// one, for as long as the model lives.
    pub ground_slots: usize,
    /// Solids of the shapes, in the frames of their bodies and in the order of `ground_shapes`. Each has
    /// [`SOLID_SLOTS`] slots for its contacts with other solids, after those of the ground.
    pub solids: Vec<Convex>,
    /// Which shapes can touch each other.
    pub pairs: Pairs,
}

/// Slots of a shape for its contacts with other solids.
pub const SOLID_SLOTS: usize = 4;

/// A rigid body and the joint that carries it.
#[derive(Debug, Clone)]
pub struct Body {
    /// Index of the parent body; 0 for the root itself.
    pub parent: usize,
    /// What the joint allows; meaningless for the root.
    pub freedom: Freedom,
    /// Origin of the joint frame in the parent body's frame, m.
    pub offset: Vector3<f64>,
    /// Orientation of the joint frame in the parent body's frame.
    pub turn: Matrix3<f64>,
    /// `turn` times the cross-product matrix of the axis: the sine part of Rodrigues' formula.
    pub turn_sine: Matrix3<f64>,
    /// `turn` times its square: the part of one minus the cosine.
    pub turn_versine: Matrix3<f64>,
    /// Axis in the body frame (and in the joint frame).
    pub axis: Vector3<f64>,
    /// kg.
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub center: Vector3<f64>,
    /// Rotational inertia about the centre of mass along the axes of the body frame, kg m².
    pub inertia: Matrix3<f64>,
}

/// What a movable joint allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Freedom {
    /// Rotation about the axis, rad.
    Revolute,
    /// Translation along the axis, m.
    Prismatic,
}

/// A joint that closes a loop: it joins two bodies of the tree.
#[derive(Debug, Clone)]
pub struct LoopJoint {
    /// What it allows.
    pub kind: LoopKind,
    /// Indices of the two bodies.
    pub bodies: [usize; 2],
    /// Origin of the joint's frame in the frames of the two bodies, m.
    pub at: [Vector3<f64>; 2],
    /// Orientation of the joint's frame in the frames of the two bodies.
    pub turn: [Matrix3<f64>; 2],
    /// Axis in the joint's frame.
    pub axis: Vector3<f64>,
}

/// Where a link of the character sits in the model.
#[derive(Debug, Clone)]
pub struct LinkPlace {
    /// Index of the body it belongs to.
    pub body: usize,
    /// The link frame in the body frame.
    pub pose: Isometry3<f64>,
}

impl Model {
    /// Number of movable joints.
    pub fn joint_count(&self) -> usize {
        self.joint_names.len()
    }

    /// Index of the joint called `name`.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joint_names.iter().position(|joint| joint == name)
    }

    /// Whether every joint has an actuator and moves whatever the others do, so that all of them can be held at
    /// velocities of their own.
    pub fn joints_are_independent(&self) -> bool {
        self.loops.is_empty() && self.driven.iter().all(|driven| *driven)
    }

    /// The first body that can move and has no mass or no positive definite inertia of its own, if
    /// there is one.
    pub fn body_without_inertia(&self) -> Option<usize> {
        let first = usize::from(self.fixed_base);
        let lacking =
            |body: &Body| body.mass.is_nan() || body.mass <= 0.0 || body.inertia.cholesky().is_none();
        self.bodies.iter().skip(first).position(lacking).map(|index| index + first)
    }

    /// Whether body `ancestor` lies on the way from body `body` to the root, both ends included.
    pub fn carries(&self, ancestor: usize, mut body: usize) -> bool {
        while body > ancestor {
            body = self.bodies[body].parent;
        }
        body == ancestor
    }
}
