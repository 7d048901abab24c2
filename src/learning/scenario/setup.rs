//! A scenario with its documents read: character, start and drive, ready to be compiled.

use std::collections::BTreeMap;
use std::sync::Arc;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use nalgebra::UnitQuaternion;

use super::document::{CharacterSource, InlineCharacter, Scenario};
use super::script::Script;
use gaitwright_physics::character::{self, Options, Reading, Source};
use gaitwright_physics::fault::{Fault, InputError, member};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::{Motion, Player, TargetLimits};
use gaitwright_physics::scene::{Accuracy, Drive, Feedforward, Gains, MaxTorque, Scene, StepPlan, Terrain};
use gaitwright_physics::sim::State;
use gaitwright_physics::stance::{self, Stance};

/// How the files that a scenario refers to are read.
pub trait Files {
    /// Reads the character at `path`.
    ///
    /// # Errors
    /// Why it cannot be read, or must not be.
    fn character(&self, path: &str) -> Result<Reading, InputError>;

    /// Reads the bytes of the motion document at `path`.
    ///
    /// # Errors
    /// Why they cannot be read, or must not be.
    fn motion(&self, path: &str) -> Result<Vec<u8>, InputError>;
}

/// Refuses every path: all documents must be inline, as in a request over HTTP.
#[derive(Debug, Clone, Copy)]
pub struct NoFiles;

impl Files for NoFiles {
    fn character(&self, _path: &str) -> Result<Reading, InputError> {
        Err(InputError::impossible(
            "",
            "a path cannot be used here; give {\"urdf\": \"…\"}, {\"json\": {…}} or {\"zip\": \"…\"}",
        ))
    }

    fn motion(&self, _path: &str) -> Result<Vec<u8>, InputError> {
        Err(InputError::impossible("", "a path cannot be used here; give the motion document itself"))
    }
}

/// Everything that defines a simulation except its accuracy.
#[derive(Debug, Clone)]
pub struct ScenarioSetup {
    /// The character.
    pub model: Arc<Model>,
    /// The world around it.
    pub scene: Scene,
    /// Gains of the drives; `None` where no joint has a target.
    pub gains: Option<Gains>,
    /// The state at time 0.
    pub start: State,
    /// What drives its joints.
    pub script: Script,
    /// Simulated time, s.
    pub duration: f64,
}

impl ScenarioSetup {
    /// The plan of a step with the settings `accuracy`.
    ///
    /// # Errors
    /// Every fault of scene, accuracy and gains, see [`StepPlan::compile`].
    pub fn plan(&self, accuracy: &Accuracy) -> Result<StepPlan, InputError> {
        StepPlan::compile(&self.scene, accuracy, self.gains.as_ref(), &self.model)
    }
}

impl Scenario {
    /// Reads the character and what drives it, and finds its standing pose.
    ///
    /// # Errors
    /// Every fault of the document, with JSON pointers into it; those of its character below
    /// `/character`.
    pub fn set_up(&self, files: &impl Files) -> Result<ScenarioSetup, InputError> {
        let reading = self.check(files)?;
        let model = Arc::new(Model::new(Arc::new(reading.character), Base::fixed_if(self.fixed_base)));
        let stance = Stance::find(&model, &self.scene);
        let mut faults = Vec::new();
        let start = self.start_state(&model, &stance, &mut faults);
        let (gains, script) = self.script(&model, &stance, files, &mut faults)?;
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        let (scene, duration) = (self.scene.clone(), self.duration);
        Ok(ScenarioSetup { model, scene, gains, start, script, duration })
    }

    /// Reads the character, and looks at everything else that can be judged without simulating.
    ///
    /// # Errors
    /// Every fault of the document and of its character, with JSON pointers into the document.
    pub fn check(&self, files: &impl Files) -> Result<Reading, InputError> {
        let reading = self.read_character(files).map_err(|error| error.under("/character"));
        InputError::beside(self.faults(), reading)
    }

    /// Reads the character.
    ///
    /// # Errors
    /// Every fault of the document, or a file that cannot be read.
    pub fn read_character(&self, files: &impl Files) -> Result<Reading, InputError> {
        match &self.character {
            CharacterSource::Path(path) => files.character(path),
            CharacterSource::Inline(InlineCharacter::Urdf(text)) => {
                character::read(text.as_bytes(), Source::Urdf, Options::default())
            }
            CharacterSource::Inline(InlineCharacter::Json(value)) => {
                character::read(value.to_string().as_bytes(), Source::Json, Options::default())
            }
            CharacterSource::Inline(InlineCharacter::Zip(text)) => {
                let archive = BASE64_STANDARD.decode(text).map_err(|error| {
                    InputError::impossible("/zip", format!("this is not Base64: {error}"))
                })?;
                character::read(&archive, Source::Zip, Options::default())
            }
            CharacterSource::Inline(InlineCharacter::Id(_)) => {
                Err(InputError::impossible("/id", "only a service knows characters by their ids"))
            }
        }
    }

    /// The state at time 0: the standing pose with what `start` changes. Unknown joints are added to `faults`.
    fn start_state(&self, model: &Model, stance: &Stance, faults: &mut Vec<Fault>) -> State {
        let mut state = stance.state.clone();
        for (name, joint) in &self.start.joints {
            match model.joint(name) {
                Some(index) => {
                    state.angles[index] = joint.angle.unwrap_or(state.angles[index]);
                    state.velocities[index] = joint.velocity;
                }
                None => faults.push(unknown_joint("/start/joints", name)),
            }
        }
        if !self.start.joints.is_empty() {
            let start = |joint: usize| self.start.joints.get(&model.joint_names[joint]);
            let given = |joint: usize| start(joint).is_some_and(|start| start.angle.is_some());
            stance::close_loops(model, &mut state.angles, given);
        }
        match (&self.start.root, &self.scene.ground) {
            (Some(root), _) => state.root = root.into(),
            (None, Some(ground)) if !(self.fixed_base || self.start.joints.is_empty()) => {
                // The resting height is computed for an upright root; that of the standing pose may be inclined.
                state.root.orientation = UnitQuaternion::identity();
                state.root.position.z = stance::resting_height(model, &state.angles, &Terrain::new(ground));
            }
            _ => {}
        }
        if self.start.root.is_some() || !self.start.joints.is_empty() {
            state.forget();
        }
        state
    }

    /// The gains of the drive, if it has targets, and its commands. Faults of its joints are added to `faults`.
    fn script(
        &self,
        model: &Model,
        stance: &Stance,
        files: &impl Files,
        faults: &mut Vec<Fault>,
    ) -> Result<(Option<Gains>, Script), InputError> {
        let acts = matches!(self.drive, Drive::Hold { .. } | Drive::Velocity { .. } | Drive::Torque { .. });
        let mut fill = |values: &mut [f64], joints: &BTreeMap<String, f64>| {
            for (name, value) in joints {
                match model.joint(name) {
                    Some(_) if !value.is_finite() => {
                        faults.push(Fault::new(member("/drive/joints", name), "must be a finite number"));
                    }
                    Some(index) if acts && !model.driven[index] => {
                        let reason = format!("the joint \"{name}\" is passive: it has no actuator");
                        faults.push(Fault::new(member("/drive/joints", name), reason));
                    }
                    Some(index) => values[index] = *value,
                    None => faults.push(unknown_joint("/drive/joints", name)),
                }
            }
        };
        Ok(match &self.drive {
            Drive::None {} => (None, Script::Passive),
            Drive::Torque { joints } => {
                let mut torque = vec![0.0; model.joint_count()];
                fill(&mut torque, joints);
                (Some(motors(model, MaxTorque::Character)), Script::Torque(torque))
            }
            Drive::Velocity { max_torque, joints } => {
                // The joints left out, which are passive, are those that stay NaN.
                let mut wanted = vec![f64::NAN; model.joint_count()];
                fill(&mut wanted, joints);
                let wanted = wanted.into_iter().map(|rate| (!rate.is_nan()).then_some(rate)).collect();
                (Some(motors(model, *max_torque)), Script::Velocity(wanted))
            }
            Drive::Hold {
                stiffness,
                damping,
                feedforward,
                feedforward_period,
                max_torque,
                offset,
                joints,
            } => {
                let mut targets = stance.angles.clone();
                fill(&mut targets, joints);
                let mut gains = stance.gains.clone();
                adjust(&mut gains, *stiffness, *damping, Some(*feedforward), Some(*max_torque), model);
                gains.feedforward_period = *feedforward_period;
                add_offset(&mut gains, offset, model, faults);
                (Some(gains), Script::Hold(targets))
            }
            Drive::Track {
                stiffness,
                damping,
                feedforward,
                feedforward_period,
                max_torque,
                offset,
                motion,
            } => {
                let motion = read_motion(motion, files).map_err(|error| error.under("/drive/motion"))?;
                let limits = TargetLimits::of(&model.character);
                let player = Player::new(&motion, &model.joint_names, &limits)
                    .map_err(|error| error.under("/drive/motion"))?;
                let mut gains = motion.gains_for(&model.joint_names);
                adjust(&mut gains, *stiffness, *damping, *feedforward, *max_torque, model);
                gains.feedforward_period = feedforward_period.unwrap_or(gains.feedforward_period);
                add_offset(&mut gains, offset, model, faults);
                (Some(gains), Script::Track(player))
            }
        })
    }
}

fn unknown_joint(place: &str, name: &str) -> Fault {
    Fault::new(member(place, name), format!("the character has no movable joint \"{name}\""))
}

fn read_motion(motion: &serde_json::Value, files: &impl Files) -> Result<Motion, InputError> {
    match motion {
        serde_json::Value::String(path) => Motion::parse(&files.motion(path)?),
        inline => Motion::parse(inline.to_string().as_bytes()),
    }
}

/// Replaces the offset torques by those that the drive states. Faults of its joints are added to `faults`.
fn add_offset(gains: &mut Gains, offset: &BTreeMap<String, f64>, model: &Model, faults: &mut Vec<Fault>) {
    if !offset.is_empty() && gains.offset.is_empty() {
        gains.offset = vec![0.0; model.joint_count()];
    }
    for (name, torque) in offset {
        match model.joint(name) {
            _ if !torque.is_finite() => {
                faults.push(Fault::new(member("/drive/offset", name), "must be a finite number"));
            }
            Some(joint) if !model.driven[joint] => {
                let reason = format!("the joint \"{name}\" is passive: it has no actuator");
                faults.push(Fault::new(member("/drive/offset", name), reason));
            }
            Some(joint) => gains.offset[joint] = *torque,
            None => faults.push(unknown_joint("/drive/offset", name)),
        }
    }
}

/// Actuators without springs or dampers.
fn motors(model: &Model, max_torque: MaxTorque) -> Gains {
    let none = vec![0.0; model.joint_count()];
    let mut gains = Gains {
        stiffness: none.clone(),
        damping: none,
        max_torque: vec![None; model.joint_count()],
        ..Gains::default()
    };
    adjust(&mut gains, None, None, None, Some(max_torque), model);
    gains
}

/// Replaces the gains that the drive states.
fn adjust(
    gains: &mut Gains,
    stiffness: Option<f64>,
    damping: Option<f64>,
    feedforward: Option<Feedforward>,
    max_torque: Option<MaxTorque>,
    model: &Model,
) {
    if let Some(stiffness) = stiffness {
        gains.stiffness.fill(stiffness);
    }
    if let Some(damping) = damping {
        gains.damping.fill(damping);
    }
    if let Some(feedforward) = feedforward {
        gains.feedforward = feedforward;
    }
    match max_torque {
        None => {}
        Some(MaxTorque::Character) => gains.max_torque.clone_from(&model.effort),
        Some(MaxTorque::All(limit)) => gains.max_torque.fill(Some(limit)),
        Some(MaxTorque::Unlimited) => gains.max_torque.fill(None),
    }
}
