//! A motion played in the simulator in one continuous stretch: sampled, and watched for falls.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::model::Model;
use crate::motion::{Player, Playing};
use crate::scene::StepPlan;
use crate::sim::contact::Against;
use crate::sim::{Command, Contact, Failure, Root, Simulator, State, StepRecord};
use crate::stance::Upright;

/// Pose, velocities, torques and contacts at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// s.
    pub time: f64,
    /// The root link.
    pub root: Root,
    /// Joint angles, rad or m.
    pub angles: Vec<f64>,
    /// Joint velocities, rad/s or m/s.
    pub velocities: Vec<f64>,
    /// Target angles, rad or m.
    pub targets: Vec<f64>,
    /// Torques of the actuators over the last step, N m or N; 0 at the start.
    pub torques: Vec<f64>,
    /// World frames of the character's links, in their order.
    pub link_poses: Vec<Isometry3<f64>>,
    /// Contacts of the last step; none at the start.
    pub contacts: Vec<Contact>,
    /// Normal force of the ground on each of the character's links, N, the mean over all steps since the sample before;
    /// 0 at the start. Neither obstacles nor other links count as ground.
    pub loads: Vec<f64>,
    /// World frame, m.
    pub center_of_mass: Point3<f64>,
}

/// A stretch of simulated motion.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    /// Evenly spaced, the first at the start.
    pub samples: Vec<Sample>,
    /// Time at which the character had fallen, s; the stretch ends there.
    pub fell_at: Option<f64>,
    /// Why the simulation could not go on; the stretch ends there.
    pub failure: Option<Failure>,
    /// ∫ Σ |τ q̇| dt over the joints, J.
    pub joint_work: f64,
    /// ∫ Σ max(τ q̇, 0) dt over the joints, J.
    pub positive_work: f64,
    /// What the steps took, and what they left unsolved.
    pub record: StepRecord,
}

/// What is played, where, and for how long.
#[derive(Debug, Clone, Copy)]
pub struct Playback<'a> {
    /// The character.
    pub model: &'a Arc<Model>,
    /// The scene and the drive, compiled.
    pub plan: &'a Arc<StepPlan>,
    /// Where it starts.
    pub start: &'a State,
    /// The targets.
    pub player: &'a Player,
    /// When it counts as fallen.
    pub upright: &'a Upright,
    /// How long to play, s.
    pub seconds: f64,
    /// Time between samples, s; taken as a whole number of steps, at least one.
    pub sample_every: f64,
}

/// A push in the course of a motion: from one step to the next the whole character has another velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Push {
    /// When the first step with the changed velocity ends, s.
    pub time: f64,
    /// By how much the velocity of every part changes, world frame, m/s: the impulse over the character's mass.
    pub velocity: Vector3<f64>,
}

impl Playback<'_> {
    /// Plays to the end, to a fall, to a failure, or until `stop` returns true (it is called at every step).
    pub fn run(&self, stop: impl Fn() -> bool) -> Trace {
        self.run_pushed(None, stop)
    }

    /// The same, with a push.
    pub fn run_pushed(&self, push: Option<Push>, stop: impl Fn() -> bool) -> Trace {
        let step = self.plan.step();
        let steps = (self.seconds / step).round() as usize;
        let stride = ((self.sample_every / step).round() as usize).max(1);
        let joints = self.model.joint_count();
        let (mut now, mut next) = (vec![0.0; joints], vec![0.0; joints]);
        let mut playing = Playing::new(self.player, &self.start.root);
        playing.targets(self.player, 0.0, &self.start.root, &mut now);
        let mut simulator = Simulator::new(self.plan.clone(), self.start.clone());
        let push = push.map(|push| (((push.time / step).round() as usize).max(1), push.velocity));
        let links = self.model.character.links.len();
        let mut loads = vec![0.0; links];
        let mut trace = Trace::default();
        trace.samples.push(sample(&simulator, 0.0, &now, loads.clone()));
        for index in 1..=steps {
            let time = index as f64 * step;
            if let Some((_, velocity)) = push.filter(|(at, _)| *at == index) {
                let mut state = simulator.state().clone();
                state.push(velocity);
                simulator.set_state(&state);
            }
            playing.targets(self.player, time, &simulator.state().root, &mut next);
            if let Err(failure) = simulator.step(Command::Track { now: &now, next: &next }) {
                trace.failure = Some(failure);
                break;
            }
            std::mem::swap(&mut now, &mut next);
            for (torque, rate) in simulator.torques().iter().zip(&simulator.state().velocities) {
                trace.joint_work += (torque * rate).abs() * step;
                trace.positive_work += (torque * rate).max(0.0) * step;
            }
            for contact in simulator.contacts().filter(|contact| contact.against == Against::Ground) {
                loads[contact.link] += contact.force.dot(&contact.normal) / stride as f64;
            }
            if index % stride == 0 {
                let loads = std::mem::replace(&mut loads, vec![0.0; links]);
                trace.samples.push(sample(&simulator, time, &now, loads));
            }
            if stop() {
                break;
            }
            if !self.upright.holds(simulator.state()) {
                trace.fell_at = Some(time);
                break;
            }
        }
        trace.record = *simulator.record();
        trace
    }
}

fn sample(simulator: &Simulator, time: f64, targets: &[f64], loads: Vec<f64>) -> Sample {
    let state = simulator.state();
    Sample {
        time,
        root: state.root,
        angles: state.angles.clone(),
        velocities: state.velocities.clone(),
        targets: targets.to_vec(),
        torques: simulator.torques().to_vec(),
        link_poses: simulator.link_poses(),
        contacts: if time > 0.0 { simulator.contacts().collect() } else { Vec::new() },
        loads,
        center_of_mass: simulator.center_of_mass(),
    }
}
