//! What a step computes: decided once, when a character and a scene meet.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Accuracy, Effect, Feedforward, FrictionCone, Gains, Ground, Scene, Switch};
use crate::fault::{Fault, InputError};
use crate::model::Model;

/// Whether an effect is simulated, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Decision {
    /// Whether it is simulated.
    pub on: bool,
    /// The reason, in one sentence.
    pub because: String,
}

/// Everything about a step that does not change from step to step.
///
/// What is off is absent here, so that a step neither asks nor pays for it.
#[derive(Debug, Clone, PartialEq)]
pub struct StepPlan {
    /// The settings this was compiled from.
    pub accuracy: Accuracy,
    /// Gravitational acceleration, m/s²; zero when the effect is off.
    pub gravity: Vector3<f64>,
    /// Whether Coriolis, centrifugal and gyroscopic forces are computed.
    pub velocity_forces: bool,
    /// Height of the ground plane, m; `None` without ground contact.
    pub ground: Option<f64>,
    /// Friction coefficient; `None` without friction.
    pub friction: Option<f64>,
    /// Ranges of motion, rad or m, one a joint; `None` without joint limits.
    pub limits: Option<Vec<Option<[f64; 2]>>>,
    /// Spring and damper of the drive; `None` when joints are not driven toward targets.
    pub drive: Option<DrivePlan>,
    /// Whether the root link keeps its orientation.
    pub trunk_rotation_lock: bool,
    /// Viscous damping, N m s/rad, one a joint; `None` without joint damping.
    pub damping: Option<Vec<f64>>,
    /// Dry friction, N m, one a joint; `None` without it.
    pub dry_friction: Option<Vec<f64>>,
    /// Whether penetration and violated limits are corrected.
    pub stabilization: bool,
    /// Every effect, whether it is simulated, and why.
    pub decisions: BTreeMap<Effect, Decision>,
}

/// How joints are driven toward their targets.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivePlan {
    /// Spring K, N m/rad, one a joint.
    pub stiffness: Vec<f64>,
    /// Damper D, N m s/rad, one a joint.
    pub damping: Vec<f64>,
    /// Greatest torque, N m, one a joint; infinite where unlimited. `None` without torque limits.
    pub max_torque: Option<Vec<f64>>,
    /// How the offset torque is found.
    pub feedforward: Feedforward,
}

impl StepPlan {
    /// Compiles the plan for `model` in `scene`, simulated as finely as `accuracy` asks, with joints
    /// driven by `gains` (or not driven at all).
    ///
    /// # Errors
    /// Every fault of scene, accuracy and gains, with JSON pointers below `/scene`, `/accuracy` and
    /// `/drive`.
    pub fn compile(
        scene: &Scene,
        accuracy: &Accuracy,
        gains: Option<&Gains>,
        model: &Model,
    ) -> Result<Self, InputError> {
        let mut faults: Vec<Fault> = scene.faults().into_iter().map(|fault| fault.under("/scene")).collect();
        faults.extend(accuracy.faults().into_iter().map(|fault| fault.under("/accuracy")));
        if let Some(gains) = gains {
            faults.extend(
                gain_faults(gains, model.joint_count()).into_iter().map(|fault| fault.under("/drive")),
            );
        }
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        let decisions = decide(scene, gains, model);
        let on = |effect| decisions.get(&effect).is_some_and(|decision: &Decision| decision.on);
        Ok(Self {
            accuracy: *accuracy,
            gravity: if on(Effect::Gravity) { Vector3::from(scene.gravity) } else { Vector3::zeros() },
            velocity_forces: on(Effect::VelocityForces),
            ground: match scene.ground {
                Some(Ground::Plane { height }) if on(Effect::GroundContact) => Some(height),
                _ => None,
            },
            friction: on(Effect::Friction).then_some(scene.friction),
            limits: on(Effect::JointLimits).then(|| model.limits.clone()),
            drive: gains.map(|gains| DrivePlan {
                stiffness: gains.stiffness.clone(),
                damping: gains.damping.clone(),
                max_torque: on(Effect::TorqueLimits)
                    .then(|| gains.max_torque.iter().map(|limit| limit.unwrap_or(f64::INFINITY)).collect()),
                feedforward: if on(Effect::Feedforward) { gains.feedforward } else { Feedforward::None },
            }),
            trunk_rotation_lock: on(Effect::TrunkRotationLock),
            damping: on(Effect::JointDamping).then(|| model.damping.clone()),
            dry_friction: on(Effect::JointFriction).then(|| model.friction.clone()),
            stabilization: on(Effect::Stabilization),
            decisions,
        })
    }

    /// Time step, s.
    pub fn step(&self) -> f64 {
        self.accuracy.step
    }

    /// Whether friction is a circular cone, and not a pyramid.
    pub fn circular_friction(&self) -> bool {
        self.accuracy.friction_cone == FrictionCone::Cone
    }
}

fn gain_faults(gains: &Gains, joints: usize) -> Vec<Fault> {
    let mut faults = Vec::new();
    let mut check = |name: &str, count: usize, valid: bool| {
        if count != joints {
            faults.push(Fault::new(format!("/{name}"), format!("{count} values for {joints} joints")));
        }
        if !valid {
            faults.push(Fault::new(format!("/{name}"), "every value must be a finite number of at least 0"));
        }
    };
    let valid = |value: &f64| value.is_finite() && *value >= 0.0;
    check("stiffness", gains.stiffness.len(), gains.stiffness.iter().all(valid));
    check("damping", gains.damping.len(), gains.damping.iter().all(valid));
    check("max_torque", gains.max_torque.len(), gains.max_torque.iter().flatten().all(valid));
    faults
}

/// What speaks for (`Ok`) or against (`Err`) simulating an effect, in one sentence.
type Call = Result<&'static str, &'static str>;

/// Decides every effect. An effect that is switched on is simulated wherever the scene and the
/// character have anything for it to act on.
fn decide(scene: &Scene, gains: Option<&Gains>, model: &Model) -> BTreeMap<Effect, Decision> {
    let mut decisions: BTreeMap<Effect, Decision> = BTreeMap::new();
    for effect in Effect::ALL {
        let call = call(effect, scene, gains, model, &decisions);
        let decision = match (scene.effects.get(&effect).copied().unwrap_or_default(), call) {
            (Switch::Off, _) => Decision { on: false, because: "switched off".into() },
            (Switch::On, Ok(_)) => Decision { on: true, because: "switched on".into() },
            (Switch::On, Err(_)) if effect == Effect::TrunkRotationLock && !model.fixed_base => {
                Decision { on: true, because: "switched on".into() }
            }
            (Switch::Auto, Ok(because)) => Decision { on: true, because: because.into() },
            (_, Err(because)) => Decision { on: false, because: because.into() },
        };
        decisions.insert(effect, decision);
    }
    decisions
}

fn call(
    effect: Effect,
    scene: &Scene,
    gains: Option<&Gains>,
    model: &Model,
    earlier: &BTreeMap<Effect, Decision>,
) -> Call {
    let on = |effect| earlier.get(&effect).is_some_and(|decision| decision.on);
    let either = |yes: bool, because: &'static str, otherwise: &'static str| {
        if yes { Ok(because) } else { Err(otherwise) }
    };
    match effect {
        Effect::Gravity => {
            either(scene.gravity != [0.0; 3], "the scene has gravity", "the scene has no gravity")
        }
        Effect::VelocityForces => either(
            !model.fixed_base || model.joint_count() > 0,
            "bodies can rotate",
            "nothing in the character can move",
        ),
        Effect::GroundContact => match (scene.ground, model.ground_slots) {
            (None, _) => Err("the scene has no ground"),
            (_, 0) => Err("the character has no collision shapes"),
            _ => Ok("the scene has ground and the character has collision shapes"),
        },
        Effect::Friction => {
            if !on(Effect::GroundContact) {
                Err("there are no contacts")
            } else {
                either(
                    scene.friction > 0.0,
                    "contacts have friction",
                    "the scene's friction coefficient is 0",
                )
            }
        }
        Effect::SelfCollision => Err("not simulated by this version"),
        Effect::Obstacles => Err("the scene has no obstacles"),
        Effect::JointLimits => either(
            model.limits.iter().any(Option::is_some),
            "the character has joints with limits",
            "no joint of the character has limits",
        ),
        Effect::TorqueLimits => match gains {
            None => Err("no joint is driven toward a target"),
            Some(gains) => either(
                gains.max_torque.iter().any(Option::is_some),
                "actuators have a greatest torque",
                "no actuator has a greatest torque",
            ),
        },
        Effect::Feedforward => match gains {
            None => Err("no joint is driven toward a target"),
            Some(gains) => either(
                gains.feedforward != Feedforward::None,
                "the drive asks for it",
                "the drive asks for none",
            ),
        },
        Effect::TrunkRotationLock => either(
            false,
            "",
            if model.fixed_base { "the root is bolted to the world" } else { "nobody asked for it" },
        ),
        Effect::JointDamping => {
            let any = model.damping.iter().any(|damping| *damping > 0.0);
            either(any, "the character has damped joints", "no joint of the character is damped")
        }
        Effect::JointFriction => {
            let any = model.friction.iter().any(|friction| *friction > 0.0);
            either(
                any,
                "the character has joints with dry friction",
                "no joint of the character has dry friction",
            )
        }
        Effect::Stabilization => either(
            on(Effect::GroundContact) || on(Effect::JointLimits),
            "contacts and limits drift without it",
            "there are neither contacts nor limits",
        ),
    }
}
