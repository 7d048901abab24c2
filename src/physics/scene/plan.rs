//! What a step computes: compiled once from a model, a scene and an accuracy.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};

use super::actuator::ActuatorLimits;
use super::decision::{CONTACTS, Decision, decide};
use super::surfaces::Surfaces;
use super::units::CharacterUnits;
use super::{Accuracy, Coordinates, Effect, Feedforward, FrictionCone, Gains, JointBias, Scene, Terrain};
use crate::fault::{Fault, InputError};
use crate::model::Model;
use crate::model::collision::convex::Convex;

/// The ends of a range of motion that has none.
pub const UNLIMITED: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Everything about a step that does not change from step to step. [`StepPlan::compile`] fills every field.
///
/// An effect that is off is absent here (`None`, `false`, zero or empty), so that a step spends no time on it. Arrays
/// over joints have [`Model::joint_count`] entries.
#[derive(Debug, Clone)]
pub struct StepPlan {
    /// The model this was compiled for; [`crate::sim::Simulator::new`] steps this one.
    pub model: Arc<Model>,
    /// Step, solver, coordinates and friction cone, as given.
    pub accuracy: Accuracy,
    /// Gravitational acceleration in the world frame, m/s²; zero when the effect is off.
    pub gravity: Vector3<f64>,
    /// The length and the time in which thresholds are counted.
    pub units: CharacterUnits,
    /// Whether Coriolis, centrifugal and gyroscopic forces are computed.
    pub velocity_forces: bool,
    /// The surface of the ground; `None` without ground contact.
    pub ground: Option<Terrain>,
    /// Whether contacts between shapes of the character are computed.
    pub self_collision: bool,
    /// Solids that stand still, in the world frame, in the order of the scene's obstacles; empty without contact with
    /// obstacles.
    pub obstacles: Vec<Convex>,
    /// Time constant of soft contacts, s; `None` where contacts are rigid or absent.
    pub contact_time_constant: Option<f64>,
    /// The greatest coefficient of restitution, above 0 and at most 1; `None` where contacts do not rebound, as soft ones do not.
    pub restitution: Option<f64>,
    /// The greatest Coulomb friction coefficient; `None` without friction.
    pub friction: Option<f64>,
    /// Friction and restitution of whatever can touch.
    pub surfaces: Surfaces,
    /// Lower and upper end of each joint's range of motion, rad or m, one a joint ([`UNLIMITED`] where it has none); `None` without
    /// joint limits.
    pub limits: Option<Vec<[f64; 2]>>,
    /// Spring and damper of the drive; `None` when joints are not driven toward targets.
    pub drive: Option<DrivePlan>,
    /// Whether the root link keeps its orientation.
    pub trunk_rotation_lock: bool,
    /// Viscous damping, N m s/rad or N s/m, one a joint; `None` without joint damping.
    pub damping: Option<Vec<f64>>,
    /// Dry friction, N m or N, one a joint; `None` without it.
    pub dry_friction: Option<Vec<f64>>,
    /// Whether penetration, violated limits and open joints are corrected.
    pub stabilization: bool,
    /// Every effect, whether it is simulated, and why.
    pub decisions: BTreeMap<Effect, Decision>,
}

/// How joints are driven toward their targets: f₀ − K (q − q*) − D (q̇ − q̇*), within `max_torque`, with q* the target.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivePlan {
    /// Spring K, N m/rad or N/m, one a joint; 0 for one without an actuator.
    pub stiffness: Vec<f64>,
    /// Damper D, N m s/rad or N s/m, one a joint; 0 for one without an actuator.
    pub damping: Vec<f64>,
    /// Greatest torque or force, N m or N, one a joint; infinite where unlimited. `None` without torque limits.
    pub max_torque: Option<Vec<f64>>,
    /// Greatest speed, at which no torque is left, rad/s or m/s, one a joint; infinite where unlimited. `None` without
    /// speed limits.
    pub max_speed: Option<Vec<f64>>,
    /// How the offset torque f₀ is found.
    pub feedforward: Feedforward,
    /// Time within which f₀ brings a joint to its target's velocity, s.
    pub feedforward_period: f64,
    /// Constant torque beside spring and feedforward, N m or N, one a joint; 0 for one without an actuator.
    pub offset: Vec<f64>,
    /// `max_torque` and `max_speed`, one a joint.
    limits: Vec<ActuatorLimits>,
}

impl DrivePlan {
    /// `gains` at the joints of `model` that have an actuator, and 0 at those that have none.
    fn new(model: &Model, gains: &Gains, on: impl Fn(Effect) -> bool) -> Self {
        let at_driven = |values: &[f64]| {
            values
                .iter()
                .zip(&model.driven)
                .map(|(value, driven)| if *driven { *value } else { 0.0 })
                .collect()
        };
        let finite = |limits: &[Option<f64>]| -> Vec<f64> {
            limits.iter().map(|limit| limit.unwrap_or(f64::INFINITY)).collect()
        };
        let max_torque = on(Effect::TorqueLimits).then(|| finite(&gains.max_torque));
        let max_speed = on(Effect::SpeedLimits).then(|| finite(&model.speed));
        let of = |limits: &Option<Vec<f64>>, joint: usize| {
            limits.as_ref().map_or(f64::INFINITY, |limits| limits[joint])
        };
        let limits = (0..model.joint_count())
            .map(|joint| ActuatorLimits { torque: of(&max_torque, joint), speed: of(&max_speed, joint) })
            .collect();
        Self {
            stiffness: at_driven(&gains.stiffness),
            damping: at_driven(&gains.damping),
            max_torque,
            max_speed,
            limits,
            feedforward: if on(Effect::Feedforward) { gains.feedforward } else { Feedforward::None },
            feedforward_period: gains.feedforward_period,
            offset: match gains.offset.is_empty() {
                true => vec![0.0; model.joint_count()],
                false => at_driven(&gains.offset),
            },
        }
    }
}

impl DrivePlan {
    /// How far ahead the feedforward pass looks in a step of `step` seconds, s. With contacts it is the `period`: a contact is
    /// stopped within that time, by a force that does not depend on the step, as it would within one step of that length.
    pub(crate) fn horizon(&self, period: f64, step: f64) -> f64 {
        match self.feedforward {
            Feedforward::ContactAware => period.max(step),
            Feedforward::None | Feedforward::ContactFree => step,
        }
    }

    /// What the actuator of joint `joint` can do.
    #[inline]
    pub fn limits(&self, joint: usize) -> ActuatorLimits {
        self.limits[joint]
    }

    /// What every joint's actuator can do.
    #[inline]
    pub fn all_limits(&self) -> &[ActuatorLimits] {
        &self.limits
    }
}

impl StepPlan {
    /// The feedforward of the drive; none where there is no drive.
    pub fn feedforward(&self) -> Feedforward {
        self.drive.as_ref().map_or(Feedforward::None, |drive| drive.feedforward)
    }

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
        model: &Arc<Model>,
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
        let maximal = accuracy.coordinates == Coordinates::Maximal;
        if let Some(body) = maximal.then(|| model.body_without_inertia()).flatten() {
            let link = &model.character.links[model.links.iter().position(|it| it.body == body).unwrap_or(0)];
            let reason = format!(
                "the body of link {} has no inertia of its own, which maximal coordinates need",
                link.name
            );
            return Err(InputError::impossible("/accuracy/coordinates", reason));
        }
        let surfaces = Surfaces::new(scene, model);
        let greatest = surfaces.greatest();
        let decisions = decide(scene, gains, model, maximal, greatest);
        let on = |effect| decisions.get(&effect).is_some_and(|decision: &Decision| decision.on);
        let contact_time_constant = Some(scene.contact_time_constant)
            .filter(|time_constant| *time_constant > 0.0 && CONTACTS.into_iter().any(on));
        let gravity = scene.acting_gravity();
        Ok(Self {
            model: model.clone(),
            accuracy: *accuracy,
            gravity,
            units: CharacterUnits::new(model.size, &gravity),
            velocity_forces: on(Effect::VelocityForces),
            ground: scene.ground.as_ref().filter(|_| on(Effect::GroundContact)).map(Terrain::new),
            self_collision: on(Effect::SelfCollision),
            obstacles: if on(Effect::Obstacles) { obstacles(scene) } else { Vec::new() },
            contact_time_constant,
            restitution: (greatest.restitution > 0.0
                && CONTACTS.into_iter().any(on)
                && contact_time_constant.is_none())
            .then_some(greatest.restitution),
            friction: on(Effect::Friction).then_some(greatest.friction),
            surfaces,
            limits: on(Effect::JointLimits)
                .then(|| model.limits.iter().map(|range| range.unwrap_or(UNLIMITED)).collect()),
            drive: gains.map(|gains| DrivePlan::new(model, gains, on)),
            trunk_rotation_lock: on(Effect::TrunkRotationLock),
            damping: on(Effect::JointDamping).then(|| model.damping.clone()),
            dry_friction: on(Effect::JointFriction).then(|| model.friction.clone()),
            stabilization: on(Effect::Stabilization),
            decisions,
        })
    }

    /// What the actuator of joint `joint` can do.
    #[inline]
    pub fn actuator_limits(&self, joint: usize) -> ActuatorLimits {
        let unlimited = ActuatorLimits { torque: f64::INFINITY, speed: f64::INFINITY };
        self.drive.as_ref().map_or(unlimited, |drive| drive.limits(joint))
    }

    /// Time step, s.
    pub fn step(&self) -> f64 {
        self.accuracy.step
    }

    /// Whether the rows of joints and loops contain the bias −h J̇ v, which comes from the rotation of their own axes
    /// during the step ([`JointBias::Consistent`]).
    pub fn has_joint_bias(&self) -> bool {
        self.velocity_forces && self.accuracy.joint_bias == JointBias::Consistent
    }

    /// Whether the friction cone is circular, and not a pyramid.
    pub fn circular_friction(&self) -> bool {
        self.accuracy.friction_cone == FrictionCone::Cone
    }
}

/// The solids of a scene without faults.
fn obstacles(scene: &Scene) -> Vec<Convex> {
    let placed = scene.obstacles.iter().filter_map(|obstacle| obstacle.placed().ok());
    placed.map(|placed| Convex::new(&placed, &Isometry3::identity())).collect()
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
    if !(gains.offset.is_empty() || gains.offset.len() == joints) {
        faults.push(Fault::new("/offset", format!("{} values for {joints} joints", gains.offset.len())));
    }
    if !gains.offset.iter().all(|offset| offset.is_finite()) {
        faults.push(Fault::new("/offset", "every value must be a finite number"));
    }
    if !(gains.feedforward_period.is_finite() && gains.feedforward_period >= 0.0) {
        faults.push(Fault::new("/feedforward_period", "must be a finite number of at least 0"));
    }
    faults
}
