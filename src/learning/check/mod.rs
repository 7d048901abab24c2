//! A motion played from the standing pose in one continuous simulation, and judged; and what is left of it when something
//! is changed.

mod trials;

use std::sync::Arc;

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{Player, Validity};
use gaitwright_physics::playback::{Playback, Trace};
use gaitwright_physics::scene::{Accuracy, ActuatorLimits, Gains, Scene, StepPlan, Terrain};
use gaitwright_physics::sim::Simulator;
use gaitwright_physics::stance::{Stance, Upright};
use nalgebra::Isometry3;

use crate::gait::{self, Detection, GaitContext, GaitReport, NaturalnessContext, validity};

/// How long a motion is checked at least, s.
pub const CHECKED: f64 = 20.0;

/// How many rounds of its loop are checked at least: a foot that stands at both ends has one whole stride less than touch-downs, and
/// those are one less than rounds.
pub const ROUNDS: f64 = 12.0;

/// Longest time between two samples of a check, s, and as a share of the loop: small characters step in less.
const FINE: f64 = 0.005;
const FINE_SHARE: f64 = 1.0 / 48.0;

/// A motion and everything it takes to play it.
#[derive(Debug, Clone, Copy)]
pub struct MotionCheck<'a> {
    /// Who plays.
    pub model: &'a Arc<Model>,
    /// Where it starts.
    pub stance: &'a Stance,
    /// How strongly the joints follow.
    pub gains: &'a Gains,
    /// Where it is played, with the effects as wanted.
    pub scene: &'a Scene,
    /// How finely it is simulated.
    pub accuracy: &'a Accuracy,
    /// The targets.
    pub player: &'a Player,
    /// Wanted direction of travel.
    pub direction: [f64; 3],
    /// Wanted speed along it, m/s; `None` where any will do.
    pub speed: Option<f64>,
    /// Wanted gait; `None` where any will do.
    pub gait: Option<&'a str>,
}

/// What a check has shown.
#[derive(Debug, Clone)]
pub struct CheckedMotion {
    /// Everything from the standing pose on.
    pub trace: Trace,
    /// The gait of the looping part, judged.
    pub gait: GaitReport,
    /// Whether the looping part goes along the direction at all ([`gait::travels`]).
    pub travels: bool,
    /// What the looping part is worth.
    pub validity: Validity,
}

impl MotionCheck<'_> {
    /// Plays for `seconds`, sampled every `sample_every` seconds, or until `stop` says so.
    ///
    /// # Errors
    ///
    /// Every fault of scene, accuracy and gains.
    pub fn play(
        &self,
        seconds: f64,
        sample_every: f64,
        stop: &dyn Fn() -> bool,
    ) -> Result<Trace, InputError> {
        let playback = Playback {
            model: self.model,
            plan: &Arc::new(self.plan()?),
            start: &self.stance.state,
            player: self.player,
            upright: &Upright::new(self.model, self.stance, self.scene),
            seconds,
            sample_every,
        };
        Ok(playback.run(stop))
    }

    /// How long a motion is played to be judged, s.
    pub fn seconds(&self) -> f64 {
        CHECKED.max(self.player.lead() + ROUNDS * self.player.period())
    }

    /// Plays for [that long](Self::seconds), or until `stop` says so, and judges it but for the trials under changed
    /// conditions.
    ///
    /// # Errors
    ///
    /// Every fault of scene, accuracy and gains.
    pub fn run(&self, stop: &dyn Fn() -> bool) -> Result<CheckedMotion, InputError> {
        let every = self.sample_every();
        let period = self.player.period();
        let trace = self.play(self.seconds(), every, stop)?;
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
        let plan = Arc::new(self.plan()?);
        let standing = self.standing(&plan);
        let setting = self.setting(&standing);
        let mut gait = gait::measure(&looping, &setting);
        let actuators: Vec<ActuatorLimits> =
            (0..self.model.joint_count()).map(|joint| plan.actuator_limits(joint)).collect();
        let (speed, asked) = (self.speed, self.gait);
        let context = NaturalnessContext { gait: setting, actuators: &actuators, speed, asked, period };
        gait::judge(&looping, &mut gait, &context);
        let travels = gait::travels(&gait, &setting);
        let validity = validity(&looping, &self.model.limits, &actuators, period);
        Ok(CheckedMotion { trace, gait, travels, validity })
    }

    /// How its footfalls are told from contact forces: as [`run`](Self::run) does.
    ///
    /// # Errors
    ///
    /// Every fault of scene, accuracy and gains.
    pub fn detection(&self) -> Result<Detection, InputError> {
        Ok(self.setting(&self.standing(&Arc::new(self.plan()?))).detection())
    }

    /// World frames of all links in the standing pose, m.
    fn standing(&self, plan: &Arc<StepPlan>) -> Vec<Isometry3<f64>> {
        Simulator::new(plan.clone(), self.stance.state.clone()).link_poses()
    }

    /// What its gait is measured with.
    fn setting<'s>(&'s self, standing: &'s [Isometry3<f64>]) -> GaitContext<'s> {
        GaitContext {
            model: self.model,
            support: &self.stance.support,
            standing,
            ground: self.scene.ground.as_ref().map_or(0.0, |ground| Terrain::new(ground).height(0.0, 0.0)),
            mass: self.model.mass,
            gravity: self.scene.acting_gravity().norm(),
            direction: self.direction,
        }
    }

    fn plan(&self) -> Result<StepPlan, InputError> {
        StepPlan::compile(self.scene, self.accuracy, Some(self.gains), self.model)
    }

    /// Time between two samples, s: short, and such that the loop's start and end are sampled where they lie on whole
    /// steps, unless that would take many more samples than are needed.
    fn sample_every(&self) -> f64 {
        let step = self.accuracy.step;
        let steps = |seconds: f64| (seconds / step).round() as usize;
        let common = gcd(steps(self.player.lead()), steps(self.player.period()));
        let period = self.player.period();
        let longest = if period > 0.0 { FINE.min(FINE_SHARE * period) } else { FINE };
        let fine = (longest / step).max(1.0) as usize;
        let least = (fine / 8).max(1);
        let stride = (least..=fine).rev().find(|stride| common.is_multiple_of(*stride)).unwrap_or(fine);
        stride as f64 * step
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}
