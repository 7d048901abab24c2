//! A motion played from the standing pose in one continuous simulation, and judged.

use std::sync::Arc;

use gaitwright_learning::gait::{self, GaitContext, GaitReport, validity};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{Player, Trial, Validity};
use gaitwright_physics::playback::{Playback, Trace};
use gaitwright_physics::scene::{Accuracy, Gains, Scene, StepPlan, Terrain};
use gaitwright_physics::sim::Simulator;
use gaitwright_physics::stance::{Stance, Upright};

/// How long a motion is checked, s.
const CHECKED: f64 = 20.0;

/// Longest time between two samples of a check, s.
const FINE: f64 = 0.005;

/// How long a trial under a changed condition lasts, s.
const TRIED: f64 = 10.0;

/// Friction of the trials, relative to that of the scene.
const FRICTION_TRIALS: [f64; 2] = [0.5, 1.5];

/// Change of the sideways velocity by the push of the trials, m/s.
const PUSH: f64 = 0.2;

/// A motion and everything it takes to play it.
pub(super) struct MotionCheck<'a> {
    /// Who plays.
    pub(super) model: &'a Arc<Model>,
    /// Where it starts.
    pub(super) stance: &'a Stance,
    /// How strongly the joints follow.
    pub(super) gains: &'a Gains,
    /// Where it is played, with the effects as wanted.
    pub(super) scene: &'a Scene,
    /// How finely it is simulated.
    pub(super) accuracy: &'a Accuracy,
    /// The targets.
    pub(super) player: &'a Player,
    /// Wanted direction of travel.
    pub(super) direction: [f64; 3],
}

/// What a check has shown.
pub(super) struct CheckedMotion {
    /// Everything from the standing pose on.
    pub(super) trace: Trace,
    /// The gait of the looping part.
    pub(super) gait: GaitReport,
    /// What the looping part is worth.
    pub(super) validity: Validity,
}

impl MotionCheck<'_> {
    /// Plays for `seconds`, sampled every `sample_every` seconds, or until `stop` says so.
    ///
    /// # Errors
    ///
    /// Every fault of scene, accuracy and gains.
    pub(super) fn play(
        &self,
        seconds: f64,
        sample_every: f64,
        stop: &dyn Fn() -> bool,
    ) -> Result<Trace, InputError> {
        self.vary(self.scene, self.stance, seconds, sample_every, stop)
    }

    /// Plays for a long stretch, or until `stop` says so, and judges it but for the trials under changed
    /// conditions.
    ///
    /// # Errors
    ///
    /// Every fault of scene, accuracy and gains.
    pub(super) fn run(&self, stop: &dyn Fn() -> bool) -> Result<CheckedMotion, InputError> {
        let every = self.sample_every();
        let trace = self.play(CHECKED, every, stop)?;
        // The same once more up to the loop, for the work that is not the loop's.
        let entry = self.play(self.player.lead(), every, stop)?;
        let looping = Trace {
            samples: trace
                .samples
                .iter()
                .filter(|sample| sample.time >= self.player.lead())
                .cloned()
                .collect(),
            joint_work: trace.joint_work - entry.joint_work,
            positive_work: trace.positive_work - entry.positive_work,
            ..trace.clone()
        };
        let [x, y, z] = self.scene.gravity;
        let plan = Arc::new(self.plan(self.scene)?);
        let standing = Simulator::new(plan, self.stance.state.clone()).link_poses();
        let gait = gait::measure(
            &looping,
            &GaitContext {
                character: &self.model.character,
                support: &self.stance.support,
                standing: &standing,
                ground: self
                    .scene
                    .ground
                    .as_ref()
                    .map_or(0.0, |ground| Terrain::new(ground).height(0.0, 0.0)),
                mass: self.model.mass,
                gravity: x.hypot(y).hypot(z),
                direction: self.direction,
            },
        );
        let period = self.player.period();
        let validity = validity(&looping, &self.model.limits, &self.gains.max_torque, period);
        Ok(CheckedMotion { trace, gait, validity })
    }

    /// Plays with less and more friction, and after a push to the left; without what `stop` cuts short.
    ///
    /// # Errors
    ///
    /// Every fault of scene, accuracy and gains.
    pub(super) fn trials(&self, stop: &dyn Fn() -> bool) -> Result<Vec<Trial>, InputError> {
        let every = self.sample_every();
        let mut trials = Vec::new();
        for factor in FRICTION_TRIALS {
            let friction = factor * self.scene.friction;
            let scene = Scene { friction, ..self.scene.clone() };
            let trace = self.vary(&scene, self.stance, TRIED, every, stop)?;
            if stop() {
                return Ok(trials);
            }
            trials.push(trial(format!("friction {friction:.2}"), &trace));
        }
        let mut pushed = self.stance.clone();
        pushed.state.root.linear_velocity.y += PUSH;
        let trace = self.vary(self.scene, &pushed, TRIED, every, stop)?;
        if !stop() {
            let change = format!("sideways push of {:.2} N s at the start", PUSH * self.model.mass);
            trials.push(trial(change, &trace));
        }
        Ok(trials)
    }

    fn vary(
        &self,
        scene: &Scene,
        stance: &Stance,
        seconds: f64,
        sample_every: f64,
        stop: &dyn Fn() -> bool,
    ) -> Result<Trace, InputError> {
        let playback = Playback {
            model: self.model,
            plan: &Arc::new(self.plan(scene)?),
            start: &stance.state,
            player: self.player,
            upright: &Upright::new(self.model, self.stance, self.scene),
            seconds,
            sample_every,
        };
        Ok(playback.run(stop))
    }

    fn plan(&self, scene: &Scene) -> Result<StepPlan, InputError> {
        StepPlan::compile(scene, self.accuracy, Some(self.gains), self.model)
    }

    /// Time between two samples, s: short, and such that the loop's start and end are sampled where
    /// they lie on whole steps.
    fn sample_every(&self) -> f64 {
        let step = self.accuracy.step;
        let steps = |seconds: f64| (seconds / step).round() as usize;
        let common = gcd(steps(self.player.lead()), steps(self.player.period()));
        let fine = (FINE / step).max(1.0) as usize;
        let stride = (1..=fine).rev().find(|stride| common.is_multiple_of(*stride)).unwrap_or(1);
        stride as f64 * step
    }
}

fn trial(change: String, trace: &Trace) -> Trial {
    let end = trace.samples.last().map_or(0.0, |sample| sample.time);
    Trial {
        change,
        upright_seconds: trace.fell_at.unwrap_or(end),
        speed: 0.0,
        relative_speed: None,
        of_seconds: TRIED,
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
