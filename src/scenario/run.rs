//! From a scenario to its lines.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::document::{CharacterSource, InlineCharacter, Scenario};
use super::lines::{ContactLine, EnergyLine, JointLine, Line, MomentumLine, SampleLine, Summary};
use crate::character::{self, Options, Reading, Source};
use crate::fault::{Fault, InputError};
use crate::model::Model;
use crate::motion::{Motion, Player};
use crate::scene::{Drive, Feedforward, Gains, MaxTorque, StepPlan, Terrain};
use crate::sim::contact::Against;
use crate::sim::{Command, Simulator, State};
use crate::stance::{self, Stance};

/// How the paths in a scenario are followed.
pub trait Files {
    /// Reads the character at `path`.
    ///
    /// # Errors
    /// Why it cannot be read, or may not.
    fn character(&self, path: &str) -> Result<Reading, InputError>;

    /// Reads the bytes of the motion document at `path`.
    ///
    /// # Errors
    /// Why they cannot be read, or may not.
    fn motion(&self, path: &str) -> Result<Vec<u8>, InputError>;
}

/// No path may be followed: everything has to be inline, as in a request from outside.
#[derive(Debug, Clone, Copy)]
pub struct NoFiles;

impl Files for NoFiles {
    fn character(&self, _path: &str) -> Result<Reading, InputError> {
        Err(InputError::impossible(
            "",
            "a path cannot be used here; give {\"urdf\": \"…\"} or {\"json\": {…}}",
        ))
    }

    fn motion(&self, _path: &str) -> Result<Vec<u8>, InputError> {
        Err(InputError::impossible("", "a path cannot be used here; give the motion document itself"))
    }
}

/// A scenario made ready to run.
#[derive(Debug)]
pub struct Prepared {
    simulator: Simulator,
    commands: Commands,
    /// Names of the scene's obstacles.
    obstacles: Vec<String>,
    steps: u64,
    stride: u64,
}

/// What the joints are asked to do over the whole simulation.
#[derive(Debug)]
enum Commands {
    Passive,
    Torque(Vec<f64>),
    Hold(Vec<f64>),
    Track { player: Player, now: Vec<f64>, next: Vec<f64> },
}

/// How a simulation ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// It ran to its end.
    Finished,
    /// It could not go on; the summary says why.
    Failed,
    /// The receiver of the lines wanted no more.
    Stopped,
}

impl Scenario {
    /// Reads the character, finds its standing pose and compiles the step plan.
    ///
    /// # Errors
    /// Every fault of the document, with JSON pointers into it; those of its character below
    /// `/character`.
    pub fn prepare(&self, files: &impl Files) -> Result<Prepared, InputError> {
        let faults = self.faults();
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        let reading = self.read_character(files).map_err(|error| error.under("/character"))?;
        let model = Arc::new(Model::new(Arc::new(reading.character), self.fixed_base));
        let stance = Stance::find(&model, &self.scene);
        let mut faults = Vec::new();
        let state = self.start_state(&model, &stance, &mut faults);
        let (gains, commands) = self.commands(&model, &stance, files, &mut faults)?;
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
        let plan = StepPlan::compile(&self.scene, &self.accuracy, gains.as_ref(), &model)?;
        let steps = (self.duration / plan.step()).round().max(1.0) as u64;
        let stride = (self.sample_every / plan.step()).round().max(1.0) as u64;
        let obstacles = self.scene.obstacles.iter().enumerate();
        let obstacles = obstacles.map(|(index, obstacle)| obstacle.name(index)).collect();
        let simulator = Simulator::new(model, Arc::new(plan), state);
        Ok(Prepared { simulator, commands, obstacles, steps, stride })
    }

    fn read_character(&self, files: &impl Files) -> Result<Reading, InputError> {
        match &self.character {
            CharacterSource::Path(path) => files.character(path),
            CharacterSource::Inline(InlineCharacter::Urdf(text)) => {
                character::read(text.as_bytes(), Source::Urdf, Options::default())
            }
            CharacterSource::Inline(InlineCharacter::Json(value)) => {
                character::read(value.to_string().as_bytes(), Source::Json, Options::default())
            }
        }
    }

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
        match (&self.start.root, &self.scene.ground) {
            (Some(root), _) => state.root = root.into(),
            (None, Some(ground)) if !(self.fixed_base || self.start.joints.is_empty()) => {
                state.root.position.z = stance::resting_height(model, &state.angles, &Terrain::new(ground));
            }
            _ => {}
        }
        if self.start.root.is_some() || !self.start.joints.is_empty() {
            state.forget();
        }
        state
    }

    /// The gains of the drive, if it has targets, and what it asks of the joints.
    fn commands(
        &self,
        model: &Model,
        stance: &Stance,
        files: &impl Files,
        faults: &mut Vec<Fault>,
    ) -> Result<(Option<Gains>, Commands), InputError> {
        let mut fill = |values: &mut [f64], joints: &std::collections::BTreeMap<String, f64>| {
            for (name, value) in joints {
                match model.joint(name) {
                    Some(_) if !value.is_finite() => {
                        faults.push(Fault::new(format!("/drive/joints/{name}"), "must be a finite number"));
                    }
                    Some(index) => values[index] = *value,
                    None => faults.push(unknown_joint("/drive/joints", name)),
                }
            }
        };
        Ok(match &self.drive {
            Drive::None => (None, Commands::Passive),
            Drive::Torque { joints } => {
                let mut torque = vec![0.0; model.joint_count()];
                fill(&mut torque, joints);
                (None, Commands::Torque(torque))
            }
            Drive::Hold { stiffness, damping, feedforward, max_torque, joints } => {
                let mut targets = stance.angles.clone();
                fill(&mut targets, joints);
                let mut gains = stance.gains.clone();
                adjust(&mut gains, *stiffness, *damping, Some(*feedforward), Some(*max_torque), model);
                (Some(gains), Commands::Hold(targets))
            }
            Drive::Track { stiffness, damping, feedforward, max_torque, motion } => {
                let motion = read_motion(motion, files).map_err(|error| error.under("/drive/motion"))?;
                let player =
                    Player::new(&motion, &model.joint_names).map_err(|error| error.under("/drive/motion"))?;
                let mut gains = motion.gains_for(&model.joint_names);
                adjust(&mut gains, *stiffness, *damping, *feedforward, *max_torque, model);
                let mut now = vec![0.0; model.joint_count()];
                player.targets(0.0, &mut now);
                (Some(gains), Commands::Track { player, next: now.clone(), now })
            }
        })
    }
}

fn unknown_joint(place: &str, name: &str) -> Fault {
    Fault::new(format!("{place}/{name}"), format!("the character has no movable joint \"{name}\""))
}

fn read_motion(motion: &serde_json::Value, files: &impl Files) -> Result<Motion, InputError> {
    match motion {
        serde_json::Value::String(path) => Motion::parse(&files.motion(path)?),
        inline => Motion::parse(inline.to_string().as_bytes()),
    }
}

/// Replaces what the drive says by itself.
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

impl Prepared {
    /// Number of steps that the simulation will take.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Runs the simulation and gives every line to `sink`, which answers whether it wants more.
    pub fn run(mut self, mut sink: impl FnMut(Line) -> bool) -> Ended {
        let plan = self.simulator.plan().clone();
        let mut computing = Duration::ZERO;
        let mut penetration: f64 = 0.0;
        let mut joint_error: f64 = 0.0;
        let mut done = 0;
        let mut failure = None;
        if !sink(Line::Sample(Box::new(self.sample()))) {
            return Ended::Stopped;
        }
        while done < self.steps {
            let result = self.step(done, &mut computing);
            if let Err(failed) = result {
                failure = Some(failed);
                break;
            }
            done += 1;
            penetration = self.simulator.contacts().map(|contact| contact.depth).fold(penetration, f64::max);
            joint_error = joint_error.max(self.simulator.limit_violation());
            if done % self.stride == 0 && !sink(Line::Sample(Box::new(self.sample()))) {
                return Ended::Stopped;
            }
        }
        let ended = if failure.is_some() { Ended::Failed } else { Ended::Finished };
        let summary = Summary {
            status: failure.map_or_else(|| "finished".to_owned(), |failure| format!("failed: {failure}")),
            steps: done,
            step_seconds: computing.as_secs_f64(),
            simulated_seconds: done as f64 * plan.step(),
            effects: plan.decisions.clone(),
            accuracy: plan.accuracy,
            greatest_penetration: penetration,
            greatest_joint_error: joint_error,
        };
        if sink(Line::End { summary: Box::new(summary) }) { ended } else { Ended::Stopped }
    }

    /// Step number `index`, its computing time added to `computing`.
    fn step(&mut self, index: u64, computing: &mut Duration) -> Result<(), crate::sim::Failure> {
        let command = match &mut self.commands {
            Commands::Passive => Command::Passive,
            Commands::Torque(torque) => Command::Torque(torque),
            Commands::Hold(targets) => Command::Track { now: targets, next: targets },
            Commands::Track { player, now, next } => {
                std::mem::swap(now, next);
                player.targets((index + 1) as f64 * self.simulator.plan().step(), next);
                Command::Track { now, next }
            }
        };
        let started = Instant::now();
        let result = self.simulator.step(command);
        *computing += started.elapsed();
        result
    }

    fn sample(&self) -> SampleLine {
        let simulator = &self.simulator;
        let (model, state) = (simulator.model(), simulator.state());
        let joint = |index: usize| JointLine {
            angle: state.angles[index],
            velocity: state.velocities[index],
            torque: simulator.torques()[index],
        };
        let energy = simulator.energy();
        let momentum = simulator.momentum();
        let contacts = simulator.contacts().map(|contact| ContactLine {
            link: model.character.links[contact.link].name.clone(),
            other: match contact.against {
                Against::Ground => "ground".to_owned(),
                Against::Obstacle(index) => self.obstacles[index].clone(),
                Against::Link { link, .. } => model.character.links[link].name.clone(),
            },
            position: contact.position.coords.into(),
            normal: contact.normal.into(),
            force: contact.force.into(),
        });
        SampleLine {
            time: state.time,
            root: (&state.root).into(),
            joints: model.joint_names.iter().cloned().zip((0..model.joint_count()).map(joint)).collect(),
            center_of_mass: simulator.center_of_mass().coords.into(),
            energy: EnergyLine { kinetic: energy.kinetic, potential: energy.potential },
            momentum: MomentumLine { linear: momentum.linear.into(), angular: momentum.angular.into() },
            contacts: contacts.collect(),
            residual: simulator.residual(),
        }
    }
}
