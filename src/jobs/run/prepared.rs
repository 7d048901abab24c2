//! A run about to learn: nothing is left open any more.

use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use super::error::RunError;
use crate::jobs::order::Order;
use crate::jobs::request::Settings;
use crate::jobs::teaching::Teaching;
use gaitwright_learning::accuracy::{AccuracyCheck, check, settle, swaying};
use gaitwright_learning::learn::{Cancel, LearningSetup, reference_gravity};
use gaitwright_learning::scenario::{ScenarioSetup, Script};
use gaitwright_learning::training::{LearnedMotion, check_task};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, AccuracyChoice, AskedAccuracy, StepPlan};
use gaitwright_physics::stance::Stance;

/// How long a learned motion goes round its loop when its tolerance is checked, s.
const LOOPED: f64 = 2.0;

/// How often it is looked whether a run has been cancelled while the accuracy is chosen.
const LOOK: Duration = Duration::from_millis(50);

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
        check_task(&task, &model, &stance, &scene)?;
        let scene = learning.trunk.in_scene(&scene);
        let swaying = swaying(&model, &stance, &scene);
        let Some((accuracy, accuracy_choice)) = settled(swaying, accuracy, cancel)? else { return Ok(None) };
        let parameters = learning
            .resolve(&stance, reference_gravity(&scene), accuracy.step)
            .map_err(|error| error.under("/learning"))?;
        let plan = Arc::new(StepPlan::compile(&scene, &accuracy, Some(&stance.gains), &model)?);
        let setup = LearningSetup { model, stance, scene, accuracy, task, parameters, seed, threads };
        let standing_seconds = start.elapsed().as_secs_f64();
        Ok(Some(Self { setup, plan, accuracy_choice, standing_seconds }))
    }

    /// How the character is about to be taught.
    pub fn teaching(&self) -> Teaching {
        Teaching::of_setup(&self.setup)
    }

    /// Whether `motion` keeps the tolerance that the accuracy was chosen for, before there was any motion; `None` where
    /// none was asked for, or where `stop` returns true before it is known.
    ///
    /// # Errors
    ///
    /// Every fault of scene and drive.
    pub(super) fn accuracy_check(
        &self,
        motion: &LearnedMotion,
        stop: &dyn Fn() -> bool,
    ) -> Result<Option<AccuracyCheck>, InputError> {
        let Some(choice) = &self.accuracy_choice else { return Ok(None) };
        let LearningSetup { model, scene, stance, accuracy, .. } = &self.setup;
        let player = motion.player(&self.setup.stance.angles);
        let played = ScenarioSetup {
            model: model.clone(),
            scene: scene.clone(),
            gains: Some(motion.gains.clone()),
            start: stance.state.clone(),
            duration: player.lead() + LOOPED,
            script: Script::Track(player),
        };
        check(&played, accuracy, choice.tolerance, stop)
    }
}

/// The accuracy for what is asked for, and why; `None` when it is cancelled.
///
/// One step at the finest settings may take seconds where many contacts depend on each other. When the run is cancelled it is
/// not waited for: its thread ends after it.
fn settled(
    setup: ScenarioSetup,
    asked: AskedAccuracy,
    cancel: &Cancel,
) -> Result<Option<(Accuracy, Option<AccuracyChoice>)>, RunError> {
    let (sender, receiver) = mpsc::channel();
    let called_off = cancel.clone();
    let chooser = thread::Builder::new().name("accuracy".into()).spawn(move || {
        // Nobody receives it once the run has been cancelled.
        let _ = sender.send(settle(&setup, &asked, &|| called_off.is_cancelled()));
    })?;
    loop {
        match receiver.recv_timeout(LOOK) {
            Ok(settled) => return Ok(settled?),
            Err(RecvTimeoutError::Timeout) if cancel.is_asked_for() => return Ok(None),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match chooser.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => return Ok(None),
            },
        }
    }
}
