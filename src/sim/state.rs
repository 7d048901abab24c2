//! Everything that the future of a simulation depends on.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::contact::Touch;
use super::rows::{Owner, Rows};
use super::spatial::Force;
use crate::model::Model;

/// An actuator counts as saturated within this share of its greatest torque.
const AT_LIMIT: f64 = 1.0 - 1e-12;

/// Position and motion of the root link's frame, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// Origin, m.
    pub position: Point3<f64>,
    /// Orientation.
    pub orientation: UnitQuaternion<f64>,
    /// Velocity of the origin, m/s.
    pub linear_velocity: Vector3<f64>,
    /// rad/s.
    pub angular_velocity: Vector3<f64>,
}

impl Default for Root {
    fn default() -> Self {
        Self {
            position: Point3::origin(),
            orientation: UnitQuaternion::identity(),
            linear_velocity: Vector3::zeros(),
            angular_velocity: Vector3::zeros(),
        }
    }
}

/// The state of a simulated character.
///
/// Besides positions and velocities it holds what the solver remembers of the last step, so that a
/// simulation that is taken up again from a kept state goes on bit for bit as it would have.
#[derive(Debug, PartialEq)]
pub struct State {
    /// s.
    pub time: f64,
    /// The root link.
    pub root: Root,
    /// Joint angles, rad or m.
    pub angles: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub velocities: Vec<f64>,
    /// The bodies of maximal coordinates, one each; empty in reduced coordinates and before the first
    /// step, where the joint coordinates above say it all.
    pub(super) parts: Vec<Part>,
    /// Forces of the last step, where the next one starts to look for its own.
    pub(super) memory: Memory,
}

/// A body that swings about its joint under tension, like a weight on a string.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Swing {
    /// Index of the body.
    pub body: usize,
    /// rad/s.
    pub rate: f64,
}

/// Position and motion of a body by itself, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    /// Centre of mass, m.
    pub center: Point3<f64>,
    /// Orientation of the body frame.
    pub orientation: UnitQuaternion<f64>,
    /// Velocity of the centre of mass, m/s.
    pub linear_velocity: Vector3<f64>,
    /// rad/s.
    pub angular_velocity: Vector3<f64>,
}

/// What the solver remembers of the last step.
#[derive(Debug, PartialEq)]
pub(super) struct Memory {
    /// Normal and two tangential forces of every contact slot, N.
    pub contact: Vec<[f64; 3]>,
    /// Force of every joint's limit, N m, positive at the lower end and negative at the upper.
    pub limit: Vec<f64>,
    /// Dry friction of every joint, N m.
    pub dry_friction: Vec<f64>,
    /// Torque of every joint whose actuator is at its limit, N m; 0 for all others.
    pub saturated: Vec<f64>,
    /// What the joint of every loop handed from its first body to its second, about the root's origin, along the
    /// world axes.
    pub loops: Vec<Force>,
    /// Force that every joint carried, N.
    pub pull: Vec<f64>,
    /// The fastest swing of a body under that force; `None` before the first step.
    pub swing: Option<Swing>,
    /// Length of the next part of a step under error control, s; 0 for a whole step.
    pub part: f64,
}

impl State {
    /// `model` at rest at the world's origin, with all joints at zero.
    pub fn new(model: &Model) -> Self {
        let joints = model.joint_count();
        Self {
            time: 0.0,
            root: Root::default(),
            angles: vec![0.0; joints],
            velocities: vec![0.0; joints],
            parts: Vec::new(),
            memory: Memory {
                contact: vec![[0.0; 3]; model.contact_slots()],
                limit: vec![0.0; joints],
                dry_friction: vec![0.0; joints],
                saturated: vec![0.0; joints],
                loops: vec![Force::ZERO; model.loops.len()],
                pull: vec![0.0; joints],
                swing: None,
                part: 0.0,
            },
        }
    }

    /// How far two states are apart in position: the greatest difference of a joint angle (rad), a joint
    /// position (m), a coordinate of the root (m), or the angle between the root's orientations (rad).
    pub fn distance(&self, other: &Self) -> f64 {
        let joints = self.angles.iter().zip(&other.angles).map(|(a, b)| (a - b).abs());
        let roots = (self.root.position - other.root.position).amax();
        let turn = self.root.orientation.angle_to(&other.root.orientation);
        // Unlike f64::max, this does not pass over a NaN.
        joints.fold(roots.max(turn) + (roots + turn) * 0.0, |worst, each| {
            if each > worst || each.is_nan() { each } else { worst }
        })
    }

    /// Forgets what the last step left beside root and joints, as has to be done after a change of them by
    /// hand: its forces, and in maximal coordinates where each body is by itself.
    pub fn forget(&mut self) {
        self.parts.clear();
        self.memory.contact.fill([0.0; 3]);
        self.memory.limit.fill(0.0);
        self.memory.dry_friction.fill(0.0);
        self.memory.saturated.fill(0.0);
        self.memory.loops.fill(Force::ZERO);
        self.memory.pull.fill(0.0);
        self.memory.swing = None;
        self.memory.part = 0.0;
    }
}

impl Memory {
    /// Takes the forces of `rows`, of which those of `touches` come first.
    ///
    /// `greatest` are the greatest torques of the actuators, N m or N, if they have any.
    pub fn remember(&mut self, rows: &Rows, touches: &[Touch], per_touch: usize, greatest: Option<&[f64]>) {
        self.contact.fill([0.0; 3]);
        self.limit.fill(0.0);
        self.dry_friction.fill(0.0);
        self.saturated.fill(0.0);
        for (touch, force) in touches.iter().zip(rows.force.chunks_exact(per_touch)) {
            self.contact[touch.slot][..per_touch].copy_from_slice(force);
        }
        let of_joints = touches.len() * per_touch..;
        for (owner, force) in rows.owner[of_joints.clone()].iter().zip(&rows.force[of_joints]) {
            match *owner {
                Owner::LowerLimit(joint) => self.limit[joint] += force,
                Owner::UpperLimit(joint) => self.limit[joint] -= force,
                Owner::DryFriction(joint) => self.dry_friction[joint] = *force,
                Owner::Torque(joint) if greatest.is_some_and(|it| force.abs() >= it[joint] * AT_LIMIT) => {
                    self.saturated[joint] = *force;
                }
                _ => {}
            }
        }
    }
}

// Derived `Clone` would allocate on `clone_from`; states are copied once a transition.
impl Clone for State {
    fn clone(&self) -> Self {
        Self {
            time: self.time,
            root: self.root,
            angles: self.angles.clone(),
            velocities: self.velocities.clone(),
            parts: self.parts.clone(),
            memory: self.memory.clone(),
        }
    }

    fn clone_from(&mut self, source: &Self) {
        self.time = source.time;
        self.root = source.root;
        self.angles.clone_from(&source.angles);
        self.velocities.clone_from(&source.velocities);
        self.parts.clone_from(&source.parts);
        self.memory.clone_from(&source.memory);
    }
}

impl Clone for Memory {
    fn clone(&self) -> Self {
        Self {
            contact: self.contact.clone(),
            limit: self.limit.clone(),
            dry_friction: self.dry_friction.clone(),
            saturated: self.saturated.clone(),
            loops: self.loops.clone(),
            pull: self.pull.clone(),
            swing: self.swing,
            part: self.part,
        }
    }

    fn clone_from(&mut self, source: &Self) {
        self.contact.clone_from(&source.contact);
        self.limit.clone_from(&source.limit);
        self.dry_friction.clone_from(&source.dry_friction);
        self.saturated.clone_from(&source.saturated);
        self.loops.clone_from(&source.loops);
        self.pull.clone_from(&source.pull);
        self.swing = source.swing;
        self.part = source.part;
    }
}
