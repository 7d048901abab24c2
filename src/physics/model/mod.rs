//! What can be simulated: a character compiled into flat arrays over a kinematic tree.

mod body;
pub mod collision;
mod compile;
mod groups;
mod size;
mod spin;
pub mod wide;

use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use crate::character::Character;
use collision::convex::Convex;
use collision::pairs::Pairs;

pub use body::{Body, DofKind, Frame, LinkPlace, LoopJoint};
pub use collision::{CYLINDER_SLOTS, GroundBody, GroundShape, Surface};
pub use groups::{BodyGroup, Parents, Slot};

/// A character compiled for simulation: rigid bodies joined by joints of one degree of freedom each.
///
/// Links joined by fixed joints are merged into one body. Body 0 is the root, with the frame of the root link.
/// Joint `j` carries body `j + 1`, whose frame is that of the joint's child link; its parent body has a smaller index.
///
/// Sizes: `n_bodies` is the length of `bodies`, `n_joints` is [`Model::joint_count`] = `n_bodies` − 1, `n_links` the
/// number of the character's links, `n_shapes` the number of its collision shapes. [`Model::new`] fills every field;
/// the function named at a field computes it there. A model never changes once it is compiled.
#[derive(Debug, Clone)]
pub struct Model {
    /// The character this was compiled from.
    pub character: Arc<Character>,
    /// Whether the root link is fixed to the world; otherwise it floats freely, with six degrees of freedom.
    pub fixed_base: bool,
    /// Bodies, parents before children; `n_bodies`. Merged by `MergedBody` in `compile.rs`.
    pub bodies: Vec<Body>,
    /// The bodies in groups at the same depth of the tree, the root's first and each group after those of its parents. From
    /// `groups.rs`, as are the two fields below. Kernels move a group's bodies together.
    pub groups: Vec<BodyGroup>,
    /// Where each body stands in `groups`; `n_bodies`.
    pub slots: Arc<[Slot]>,
    /// The body on the way from each body to the root that hangs on the root; the body itself where it does, and 0 of the root;
    /// `n_bodies`. From `branches` in `compile.rs`.
    pub branches: Vec<usize>,
    /// Indices of all bodies but the root in the order of the groups; `n_joints`. Each body comes after its parent, and neighbours
    /// in this order seldom depend on each other, so that a processor can work on several limbs at a time.
    pub outward: Vec<usize>,
    /// Names of the joints; `n_joints`.
    pub joint_names: Vec<String>,
    /// Lower and upper end of each joint's range of motion, rad or m; `n_joints`. `None` is unlimited.
    pub limits: Vec<Option<[f64; 2]>>,
    /// Whether an actuator drives the joint; `n_joints`. A joint without one is passive, whatever its target.
    pub driven: Vec<bool>,
    /// Greatest torque or force of the actuator, N m or N; `n_joints`. `None` is unbounded.
    pub effort: Vec<Option<f64>>,
    /// Greatest speed of the actuator, rad/s or m/s; `n_joints`. `None` is unbounded.
    pub speed: Vec<Option<f64>>,
    /// Viscous damping, N m s/rad or N s/m; `n_joints`.
    pub damping: Vec<f64>,
    /// Dry friction, N m or N; `n_joints`.
    pub friction: Vec<f64>,
    /// Reflected inertia of the rotor, kg m² or kg; `n_joints`.
    pub armature: Vec<f64>,
    /// Total mass, kg.
    pub mass: f64,
    /// How large the bodies are, m: the root mean square distance of their mass from their joints. From `size.rs`.
    pub size: f64,
    /// Joints that close kinematic loops over the tree, in the order of the character's loops. From `loop_joint` in
    /// `compile.rs`.
    pub loops: Vec<LoopJoint>,
    /// Body and frame of each link, in the order of the character's links; `n_links`.
    pub links: Vec<LinkPlace>,
    /// Collision shapes with their contact slots against the ground, in the order of the links and, within a link, of its
    /// shapes; `n_shapes`. From `collision::surface::candidates`, as are the points and slots below.
    pub ground_shapes: Vec<GroundShape>,
    /// The bodies of those shapes but for a fixed root, in the order of the shapes. From `collision::surface::ground_bodies`.
    pub ground_bodies: Vec<GroundBody>,
    /// Points of those shapes that can make contact with a plane, in the frames of their bodies, m.
    pub ground_points: Vec<Vector3<f64>>,
    /// Number of slots for contacts with the ground. Every place at which the character can make contact with it has a
    /// slot of its own, the same for as long as the model lives.
    pub ground_slots: usize,
    /// Convex solids of the collision shapes, in the frames of their bodies and in the order of `ground_shapes`;
    /// `n_shapes`.
    pub solids: Vec<Convex>,
    /// Which pairs of shapes can make contact. From `collision::pairs::PairFinder::pairs`.
    pub pairs: Pairs,
}

/// How the root link is joined to the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Base {
    /// Not at all: it has six degrees of freedom.
    Floating,
    /// Rigidly: it stays where it starts.
    Fixed,
}

impl Base {
    /// Fixed where `fixed` holds, floating otherwise.
    pub fn fixed_if(fixed: bool) -> Self {
        if fixed { Self::Fixed } else { Self::Floating }
    }
}

/// Most points of contact of two solids that the detection finds.
pub const PAIR_POINTS: usize = 4;

impl Model {
    /// Number of movable joints.
    pub fn joint_count(&self) -> usize {
        self.joint_names.len()
    }

    /// Index of the joint called `name`.
    pub fn joint(&self, name: &str) -> Option<usize> {
        self.joint_names.iter().position(|joint| joint == name)
    }

    /// Whether every joint has an actuator and no closed loop couples joints, so that each of them can be driven at a
    /// velocity of its own.
    pub fn joints_are_independent(&self) -> bool {
        self.loops.is_empty() && self.driven.iter().all(|driven| *driven)
    }

    /// Height by which speeds, times and torques are scaled for a character without hips whose root's origin stands `root_height` over
    /// the ground, m: that height, or a tenth of [`size`](Self::size) where the root lies on the ground and gives no scale.
    pub fn height_scale(&self, root_height: f64) -> f64 {
        root_height.max(0.1 * self.size)
    }

    /// The point of the root, in its frame, m, by which the height of the trunk is told while the root stands `root_height` over the
    /// ground, m, with this `orientation`: its origin, or its centre of mass where the origin stands less than half as high. Some
    /// descriptions have the origin of the root between the feet.
    pub fn height_mark(&self, root_height: f64, orientation: &UnitQuaternion<f64>) -> Vector3<f64> {
        let Some(root) = self.bodies.first() else { return Vector3::zeros() };
        let of_center = root_height + (orientation * root.center).z;
        if root_height < 0.5 * of_center { root.center } else { Vector3::zeros() }
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
