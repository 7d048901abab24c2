//! What is learned, whichever search found it.

use serde::{Deserialize, Serialize};

use gaitwright_physics::motion::{Player, Trial};
use gaitwright_physics::scene::Gains;

use crate::check::MotionCheck;
use crate::learn::{AskedSpeed, Behaviour, Generation, LearningSetup, StopReason, Task};
use crate::program::gaits::gait_of;

/// A learned motion, whichever search found it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearnedMotion {
    /// What it is called in the repertoire: the way of going that was searched for.
    pub name: String,
    /// The gait that was asked for; `None` where none was.
    pub gait: Option<String>,
    /// The speed that was asked for, m/s; `None` where none was.
    pub speed: Option<f64>,
    /// Targets of the joints over time. Its fitness is 1 / (1 + cost) of a leg program
    /// ([`cost`](crate::program::cost::cost)), from 0 to 1, and m/s of QDSEGA; its generation is the number of
    /// those done when it was found.
    pub behaviour: Behaviour,
    /// Springs and dampers that it was learned with.
    pub gains: Gains,
    /// Parameters of its leg program; empty where there is none.
    pub parameters: Vec<f64>,
    /// What was left of it in every trial of its proof ([`MotionCheck::trials`]); empty where it was not tried.
    #[serde(default)]
    pub trials: Vec<Trial>,
}

impl LearnedMotion {
    /// The speed that it is judged by, m/s: the one that `task` asked for; `None` where any will do.
    pub fn asked_speed(&self, task: &Task) -> Option<f64> {
        match (task.speed, task.froude) {
            (Some(AskedSpeed::Number(speed)), _) => Some(speed),
            (_, Some(_)) => self.speed,
            _ => None,
        }
    }

    /// The motion about to be played as it was learned with `setup`; `player` plays it ([`player`](Self::player)).
    pub fn check<'a>(&'a self, setup: &'a LearningSetup, player: &'a Player) -> MotionCheck<'a> {
        MotionCheck {
            model: &setup.model,
            stance: &setup.stance,
            gains: &self.gains,
            scene: &setup.scene,
            accuracy: &setup.accuracy,
            player,
            direction: setup.task.direction,
            speed: self.asked_speed(&setup.task),
            gait: (!setup.task.any_gait()).then(|| gait_of(&setup.task.gait)),
        }
    }

    /// The targets of its joints over time, from the standing pose with these targets (rad or m).
    pub fn player(&self, standing: &[f64]) -> Player {
        self.behaviour.player(standing)
    }
}

/// What a training has come to.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained {
    /// Why it ended.
    pub ended: StopReason,
    /// What was learned, in the order in which it was.
    pub motions: Vec<LearnedMotion>,
    /// The learning curve: one point a generation, in order.
    pub curve: Vec<Generation>,
}

impl Trained {
    /// The same, where the clock decided what was searched for: another run might search for something else.
    pub(super) fn decided_by_the_clock(self, decided: bool) -> Self {
        let ended = match self.ended {
            StopReason::Generations | StopReason::Complete if decided => StopReason::Seconds,
            ended => ended,
        };
        Self { ended, ..self }
    }
}
