//! The documents' words for scene, accuracy and drive, with their defaults.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fault::Fault;

/// The world around the character and the effects to be simulated in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Scene {
    /// Gravitational acceleration in the world frame, m/s².
    pub gravity: [f64; 3],
    /// What the character stands on; `null` for nothing.
    pub ground: Option<Ground>,
    /// Coulomb friction coefficient of every contact.
    pub friction: f64,
    /// Coefficient of restitution of every contact, 0 to 1. Only 0 can be simulated so far.
    pub restitution: f64,
    /// Static shapes in the scene. Only an empty list can be simulated so far.
    pub obstacles: Vec<serde_json::Value>,
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
            obstacles: Vec::new(),
            effects: BTreeMap::new(),
        }
    }
}

impl Scene {
    /// Everything in the scene that is impossible, or that this simulator does not compute.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if self.gravity.iter().any(|g| !g.is_finite()) {
            faults.push(Fault::new("/gravity", "gravity must be three finite numbers"));
        }
        if let Some(Ground::Plane { height }) = self.ground
            && !height.is_finite()
        {
            faults.push(Fault::new("/ground/height", "the height must be a finite number"));
        }
        if !(self.friction.is_finite() && self.friction >= 0.0) {
            faults.push(Fault::new(
                "/friction",
                "the friction coefficient must be a finite number of at least 0",
            ));
        }
        if self.restitution != 0.0 {
            faults.push(Fault::new("/restitution", "restitution is not simulated yet; only 0 is accepted"));
        }
        if !self.obstacles.is_empty() {
            faults.push(Fault::new(
                "/obstacles",
                "obstacles are not simulated yet; only an empty list is accepted",
            ));
        }
        for (effect, switch) in &self.effects {
            if *switch == Switch::On && !effect.available() {
                let name = effect.name();
                faults.push(Fault::new(format!("/effects/{name}"), format!("{name} is not simulated yet")));
            }
        }
        faults
    }
}

/// The ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Ground {
    /// A horizontal plane; solid below.
    Plane {
        /// z of the plane in the world frame, m.
        #[serde(default)]
        height: f64,
    },
}

impl Default for Ground {
    fn default() -> Self {
        Self::Plane { height: 0.0 }
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
    /// Tracking uses the torque that would follow the target exactly.
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
    pub const ALL: [Self; 13] = [
        Self::Gravity,
        Self::VelocityForces,
        Self::GroundContact,
        Self::Friction,
        Self::SelfCollision,
        Self::Obstacles,
        Self::JointLimits,
        Self::TorqueLimits,
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
            Self::Feedforward => "feedforward",
            Self::TrunkRotationLock => "trunk_rotation_lock",
            Self::JointDamping => "joint_damping",
            Self::JointFriction => "joint_friction",
            Self::Stabilization => "stabilization",
        }
    }

    /// Whether this simulator computes the effect.
    pub fn available(self) -> bool {
        !matches!(self, Self::SelfCollision | Self::Obstacles)
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

/// How finely a scene is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Accuracy {
    /// Time step, s; with `step_tolerance` the longest.
    pub step: f64,
    /// Greatest error that one step may add to a joint angle (rad), a joint position or the root's
    /// position (m): steps are divided until they keep it. `null` takes every step as it is.
    pub step_tolerance: Option<f64>,
    /// Method of integration.
    pub integrator: Integrator,
    /// Solver of the complementarity problem.
    pub solver: SolverChoice,
    /// Coordinates in which the character is simulated.
    pub coordinates: Coordinates,
    /// What joint rows ask for in maximal coordinates; of no effect in reduced ones.
    pub joint_bias: JointBias,
    /// Shape of the set of admissible friction forces.
    pub friction_cone: FrictionCone,
}

impl Default for Accuracy {
    fn default() -> Self {
        Self {
            step: 0.002,
            step_tolerance: None,
            integrator: Integrator::default(),
            solver: SolverChoice::default(),
            coordinates: Coordinates::default(),
            joint_bias: JointBias::default(),
            friction_cone: FrictionCone::default(),
        }
    }
}

impl Accuracy {
    /// Everything impossible in these settings.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        if !(1e-7..=0.1).contains(&self.step) {
            faults.push(Fault::new("/step", "the step must lie between 1e-7 and 0.1 s"));
        }
        if self.step_tolerance.is_some_and(|tolerance| !(1e-12..=1.0).contains(&tolerance)) {
            faults
                .push(Fault::new("/step_tolerance", "the tolerance of a step must lie between 1e-12 and 1"));
        }
        if !(1..=100_000).contains(&self.solver.iterations) {
            faults.push(Fault::new("/solver/iterations", "iterations must lie between 1 and 100000"));
        }
        if !(self.solver.tolerance.is_finite() && self.solver.tolerance >= 0.0) {
            faults
                .push(Fault::new("/solver/tolerance", "the tolerance must be a finite number of at least 0"));
        }
        if self.coordinates == Coordinates::Maximal {
            faults.push(Fault::new("/coordinates", "this simulator does not have maximal coordinates yet"));
        }
        if self.solver.kind == SolverKind::Lemke && self.friction_cone == FrictionCone::Cone {
            faults.push(Fault::new(
                "/friction_cone",
                "the exact solver lemke works on linear problems: use the friction cone `pyramid` with it",
            ));
        }
        faults
    }
}

/// Method of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// New velocities first, then positions with the new velocities (Tokizaki & Hasegawa eqs. 8-9).
    #[default]
    SemiImplicitEuler,
    /// Moreau and Jean's time stepping with θ = 1/2: forces and contacts at the middle of the step, of
    /// second order where the motion is smooth.
    MoreauJean,
}

/// A solver and its budget.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SolverChoice {
    /// Which solver.
    pub kind: SolverKind,
    /// Greatest number of sweeps or pivots.
    pub iterations: u32,
    /// Residual, m/s or rad/s, below which an iterative solver stops.
    pub tolerance: f64,
}

impl Default for SolverChoice {
    fn default() -> Self {
        Self { kind: SolverKind::default(), iterations: 50, tolerance: 1e-9 }
    }
}

/// The solvers of the mixed linear complementarity problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum SolverKind {
    /// Newton's method on the natural map, with Gauss-Seidel sweeps behind it: exact to rounding in a
    /// few iterations.
    #[default]
    Newton,
    /// Projected Gauss-Seidel: iterative, with a budget.
    Pgs,
    /// Lemke's method with lexicographic ties: exact.
    Lemke,
}

/// Coordinates in which the character is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Coordinates {
    /// Joint coordinates on the kinematic tree.
    #[default]
    Reduced,
    /// Six coordinates a body, with joints as rows (Tokizaki & Hasegawa eqs. 5-27).
    Maximal,
}

/// What a joint's rows ask of the new velocities of its two bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JointBias {
    /// J v⁺ = −h J̇ v: what joint coordinates imply, so that both coordinates move alike.
    #[default]
    Consistent,
    /// J v⁺ = 0, as the paper has it: the joint's own turning is left to the next step.
    Paper,
}

/// Shape of the set of admissible friction forces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FrictionCone {
    /// The circular cone of Coulomb's law.
    #[default]
    Cone,
    /// A four-sided pyramid along two tangents: a linear complementarity problem.
    Pyramid,
}

/// What moves the joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema, Default)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Drive {
    /// Passive joints.
    #[default]
    None,
    /// Constant torques.
    Torque {
        /// N m (N for prismatic joints) by joint name; 0 where left out.
        #[serde(default)]
        joints: BTreeMap<String, f64>,
    },
    /// Fixed target angles.
    Hold {
        /// Spring K, N m/rad (N/m); suited to the character where left out.
        #[serde(default)]
        stiffness: Option<f64>,
        /// Damper D, N m s/rad (N s/m); suited to the character where left out.
        #[serde(default)]
        damping: Option<f64>,
        /// How the offset torque f₀ is found.
        #[serde(default)]
        feedforward: Feedforward,
        /// Greatest torque of the actuators.
        #[serde(default)]
        max_torque: MaxTorque,
        /// Target angle, rad or m, by joint name; the standing pose where left out.
        #[serde(default)]
        joints: BTreeMap<String, f64>,
    },
    /// A motion, looped.
    Track {
        /// Spring K, N m/rad (N/m); that of the motion where left out.
        #[serde(default)]
        stiffness: Option<f64>,
        /// Damper D, N m s/rad (N s/m); that of the motion where left out.
        #[serde(default)]
        damping: Option<f64>,
        /// How the offset torque f₀ is found; as in the motion where left out.
        #[serde(default)]
        feedforward: Option<Feedforward>,
        /// Greatest torque of the actuators; as in the motion where left out.
        #[serde(default)]
        max_torque: Option<MaxTorque>,
        /// A motion document, or the path of one.
        motion: serde_json::Value,
    },
}

/// How strongly each joint is driven toward its target (Tokizaki & Hasegawa eq. 19), one entry a
/// joint of the model.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// Spring K, N m/rad (N/m).
    pub stiffness: Vec<f64>,
    /// Damper D, N m s/rad (N s/m).
    pub damping: Vec<f64>,
    /// Greatest torque, N m (N); `null` is unlimited.
    pub max_torque: Vec<Option<f64>>,
    /// How the offset torque f₀ is found.
    pub feedforward: Feedforward,
}

/// How the offset torque f₀ of tracking is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Feedforward {
    /// f₀ = 0.
    None,
    /// The torque that would follow the target exactly if nothing touched the character.
    #[default]
    ContactFree,
    /// The torque that would follow the target exactly, contacts included.
    ContactAware,
}

/// Greatest torque of the actuators; in documents `"character"`, a number, or `null`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(from = "MaxTorqueWord", into = "MaxTorqueWord")]
#[schemars(with = "MaxTorqueWord")]
pub enum MaxTorque {
    /// The character's own effort limits.
    #[default]
    Character,
    /// The same limit for all joints, N m or N.
    All(f64),
    /// No limit.
    Unlimited,
}

/// The documents' spelling of [`MaxTorque`].
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
enum MaxTorqueWord {
    Number(f64),
    Word(CharacterWord),
    Null(()),
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum CharacterWord {
    Character,
}

impl From<MaxTorqueWord> for MaxTorque {
    fn from(word: MaxTorqueWord) -> Self {
        match word {
            MaxTorqueWord::Number(limit) => Self::All(limit),
            MaxTorqueWord::Word(CharacterWord::Character) => Self::Character,
            MaxTorqueWord::Null(()) => Self::Unlimited,
        }
    }
}

impl From<MaxTorque> for MaxTorqueWord {
    fn from(limit: MaxTorque) -> Self {
        match limit {
            MaxTorque::All(limit) => Self::Number(limit),
            MaxTorque::Character => Self::Word(CharacterWord::Character),
            MaxTorque::Unlimited => Self::Null(()),
        }
    }
}
