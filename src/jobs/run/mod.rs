//! The way of the data through a job: character → model → standing pose → learning → check → files.
//!
//! The service's workers and the command `train` both go it, and nobody else joins these rooms.

mod observe;
mod perform;
mod publish;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::job::Stage;
use super::request::Settings;
use super::store::StoreError;
use crate::export::{DiagramError, RecordingError};
use gaitwright_learning::accuracy::{StudyError, settle, swaying};
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::learn::{
    Behaviour, Cancel, Checkpoint, Ended, Generation, LearnError, Learning, Posture, Setup, Task, Trunk,
    learn,
};
use gaitwright_physics::character::{self, JointKind, Link, Options, Reading, Source};
use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{Metrics, Motion, Player};
use gaitwright_physics::scene::{AccuracyChoice, Effect, Scene, StepPlan, Switch};
use gaitwright_physics::sim::Failure;
use gaitwright_physics::stance::Stance;

use observe::Recorder;
use perform::{Act, Checked};
pub use publish::Report;
use publish::{Farewell, publish};

/// Why a run could not be brought to its end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The character, or what is wanted of it, is impossible.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The simulation that settings are compared with broke off.
    #[error(transparent)]
    Study(StudyError),
    /// A file could not be written.
    #[error("a file could not be written: {0}")]
    File(#[from] std::io::Error),
    /// The recording could not be written.
    #[error("the recording could not be written: {0}")]
    Recording(#[from] RecordingError),
    /// The gait diagram could not be drawn.
    #[error(transparent)]
    Diagram(#[from] DiagramError),
    /// The learner's threads could not be started.
    #[error("the learner could not be started: {0}")]
    Threads(String),
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
}

impl From<StudyError> for RunError {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Input(error) => Self::Input(error),
            error => Self::Study(error),
        }
    }
}

impl From<LearnError> for RunError {
    fn from(error: LearnError) -> Self {
        match error {
            LearnError::Input(error) => Self::Input(error),
            LearnError::Threads(error) => Self::Threads(error.to_string()),
        }
    }
}

/// Why a motion that was played has no gait to tell.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The motion is not of this character, or its scene cannot be simulated.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The simulation could not go on.
    #[error("the simulation of the motion broke off: {0}")]
    BrokenOff(Failure),
    /// The character fell too early, s.
    #[error("the character fell after {0:.3} s, before it had gone round its loop once")]
    Fallen(f64),
}

/// A job that is known to be possible as far as this can be told without simulating.
#[derive(Debug, Clone)]
pub struct Order {
    /// The character, and what was repaired in it.
    pub reading: Reading,
    /// What is wanted of it.
    pub settings: Settings,
}

/// A run about to learn.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// What the learner is given, with the values used in place of those left open.
    pub setup: Setup,
    /// The scene as simulated: the task's, with what the learner's parameters ask of it.
    pub scene: Scene,
    /// What a simulated step computes.
    pub plan: Arc<StepPlan>,
    /// Why the accuracy was chosen, where a tolerance was asked for.
    pub accuracy_choice: Option<AccuracyChoice>,
    /// s of the wall clock spent finding the standing pose.
    pub standing_seconds: f64,
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Why the learning stopped.
    pub ended: Ended,
    /// Figures of the motion found; `None` without a motion.
    pub metrics: Option<Metrics>,
    /// Why there is no motion.
    pub unsuccessful: Option<String>,
    /// s of the wall clock spent checking and writing.
    pub checking_seconds: f64,
}

/// Watches a run.
pub trait Watcher {
    /// A part of the run begins.
    fn stage(&mut self, stage: Stage);
    /// The learning is about to begin.
    fn prepared(&mut self, prepared: &Prepared);
    /// A generation has been evaluated.
    fn generation(&mut self, figures: &Generation);
    /// The run can be resumed from here.
    fn checkpoint(&mut self, checkpoint: &Checkpoint);
}

/// Nobody watches.
impl Watcher for () {
    fn stage(&mut self, _: Stage) {}
    fn prepared(&mut self, _: &Prepared) {}
    fn generation(&mut self, _: &Generation) {}
    fn checkpoint(&mut self, _: &Checkpoint) {}
}

impl Order {
    /// Reads a character and looks at what is wanted of it. Without a `source` its form is told from
    /// the bytes. Faults of a character document are named from `place` on.
    ///
    /// # Errors
    ///
    /// Every fault of the character, and every fault of what is wanted of it with JSON pointers into
    /// the job document.
    pub fn read(
        bytes: &[u8],
        source: Option<Source>,
        place: &str,
        settings: Settings,
    ) -> Result<Self, InputError> {
        match read_character(bytes, source, Options::default()).map_err(|error| error.under(place)) {
            Ok(reading) => Self::new(reading, settings),
            Err(InputError::Impossible(mut faults)) => {
                faults.extend(settings.faults());
                Err(InputError::Impossible(faults))
            }
            Err(error) => Err(error),
        }
    }

    /// Looks at what is wanted of a character.
    ///
    /// # Errors
    ///
    /// Every fault of what is wanted, with JSON pointers into the job document.
    pub fn new(reading: Reading, settings: Settings) -> Result<Self, InputError> {
        let mut faults = settings.faults();
        let movable = |link: &Link| link.joint.as_ref().is_some_and(|joint| joint.kind != JointKind::Fixed);
        if !reading.character.links.iter().any(movable) {
            faults.push(Fault::new("/character", "the character has no joint that could move"));
        }
        if faults.is_empty() { Ok(Self { reading, settings }) } else { Err(InputError::Impossible(faults)) }
    }

    /// Finds how the character stands, and decides what was left open; `None` when it is called off.
    fn prepare(&self, threads: usize, cancel: &Cancel) -> Result<Option<Prepared>, RunError> {
        let start = Instant::now();
        let Settings { scene, task, learning, accuracy, seed } = self.settings.clone();
        let model = Arc::new(Model::new(Arc::new(self.reading.character.clone()), false));
        let stance = Arc::new(Stance::find_until(&model, &scene, &|| cancel.is_cancelled()));
        if cancel.is_cancelled() {
            return Ok(None);
        }
        let swaying = swaying(&model, &stance, &simulated(&scene, &learning));
        let settled = settle(&swaying, &accuracy, &|| cancel.is_cancelled())?;
        let Some((accuracy, accuracy_choice)) = settled else { return Ok(None) };
        let parameters =
            learning.resolve(&stance, accuracy.step).map_err(|error| error.under("/learning"))?;
        let setup =
            Setup { model, stance, scene, accuracy, task, learning: parameters.learning, seed, threads };
        let scene = simulated(&setup.scene, &setup.learning);
        let plan = Arc::new(StepPlan::compile(&scene, &accuracy, Some(&setup.stance.gains), &setup.model)?);
        let standing_seconds = start.elapsed().as_secs_f64();
        Ok(Some(Prepared { setup, scene, plan, accuracy_choice, standing_seconds }))
    }
}

impl Prepared {
    /// The targets of a behaviour.
    fn player(&self, behaviour: &Behaviour) -> Player {
        fn view(posture: &Posture) -> (&[f64], &[f64]) {
            (&posture.angles, &posture.velocities)
        }
        let (entry, cycle) = (behaviour.entry.iter().map(view), behaviour.cycle.iter().map(view));
        Player::from_postures(&self.setup.stance.angles, entry, cycle, behaviour.transition_time)
    }

    /// A motion about to be played as it was learned.
    fn act<'a>(&'a self, player: &'a Player) -> Act<'a> {
        Act {
            model: &self.setup.model,
            stance: &self.setup.stance,
            gains: &self.setup.stance.gains,
            scene: &self.scene,
            accuracy: &self.setup.accuracy,
            player,
            direction: self.setup.task.direction,
        }
    }
}

/// Plays a motion document with its character for a long stretch, and tells its gait. Of a character that falls
/// it is the gait until then.
///
/// # Errors
///
/// When the motion is not of this character, when its scene cannot be simulated, or not to the end, and when the
/// character falls before it has gone round its loop.
pub fn replay(motion: &Motion, reading: &Reading) -> Result<GaitReport, ReplayError> {
    let model = Arc::new(Model::new(Arc::new(reading.character.clone()), false));
    let player = Player::new(motion, &model.joint_names)?;
    let stance = Stance::find(&model, &motion.scene);
    let task: Task = serde_json::from_value(motion.provenance.task.clone()).unwrap_or_default();
    let act = Act {
        model: &model,
        stance: &stance,
        gains: &motion.drive,
        scene: &motion.scene,
        accuracy: &motion.provenance.accuracy,
        player: &player,
        direction: task.direction,
    };
    let Checked { trace, gait, .. } = act.check(&|| false)?;
    let once = player.lead() + player.period();
    match (trace.failure, trace.fell_at) {
        (Some(failure), _) => Err(ReplayError::BrokenOff(failure)),
        (None, Some(time)) if time < once => Err(ReplayError::Fallen(time)),
        (None, _) => Ok(gait),
    }
}

/// Reads a character; without a `source` its form is told from the bytes.
///
/// # Errors
///
/// Every fault of the character.
pub fn read_character(bytes: &[u8], source: Option<Source>, options: Options) -> Result<Reading, InputError> {
    match source.or_else(|| Source::detect(bytes)) {
        Some(source) => character::read(bytes, source, options),
        None => {
            let reason = "neither a URDF document, nor a character JSON document, nor a zip archive";
            Err(InputError::Malformed(Fault::new("line 1", reason)))
        }
    }
}

/// Goes the whole way with `order` on `threads` threads, on from `checkpoint` when there is one, and
/// leaves what comes of it in `folder`: the recording grows while it runs, everything else appears
/// whole at the end. A run that is cancelled writes what was found by then, if it takes no longer than
/// the given time to check it.
///
/// # Errors
///
/// When the character or what is wanted of it turns out impossible, or a file cannot be written.
pub fn run(
    order: &Order,
    threads: usize,
    folder: &Path,
    (cancel, farewell): (&Cancel, Duration),
    checkpoint: Option<Checkpoint>,
    watcher: &mut dyn Watcher,
) -> Result<Outcome, RunError> {
    watcher.stage(Stage::Standing);
    let Some(prepared) = order.prepare(threads, cancel)? else {
        let unsuccessful = Some("called off before the learning began".to_owned());
        return Ok(Outcome { ended: Ended::Cancelled, metrics: None, unsuccessful, checking_seconds: 0.0 });
    };
    watcher.prepared(&prepared);

    watcher.stage(Stage::Learning);
    let mut recorder = Recorder::create(folder, order, &prepared, checkpoint.as_ref(), cancel, watcher)?;
    let learned = learn(&prepared.setup, &mut recorder, cancel, checkpoint)?;
    let recording = recorder.finish()?;

    watcher.stage(Stage::Checking);
    publish(order, &prepared, &learned, recording, folder, &Farewell::new(cancel, farewell))
}

/// The scene that the learner acts in, and that what it learned is checked in.
fn simulated(scene: &Scene, learning: &Learning) -> Scene {
    let mut scene = scene.clone();
    if learning.trunk == Trunk::Locked {
        scene.effects.insert(Effect::TrunkRotationLock, Switch::On);
    }
    scene
}
