//! Everything that the future of a simulation depends on.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::contact::Touch;
use super::rows::{Owner, Rows};
use super::spatial::Motion;
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

impl Root {
    /// Its velocity, with the world frame's axes about its origin.
    #[inline]
    pub(super) fn motion(&self) -> Motion {
        Motion { angular: self.angular_velocity, linear: self.linear_velocity }
    }
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

/// Change of the velocities over a step, a second.
#[derive(Debug, PartialEq)]
pub(super) struct Acceleration {
    /// Of the root's angular velocity and of its origin's velocity, rad/s² and m/s².
    pub root: Motion,
    /// Of the joints, rad/s² or m/s².
    pub joints: Vec<f64>,
}

/// Forces of the contacts that there were, by their slots.
#[derive(Debug, Default, PartialEq)]
pub struct ContactForces {
    /// Slot, and normal and two tangential forces, N; in the order of the slots.
    slots: Vec<(usize, [f64; 3])>,
}

impl ContactForces {
    /// Those at `slot`; zero where there was no contact.
    #[inline]
    pub fn at(&self, slot: usize) -> [f64; 3] {
        let found = self.slots.binary_search_by_key(&slot, |(slot, _)| *slot);
        found.map_or([0.0; 3], |index| self.slots[index].1)
    }

    /// Keeps the `forces` of `touches`, of which the tangential ones may be left out.
    pub(super) fn remember<'a>(&mut self, touches: &[Touch], forces: impl Iterator<Item = &'a [f64]>) {
        self.slots.clear();
        self.slots.extend(touches.iter().zip(forces).map(|(touch, forces)| {
            let mut all = [0.0; 3];
            all[..forces.len()].copy_from_slice(forces);
            (touch.slot, all)
        }));
        if !self.slots.is_sorted_by_key(|(slot, _)| *slot) {
            self.slots.sort_unstable_by_key(|(slot, _)| *slot);
        }
    }
}

/// What the solver remembers of the last step.
#[derive(Debug, PartialEq)]
pub(super) struct Memory {
    /// Forces of the contacts.
    pub contacts: ContactForces,
    /// The same in the first pass of contact-aware tracking.
    pub controlled: ContactForces,
    /// Force of every joint's limit, N m, positive at the lower end and negative at the upper.
    pub limit: Vec<f64>,
    /// Dry friction of every joint, N m.
    pub dry_friction: Vec<f64>,
    /// Torque of every joint whose actuator is at its limit, N m; 0 for all others.
    pub saturated: Vec<f64>,
    /// With which the velocities changed.
    pub acceleration: Acceleration,
    /// Square of the force that every joint carried, N².
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
                contacts: ContactForces::default(),
                controlled: ContactForces::default(),
                limit: vec![0.0; joints],
                dry_friction: vec![0.0; joints],
                saturated: vec![0.0; joints],
                acceleration: Acceleration { root: Motion::ZERO, joints: vec![0.0; joints] },
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

    /// Moves positions and velocities away from those of `coarse`, by `share` of what they are apart.
    pub fn extrapolate(&mut self, coarse: &Self, share: f64) {
        let pairs = self.angles.iter_mut().zip(&coarse.angles);
        for (own, other) in pairs.chain(self.velocities.iter_mut().zip(&coarse.velocities)) {
            *own += share * (*own - other);
        }
        let (own, other) = (&mut self.root, &coarse.root);
        own.position += share * (own.position - other.position);
        own.linear_velocity += share * (own.linear_velocity - other.linear_velocity);
        own.angular_velocity += share * (own.angular_velocity - other.angular_velocity);
        let turn = (own.orientation * other.orientation.inverse()).scaled_axis();
        own.orientation = UnitQuaternion::from_scaled_axis(share * turn) * own.orientation;
        own.orientation.renormalize_fast();
    }

    /// Forgets what the last step left beside root and joints, as has to be done after a change of them by
    /// hand: its forces, and in maximal coordinates where each body is by itself.
    pub fn forget(&mut self) {
        self.parts.clear();
        self.memory.contacts.slots.clear();
        self.memory.controlled.slots.clear();
        self.memory.limit.fill(0.0);
        self.memory.dry_friction.fill(0.0);
        self.memory.saturated.fill(0.0);
        self.memory.acceleration.root = Motion::ZERO;
        self.memory.acceleration.joints.fill(0.0);
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
        self.contacts.remember(touches, rows.force.chunks_exact(per_touch));
        self.limit.fill(0.0);
        self.dry_friction.fill(0.0);
        self.saturated.fill(0.0);
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
            contacts: self.contacts.clone(),
            controlled: self.controlled.clone(),
            limit: self.limit.clone(),
            dry_friction: self.dry_friction.clone(),
            saturated: self.saturated.clone(),
            acceleration: self.acceleration.clone(),
            pull: self.pull.clone(),
            swing: self.swing,
            part: self.part,
        }
    }

    fn clone_from(&mut self, source: &Self) {
        self.contacts.clone_from(&source.contacts);
        self.controlled.clone_from(&source.controlled);
        self.limit.clone_from(&source.limit);
        self.dry_friction.clone_from(&source.dry_friction);
        self.saturated.clone_from(&source.saturated);
        self.acceleration.clone_from(&source.acceleration);
        self.pull.clone_from(&source.pull);
        self.swing = source.swing;
        self.part = source.part;
    }
}

impl Clone for ContactForces {
    fn clone(&self) -> Self {
        Self { slots: self.slots.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.slots.clone_from(&source.slots);
    }
}

impl Clone for Acceleration {
    fn clone(&self) -> Self {
        Self { root: self.root, joints: self.joints.clone() }
    }

    fn clone_from(&mut self, source: &Self) {
        self.root = source.root;
        self.joints.clone_from(&source.joints);
    }
}
