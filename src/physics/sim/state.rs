//! Everything that the future of a simulation depends on.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::memory::StepMemory;
use super::spatial::SpatialMotion;
use crate::model::Model;

/// Pose and velocity of the root link's frame, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// Origin, m.
    pub position: Point3<f64>,
    /// Orientation.
    pub orientation: UnitQuaternion<f64>,
    /// Velocity of the origin, m/s.
    pub linear_velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
}

impl Root {
    /// Its velocity, with the world frame's axes about its origin.
    #[inline]
    pub(super) fn motion(&self) -> SpatialMotion {
        SpatialMotion { angular: self.angular_velocity, linear: self.linear_velocity }
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
/// Besides positions and velocities it holds what the last step left for the next, so that a simulation
/// continued from a kept state gives the same bits as one that was never interrupted.
#[derive(Debug, PartialEq)]
pub struct State {
    /// Time, s.
    pub time: f64,
    /// The root link.
    pub root: Root,
    /// Joint angles, rad or m.
    pub angles: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub velocities: Vec<f64>,
    /// The bodies of maximal coordinates, one each, filled by `bodies_from_joints`; empty in reduced coordinates and
    /// before the first step, where the joint coordinates above determine them.
    pub(super) body_states: Vec<BodyState>,
    /// What the last step left for the next: warm starts, and what bounds its length.
    pub(super) memory: StepMemory,
}

/// Pose and velocity of a body in maximal coordinates, in the world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BodyState {
    /// Centre of mass, m.
    pub center: Point3<f64>,
    /// Orientation of the body frame.
    pub orientation: UnitQuaternion<f64>,
    /// Velocity of the centre of mass, m/s.
    pub linear_velocity: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vector3<f64>,
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
            body_states: Vec::new(),
            memory: StepMemory::new(joints),
        }
    }

    /// Distance of two states in position: the greatest difference of a joint angle (rad), a joint
    /// position (m), a coordinate of the root (m), or the angle between the root's orientations (rad).
    pub fn distance(&self, other: &Self) -> f64 {
        let joints = self.angles.iter().zip(&other.angles).map(|(a, b)| (a - b).abs());
        let roots = (self.root.position - other.root.position).amax();
        let angle = self.root.orientation.angle_to(&other.root.orientation);
        // Unlike f64::max, this keeps a NaN.
        joints.fold(roots.max(angle) + (roots + angle) * 0.0, |worst, each| {
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
        let rotation = (own.orientation * other.orientation.inverse()).scaled_axis();
        own.orientation = UnitQuaternion::from_scaled_axis(share * rotation) * own.orientation;
        own.orientation.renormalize_fast();
    }

    /// Gives all of it `velocity` (world frame, m/s) in addition to what it has.
    pub fn push(&mut self, velocity: Vector3<f64>) {
        self.root.linear_velocity += velocity;
        self.body_states.iter_mut().for_each(|body| body.linear_velocity += velocity);
    }

    /// Forgets what the last step left beside root and joints: its forces, and in maximal coordinates the body states.
    /// Needed after a change of the root or the joints from outside.
    pub fn forget(&mut self) {
        self.body_states.clear();
        self.memory.forget();
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
            body_states: self.body_states.clone(),
            memory: self.memory.clone(),
        }
    }

    fn clone_from(&mut self, source: &Self) {
        self.time = source.time;
        self.root = source.root;
        self.angles.clone_from(&source.angles);
        self.velocities.clone_from(&source.velocities);
        self.body_states.clone_from(&source.body_states);
        self.memory.clone_from(&source.memory);
    }
}
