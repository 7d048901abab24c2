//! The world around the character, and the effects simulated in it.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Ground, Obstacle, obstacle::obstacle_faults};
use crate::fault::Fault;

/// Greatest component of gravity, m/s²: a thousand times the Earth's. To find that a quadruped cannot stand takes seconds under so much,
/// and minutes under a hundred times more.
const GRAVITY: f64 = 1e4;

/// The world around the character and the effects to be simulated in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// Gravitational acceleration in the world frame, m/s².
    pub gravity: [f64; 3],
    /// What the character stands on; `null` for nothing.
    pub ground: Option<Ground>,
    /// Coulomb friction coefficient of the ground, and of every link and obstacle that has none of its own; in a contact the smaller
    /// of both surfaces' holds.
    pub friction: f64,
    /// Coefficient of restitution of the ground, and of every link and obstacle that has none of its own, 0 to 1: the share of its
    /// closing speed with which a contact opens again; in a contact the greater of both surfaces' holds.
    #[schemars(range(min = 0, max = 1))]
    pub restitution: f64,
    /// Time constant of contacts, s: 0 for rigid ones. With another they are critically damped springs that take this time
    /// whatever they carry (as MuJoCo's `solref`), sink in, and do not rebound by `restitution`.
    #[schemars(range(min = 0))]
    pub contact_time_constant: f64,
    /// Static shapes in the scene.
    pub obstacles: Vec<Obstacle>,
    /// Effects by name; those left out are `auto`.
    pub effects: BTreeMap<Effect, Switch>,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            gravity: [0.0, 0.0, -9.81],
            ground: Some(Ground::default()),
            friction: 0.8,
            restitution: 0.0,
            contact_time_constant: 0.0,
            obstacles: Vec::new(),
            effects: BTreeMap::new(),
        }
    }
}

impl Scene {
    /// The gravitational acceleration that acts, in the world frame, m/s²: none where the effect is switched off.
    pub fn acting_gravity(&self) -> Vector3<f64> {
        match self.effects.get(&Effect::Gravity) {
            Some(Switch::Off) => Vector3::zeros(),
            _ => Vector3::from(self.gravity),
        }
    }

    /// Everything in the scene that is impossible.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if !self.gravity.iter().all(|component| component.abs() <= GRAVITY) {
            let reason = format!("gravity must be three finite numbers within {GRAVITY:e} m/s²");
            faults.push(Fault::new("/gravity", reason));
        }
        if let Some(ground) = &self.ground {
            faults.extend(ground.faults().into_iter().map(|fault| fault.under("/ground")));
        }
        if !(self.friction.is_finite() && self.friction >= 0.0) {
            faults.push(Fault::new(
                "/friction",
                "the friction coefficient must be a finite number of at least 0",
            ));
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            faults
                .push(Fault::new("/restitution", "the coefficient of restitution must lie between 0 and 1"));
        }
        if !(self.contact_time_constant.is_finite() && self.contact_time_constant >= 0.0) {
            faults.push(Fault::new(
                "/contact_time_constant",
                "the time constant of contacts must be a finite number of at least 0",
            ));
        }
        faults.extend(obstacle_faults(&self.obstacles).into_iter().map(|fault| fault.under("/obstacles")));
        faults
    }
}

/// A part of the physics that a scene may or may not call for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Effect {
    /// Weight.
    Gravity,
    /// Coriolis, centrifugal and gyroscopic forces.
    VelocityForces,
    /// Contact with the ground.
    GroundContact,
    /// Coulomb friction in contacts.
    Friction,
    /// Contact between links of the character.
    SelfCollision,
    /// Contact with static shapes of the scene.
    Obstacles,
    /// Joints stop at the ends of their range.
    JointLimits,
    /// Actuators have a greatest torque.
    TorqueLimits,
    /// The torque of actuators falls as their speed rises.
    SpeedLimits,
    /// Tracking adds the torque that would bring the joints to the target's velocity within a period.
    Feedforward,
    /// The root link keeps its orientation.
    TrunkRotationLock,
    /// Viscous damping in joints.
    JointDamping,
    /// Dry friction in joints.
    JointFriction,
    /// Correction of penetration and of violated joint limits.
    Stabilization,
}

impl Effect {
    /// Every effect, in the order of the documents.
    pub const ALL: [Self; 14] = [
        Self::Gravity,
        Self::VelocityForces,
        Self::GroundContact,
        Self::Friction,
        Self::SelfCollision,
        Self::Obstacles,
        Self::JointLimits,
        Self::TorqueLimits,
        Self::SpeedLimits,
        Self::Feedforward,
        Self::TrunkRotationLock,
        Self::JointDamping,
        Self::JointFriction,
        Self::Stabilization,
    ];

    /// The name used in documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gravity => "gravity",
            Self::VelocityForces => "velocity_forces",
            Self::GroundContact => "ground_contact",
            Self::Friction => "friction",
            Self::SelfCollision => "self_collision",
            Self::Obstacles => "obstacles",
            Self::JointLimits => "joint_limits",
            Self::TorqueLimits => "torque_limits",
            Self::SpeedLimits => "speed_limits",
            Self::Feedforward => "feedforward",
            Self::TrunkRotationLock => "trunk_rotation_lock",
            Self::JointDamping => "joint_damping",
            Self::JointFriction => "joint_friction",
            Self::Stabilization => "stabilization",
        }
    }
}

/// Whether an effect is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Switch {
    /// Always.
    On,
    /// Never.
    Off,
    /// Where the scene and the character call for it.
    #[default]
    Auto,
}
