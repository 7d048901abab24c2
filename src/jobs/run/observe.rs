//! What a run shows and writes while it learns.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};

use super::describe::{describe, describe_motion, describe_on_the_way};
use super::error::RunError;
use super::limit::CancelLimit;
use super::outcome::Unsuccessful;
use super::prepared::PreparedRun;
use super::shelve::Shelved;
use super::watcher::{RunTimes, RunWatcher};
use crate::export::{Recording, RecordingSubject};
use crate::jobs::files::{Artefact, Unfinished};
use crate::jobs::order::Order;
use crate::jobs::request::Settings;
use gaitwright_learning::learn::{Generation, Learning};
use gaitwright_learning::training::{LearnedMotion, TrainingCheckpoint, TrainingObserver};
use gaitwright_physics::motion::Player;
use gaitwright_physics::playback::Trace;

/// Longest time between two samples of a recorded motion, s, and fewest samples of one round of its loop.
const RECORDED: f64 = 0.02;
const FEWEST: f64 = 12.0;

/// How long a motion on the way is recorded after it has entered its loop, s.
const SHOWN: f64 = 3.0;

/// How long a finished motion is recorded after it has entered its loop, s.
const SHOWN_FINISHED: f64 = 6.0;

/// Most rounds of the loop that are recorded: those of a tiny character are short.
const ROUNDS: f64 = 60.0;

/// Writes what a training does into the recording, checks and keeps what it has finished, and passes everything on.
pub(super) struct Recorder<'a> {
    recording: Recording,
    order: &'a Order,
    prepared: &'a PreparedRun,
    folder: PathBuf,
    limit: &'a CancelLimit<'a>,
    watcher: &'a mut dyn RunWatcher,
    shelved: Shelved,
    /// When the learning began, and how much of the time since then has gone into checking and recording motions.
    begun: Instant,
    checking: Duration,
    /// The first thing that went wrong; the training is cancelled then.
    failure: Option<RunError>,
}

impl<'a> Recorder<'a> {
    /// Starts the recording in `folder` with what an earlier run of the same job would have recorded up to
    /// `checkpoint`.
    pub(super) fn create(
        folder: &Path,
        order: &'a Order,
        prepared: &'a PreparedRun,
        checkpoint: Option<&TrainingCheckpoint>,
        limit: &'a CancelLimit<'a>,
        watcher: &'a mut dyn RunWatcher,
    ) -> Result<Self, RunError> {
        let begun = Instant::now();
        let character = &order.reading.character;
        let id = identity(order, prepared)?;
        let subject = RecordingSubject {
            id: &id,
            title: &character.name,
            character,
            joints: &prepared.setup.model.joint_names,
            scene: &prepared.setup.scene,
        };
        // Whoever follows the recording of an earlier run keeps that file, whole as far as it goes.
        let place = Unfinished::new(folder)?;
        let mut recording = Recording::create(place.path(), subject)?;
        recording.job(&describe(order, prepared, None))?;
        let path = Artefact::Recording.path(folder);
        place.appear(&path)?;
        recording.set_path(&path);
        let (folder, shelved) = (folder.to_owned(), Shelved::default());
        let checking = Duration::ZERO;
        let mut recorder = Self {
            recording,
            order,
            prepared,
            folder,
            limit,
            watcher,
            shelved,
            begun,
            checking,
            failure: None,
        };
        if let Some(checkpoint) = checkpoint {
            recorder.checked(|recorder| recorder.replay(checkpoint))?;
        }
        Ok(recorder)
    }

    /// Records every point of the learning curve up to `checkpoint`, and every motion anew: a motion is the same
    /// whenever it is played.
    fn replay(&mut self, checkpoint: &TrainingCheckpoint) -> Result<(), RunError> {
        let milestones = checkpoint.milestones(&self.prepared.setup);
        let mut milestones = milestones.iter().peekable();
        for figures in &checkpoint.curve() {
            while let Some(shown) =
                milestones.next_if(|shown| shown.motion.behaviour.generation <= figures.generation)
            {
                self.show(&shown.motion, shown.finished)?;
            }
            self.recording.generation(figures)?;
        }
        milestones.try_for_each(|shown| self.show(&shown.motion, shown.finished))
    }

    fn show(&mut self, motion: &LearnedMotion, finished: bool) -> Result<(), RunError> {
        if finished { self.keep(motion) } else { self.play(motion) }
    }

    /// Records a motion on the way.
    fn play(&mut self, motion: &LearnedMotion) -> Result<(), RunError> {
        let player = motion.player(&self.prepared.setup.stance.angles);
        let check = motion.check(&self.prepared.setup, &player);
        let checked = check.run(&|| self.limit.is_cancelled())?;
        self.watcher.improved(motion, &checked.gait);
        if let Some(files) = self.shelved.on_the_way((self.order, self.prepared), motion, &checked)? {
            self.watcher.on_the_way(files);
        }
        let text = describe_on_the_way(motion, &checked.gait);
        let thinned = thinned(&checked.trace, recorded_time(&player, SHOWN), recorded_interval(&player));
        let shown = (&thinned, check.detection()?);
        Ok(self.recording.motion((motion.behaviour.generation, &text), shown)?)
    }

    /// Checks a finished motion, records it and puts it with the others.
    fn keep(&mut self, motion: &LearnedMotion) -> Result<(), RunError> {
        let player = motion.player(&self.prepared.setup.stance.angles);
        let check = motion.check(&self.prepared.setup, &player);
        let mut checked = check.run(&|| self.limit.is_over())?;
        if self.limit.is_over() || self.watcher.is_lost() {
            self.shelved.refuse(Unsuccessful::NotChecked);
            return Ok(());
        }
        if !checked.travels {
            self.shelved.refuse(Unsuccessful::DoesNotTravel);
            return Ok(());
        }
        if !motion.trials.is_empty() {
            checked.validity.trials.clone_from(&motion.trials);
        } else if !self.limit.is_cancelled() {
            let threads = self.prepared.setup.threads;
            checked.validity.trials = check.trials(&checked, threads, &|| self.limit.is_cancelled())?;
        }
        let seconds = recorded_time(&player, SHOWN_FINISHED);
        let text = match self.shelved.add(&self.folder, (self.order, self.prepared), motion, &checked)? {
            Some(entry) => {
                self.watcher.learned(entry);
                describe_motion(entry)
            }
            None => format!("# {}\n\n{}", motion.name, Unsuccessful::Fell),
        };
        let thinned = thinned(&checked.trace, seconds, recorded_interval(&player));
        let shown = (&thinned, check.detection()?);
        Ok(self.recording.motion((motion.behaviour.generation, &text), shown)?)
    }

    /// The recording, to which more may be added, what was kept, and what the time was spent on.
    pub(super) fn finish(self) -> Result<(Recording, Shelved, RunTimes), RunError> {
        let times = self.times();
        match self.failure {
            None => Ok((self.recording, self.shelved, times)),
            Some(error) => Err(error),
        }
    }

    /// Does what is no learning although the learner waits for it, and counts its time apart.
    fn checked(&mut self, work: impl FnOnce(&mut Self) -> Result<(), RunError>) -> Result<(), RunError> {
        let start = Instant::now();
        let done = work(self);
        self.checking += start.elapsed();
        self.watcher.spent(self.times());
        done
    }

    fn times(&self) -> RunTimes {
        let learning = self.begun.elapsed().saturating_sub(self.checking);
        RunTimes { learning, checking: self.checking }
    }

    fn note(&mut self, outcome: Result<(), RunError>) {
        if let Err(error) = outcome {
            self.limit.cancel();
            self.failure.get_or_insert(error);
        }
    }
}

impl TrainingObserver for Recorder<'_> {
    fn generation(&mut self, figures: &Generation) {
        let recorded = self.recording.generation(figures);
        self.note(recorded.map_err(RunError::from));
        self.watcher.spent(self.times());
        self.watcher.generation(figures);
    }

    fn improved(&mut self, motion: &LearnedMotion) {
        let recorded = self.checked(|recorder| recorder.play(motion));
        self.note(recorded);
    }

    fn finished(&mut self, motion: &LearnedMotion) {
        let kept = self.checked(|recorder| recorder.keep(motion));
        self.note(kept);
    }

    fn checkpoint(&mut self, checkpoint: &TrainingCheckpoint) {
        self.watcher.checkpoint(checkpoint);
    }
}

/// For how long a motion is recorded from the start of play, s, with at most `looping` seconds of its loop.
fn recorded_time(player: &Player, looping: f64) -> f64 {
    player.lead() + looping.min(ROUNDS * player.period())
}

/// Time between two samples of a recorded motion, s.
fn recorded_interval(player: &Player) -> f64 {
    RECORDED.min(player.period() / FEWEST)
}

/// The first `seconds` of a trace, with samples about `wanted` seconds apart.
fn thinned(trace: &Trace, seconds: f64, wanted: f64) -> Trace {
    let interval = match trace.samples.as_slice() {
        [first, second, ..] => second.time - first.time,
        _ => wanted,
    };
    let stride = (wanted / interval).round().max(1.0) as usize;
    let samples = trace.samples.iter().take_while(|sample| sample.time <= seconds).step_by(stride);
    Trace { samples: samples.cloned().collect(), failure: trace.failure.clone(), ..*trace }
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
