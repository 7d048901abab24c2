//! A run about to learn: nothing is left open any more.

use std::sync::Arc;
use std::time::Instant;

use super::error::RunError;
use crate::jobs::order::Order;
use crate::jobs::request::Settings;
use gaitwright_learning::accuracy::{settle, swaying};
use gaitwright_learning::gait::MotionCheck;
use gaitwright_learning::learn::{AskedSpeed, Cancel, LearningSetup, reference_gravity};
use gaitwright_learning::training::LearnedMotion;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::Player;
use gaitwright_physics::scene::{AccuracyChoice, StepPlan};
use gaitwright_physics::stance::Stance;

/// A run about to learn.
#[derive(Debug, Clone)]
pub struct PreparedRun {
    /// What the learner is given: nothing in it is left open.
    pub setup: LearningSetup,
    /// What a simulated step computes.
    pub plan: Arc<StepPlan>,
    /// Why the accuracy was chosen, where a tolerance was asked for.
    pub accuracy_choice: Option<AccuracyChoice>,
    /// s of the wall clock spent finding the standing pose.
    pub standing_seconds: f64,
}

impl PreparedRun {
    /// Finds how the character stands, and decides what was left open; `None` when it is called off.
    pub(super) fn new(order: &Order, threads: usize, cancel: &Cancel) -> Result<Option<Self>, RunError> {
        let start = Instant::now();
        let Settings { scene, task, learning, accuracy, seed } = order.settings.clone();
        let model = Arc::new(Model::new(Arc::new(order.reading.character.clone()), Base::Floating));
        let stance = Arc::new(Stance::find_until(&model, &scene, &|| cancel.is_cancelled()));
        if cancel.is_cancelled() {
            return Ok(None);
        }
        let scene = learning.trunk.in_scene(&scene);
        let swaying = swaying(&model, &stance, &scene);
        let settled = settle(&swaying, &accuracy, &|| cancel.is_cancelled())?;
        let Some((accuracy, accuracy_choice)) = settled else { return Ok(None) };
        let parameters = learning
            .resolve(&stance, reference_gravity(&scene), accuracy.step)
            .map_err(|error| error.under("/learning"))?;
        let plan = Arc::new(StepPlan::compile(&scene, &accuracy, Some(&stance.gains), &model)?);
        let setup = LearningSetup { model, stance, scene, accuracy, task, parameters, seed, threads };
        let standing_seconds = start.elapsed().as_secs_f64();
        Ok(Some(Self { setup, plan, accuracy_choice, standing_seconds }))
    }

    /// The targets of a motion.
    pub(super) fn player(&self, motion: &LearnedMotion) -> Player {
        motion.player(&self.setup.stance.angles)
    }

    /// The speed that a motion is judged by, m/s: the one that the task asked for.
    pub(super) fn asked_speed(&self, motion: &LearnedMotion) -> Option<f64> {
        match (self.setup.task.speed, self.setup.task.froude) {
            (Some(AskedSpeed::Number(speed)), _) => Some(speed),
            (_, Some(_)) => motion.speed,
            _ => None,
        }
    }

    /// A motion about to be played as it was learned.
    pub(super) fn motion_check<'a>(
        &'a self,
        motion: &'a LearnedMotion,
        player: &'a Player,
    ) -> MotionCheck<'a> {
        MotionCheck {
            model: &self.setup.model,
            stance: &self.setup.stance,
            gains: &motion.gains,
            scene: &self.setup.scene,
            accuracy: &self.setup.accuracy,
            player,
            direction: self.setup.task.direction,
            speed: self.asked_speed(motion),
        }
    }
}
