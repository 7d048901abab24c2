//! Running a scenario: from its setup to its lines of output.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::document::STEPS;
use super::lines::{ContactLine, EnergyLine, JointLine, Line, MomentumLine, SampleLine, Summary};
use super::script::Script;
use super::setup::ScenarioSetup;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::Playing;
use gaitwright_physics::scene::{Accuracy, AccuracyChoice};
use gaitwright_physics::sim::contact::Against;
use gaitwright_physics::sim::{Failure, Simulator};

/// A scenario made ready to run.
#[derive(Debug)]
pub struct PreparedScenario {
    simulator: Simulator,
    script: Script,
    playing: Option<Playing>,
    /// Targets at the beginning and at the end of a step, rad or m, one a joint.
    now: Vec<f64>,
    next: Vec<f64>,
    /// Names of the scene's obstacles.
    obstacles: Vec<String>,
    /// Number of steps of the whole simulation.
    steps: u64,
    /// Number of steps between two samples.
    stride: u64,
    choice: Option<AccuracyChoice>,
}

/// How a simulation ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ScenarioEnd {
    /// It ran to its end.
    Finished,
    /// A step failed; the summary states why.
    Failed,
    /// The receiver of the lines asked for no more.
    Stopped,
}

impl PreparedScenario {
    /// Makes `setup` ready to be run as finely as `accuracy` asks (for the reason of `choice`, if it was chosen),
    /// with a line of output every `sample_every` seconds.
    ///
    /// # Errors
    /// Every fault of scene, accuracy and drive.
    pub fn new(
        setup: ScenarioSetup,
        accuracy: &Accuracy,
        choice: Option<AccuracyChoice>,
        sample_every: f64,
    ) -> Result<Self, InputError> {
        let plan = setup.plan(accuracy)?;
        let ScenarioSetup { model, scene, start, script, duration, .. } = setup;
        if duration / plan.step() > STEPS {
            let reason = format!("the simulation would take more than {STEPS:e} steps of {} s", plan.step());
            return Err(InputError::impossible("/duration", reason));
        }
        let obstacles = scene.obstacles.iter().enumerate();
        let obstacles = obstacles.map(|(index, obstacle)| obstacle.name(index)).collect();
        let steps = (duration / plan.step()).round().max(1.0) as u64;
        let stride = (sample_every / plan.step()).round().max(1.0) as u64;
        let mut next = vec![0.0; model.joint_count()];
        let mut playing = script.playing(&start.root);
        script.steered_targets(&mut playing, 0.0, &start.root, &mut next);
        let simulator = Simulator::new(Arc::new(plan), start);
        Ok(Self { simulator, script, playing, now: next.clone(), next, obstacles, steps, stride, choice })
    }

    /// Number of steps that the simulation will take.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Runs the simulation and passes every line to `sink`, which returns whether it wants more.
    pub fn run(self, sink: impl FnMut(Line) -> bool) -> ScenarioEnd {
        self.run_while(|| true, sink)
    }

    /// The same as long as `wanted`, called at every step, returns true.
    pub fn run_while(mut self, wanted: impl Fn() -> bool, mut sink: impl FnMut(Line) -> bool) -> ScenarioEnd {
        let plan = self.simulator.plan().clone();
        let mut computing = Duration::ZERO;
        let mut joint_error: f64 = 0.0;
        let mut done = 0;
        let mut failure = None;
        if !sink(Line::Sample(Box::new(self.sample()))) {
            return ScenarioEnd::Stopped;
        }
        while done < self.steps {
            if !wanted() {
                return ScenarioEnd::Stopped;
            }
            let result = self.step(done, &mut computing);
            if let Err(failed) = result {
                failure = Some(failed);
                break;
            }
            done += 1;
            joint_error =
                joint_error.max(self.simulator.limit_violation()).max(self.simulator.joint_separation());
            if done % self.stride == 0 && !sink(Line::Sample(Box::new(self.sample()))) {
                return ScenarioEnd::Stopped;
            }
        }
        let ended = if failure.is_some() { ScenarioEnd::Failed } else { ScenarioEnd::Finished };
        let record = *self.simulator.record();
        let summary = Summary {
            status: status(failure.as_ref(), record.unsolved_steps, done),
            steps: done,
            step_seconds: computing.as_secs_f64(),
            simulated_seconds: done as f64 * plan.step(),
            effects: plan.decisions.clone(),
            accuracy: plan.accuracy,
            accuracy_choice: self.choice.take(),
            greatest_joint_error: joint_error,
            record,
        };
        if sink(Line::End { summary: Box::new(summary) }) { ended } else { ScenarioEnd::Stopped }
    }

    /// Takes step number `index` (from 0) and adds its computing time to `computing`.
    fn step(&mut self, index: u64, computing: &mut Duration) -> Result<(), Failure> {
        std::mem::swap(&mut self.now, &mut self.next);
        let time = (index + 1) as f64 * self.simulator.plan().step();
        let root = &self.simulator.state().root;
        self.script.steered_targets(&mut self.playing, time, root, &mut self.next);
        let command = self.script.command(&self.now, &self.next);
        let started = Instant::now();
        let result = self.simulator.step(command);
        *computing += started.elapsed();
        result
    }

    /// The present state as a line of output.
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

/// How a simulation of `steps` steps ended, of which `unsolved` were left unsolved.
fn status(failure: Option<&Failure>, unsolved: u64, steps: u64) -> String {
    match (failure, unsolved) {
        (Some(failure), _) => format!("failed: {failure}"),
        (None, 0) => "finished".to_owned(),
        (None, _) => format!("finished, but {unsolved} of {steps} steps are unsolved"),
    }
}
