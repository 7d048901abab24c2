//! What a run shows of its learning while it learns.

use std::path::Path;

use sha2::{Digest, Sha256};

use super::error::RunError;
use super::prepared::PreparedRun;
use super::publish::{RECORDED, describe};
use super::watcher::RunWatcher;
use crate::export::{Recording, RecordingSubject};
use crate::jobs::files::Artefact;
use crate::jobs::order::Order;
use crate::jobs::request::Settings;
use gaitwright_learning::learn::{Behaviour, Cancel, Checkpoint, Generation, Learning, Observer};

/// How long each new best behaviour is recorded after it has entered its loop, s.
const SHOWN: f64 = 3.0;

/// Writes what a learner does into the recording, and passes it on.
pub(super) struct Recorder<'a> {
    recording: Recording,
    prepared: &'a PreparedRun,
    cancel: &'a Cancel,
    watcher: &'a mut dyn RunWatcher,
    /// The first thing that could not be recorded; the learning is cancelled then.
    failure: Option<RunError>,
}

impl<'a> Recorder<'a> {
    /// Starts the recording in `folder` with what an earlier run of the same job would have recorded up to
    /// `checkpoint`.
    pub(super) fn create(
        folder: &Path,
        order: &Order,
        prepared: &'a PreparedRun,
        checkpoint: Option<&Checkpoint>,
        cancel: &'a Cancel,
        watcher: &'a mut dyn RunWatcher,
    ) -> Result<Self, RunError> {
        let character = &order.reading.character;
        let id = identity(order, prepared)?;
        let subject = RecordingSubject {
            id: &id,
            title: &character.name,
            character,
            joints: &prepared.setup.model.joint_names,
            scene: &prepared.setup.scene,
        };
        let mut recording = Recording::create(&Artefact::Recording.path(folder), subject)?;
        recording.job(&describe(order, prepared, None))?;
        let mut recorder = Self { recording, prepared, cancel, watcher, failure: None };
        if let Some(checkpoint) = checkpoint {
            recorder.replay(checkpoint)?;
        }
        Ok(recorder)
    }

    /// Records every point of the learning curve up to `checkpoint`, and every best behaviour anew: a motion is
    /// the same whenever it is played.
    fn replay(&mut self, checkpoint: &Checkpoint) -> Result<(), RunError> {
        let mut improved = checkpoint.improved.iter().peekable();
        for figures in &checkpoint.curve {
            while let Some(best) = improved.next_if(|best| best.generation <= figures.generation) {
                self.play(best)?;
            }
            self.recording.generation(figures)?;
        }
        Ok(())
    }

    /// Records a behaviour.
    fn play(&mut self, behaviour: &Behaviour) -> Result<(), RunError> {
        let player = self.prepared.player(behaviour);
        let seconds = player.lead() + SHOWN;
        let trace =
            self.prepared.motion_check(&player).play(seconds, RECORDED, &|| self.cancel.is_cancelled())?;
        Ok(self.recording.motion(behaviour.generation, &trace)?)
    }

    /// The recording, to which more may be added.
    pub(super) fn finish(self) -> Result<Recording, RunError> {
        match self.failure {
            None => Ok(self.recording),
            Some(error) => Err(error),
        }
    }

    fn keep(&mut self, recorded: Result<(), RunError>) {
        if let Err(error) = recorded {
            self.cancel.cancel();
            self.failure.get_or_insert(error);
        }
    }
}

impl Observer for Recorder<'_> {
    fn generation(&mut self, figures: &Generation) {
        let recorded = self.recording.generation(figures);
        self.keep(recorded.map_err(RunError::from));
        self.watcher.generation(figures);
    }

    fn improved(&mut self, best: &Behaviour) {
        let recorded = self.play(best);
        self.keep(recorded);
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) {
        self.watcher.checkpoint(checkpoint);
    }
}

/// A name for the recording that no other job's has: made of the character and of everything that was decided
/// about the job, it is the same whenever the same job runs.
fn identity(order: &Order, prepared: &PreparedRun) -> Result<String, RunError> {
    let setup = &prepared.setup;
    let decided = Settings {
        scene: order.settings.scene.clone(),
        task: setup.task.clone(),
        learning: Learning::from(&setup.parameters),
        accuracy: setup.accuracy.into(),
        seed: setup.seed,
    };
    let mut digest = Sha256::new();
    digest.update(&order.reading.character.digest);
    digest.update(serde_json::to_vec(&decided).map_err(std::io::Error::from)?);
    let digits: String = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(format!("sha256:{digits}"))
}
