//! What a run shows and writes while it learns.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};

use super::describe::{describe, describe_motion, describe_on_the_way, describe_slow};
use super::error::RunError;
use super::finished::{Finished, Verdict};
use super::limit::CancelLimit;
use super::outcome::Unsuccessful;
use super::prepared::PreparedRun;
use super::report::{Reached, report};
use super::shelve::{Shelved, json};
use super::shown::shown;
use super::watcher::{RunTimes, RunWatcher};
use crate::export::{Recording, RecordingSubject};
use crate::jobs::files::{Artefact, Unfinished};
use crate::jobs::live::OnTheWay;
use crate::jobs::order::Order;
use crate::jobs::request::Settings;
use gaitwright_learning::learn::{Generation, Learning};
use gaitwright_learning::training::{LearnedMotion, Milestone, TrainingCheckpoint, TrainingObserver};
use gaitwright_physics::playback::Trace;

/// How long a motion on the way is recorded after it has entered its loop, s.
const SHOWN: f64 = 3.0;

/// A motion on the way is played for so long at most, since the search waits meanwhile and its time passes. Of what takes longer the
/// recording shows what was played, without a verdict, and no further ones of that run are.
const LONGEST_PREVIEW: Duration = Duration::from_secs(5);

/// What an earlier run of the job had reached: its checkpoint, and the motions finished there as they were checked again.
pub(super) struct EarlierRun<'a> {
    pub(super) checkpoint: &'a TrainingCheckpoint,
    pub(super) verdicts: Vec<Verdict>,
    /// When they began to be checked.
    pub(super) since: Instant,
}

/// What the recording shows of a motion.
struct Shown {
    text: String,
    trace: Trace,
}

/// Writes what a training does into the recording, checks and keeps what it has finished, and passes everything on.
pub(super) struct Recorder<'a> {
    recording: Recording,
    order: &'a Order,
    prepared: &'a PreparedRun,
    folder: PathBuf,
    limit: &'a CancelLimit<'a>,
    watcher: &'a mut dyn RunWatcher,
    shelved: Shelved,
    /// Files of the best motion on the way, as long as none is finished.
    on_the_way: OnTheWay,
    /// Whether a motion on the way took too long to play.
    plays_slowly: bool,
    /// The last point of the curve.
    last: Option<Generation>,
    /// When the learning began, and how much of the time since then has gone into checking and recording motions.
    begun: Instant,
    checking: Duration,
    /// The first thing that went wrong; the training is cancelled then.
    failure: Option<RunError>,
}

impl<'a> Recorder<'a> {
    /// Starts the recording in `folder` with what an `earlier` run of the same job would have recorded up to its checkpoint, but for motions
    /// on the way of which one takes [too long](LONGEST_PREVIEW) to play.
    pub(super) fn create(
        folder: &Path,
        order: &'a Order,
        prepared: &'a PreparedRun,
        earlier: Option<EarlierRun<'_>>,
        limit: &'a CancelLimit<'a>,
        watcher: &'a mut dyn RunWatcher,
    ) -> Result<Self, RunError> {
        let begun = earlier.as_ref().map_or_else(Instant::now, |earlier| earlier.since);
        let checking = begun.elapsed();
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
        let (folder, shelved) = (folder.to_owned(), Shelved::nothing(&prepared.setup));
        let mut recorder = Self {
            recording,
            order,
            prepared,
            folder,
            limit,
            watcher,
            shelved,
            on_the_way: OnTheWay::new(),
            plays_slowly: false,
            last: None,
            begun,
            checking,
            failure: None,
        };
        if let Some(earlier) = earlier {
            recorder.checked(|recorder| recorder.replay(earlier))?;
        }
        recorder.tell()?;
        Ok(recorder)
    }

    /// Keeps what `earlier` had finished, then records every point of its learning curve and every motion anew: a motion is the
    /// same whenever it is played.
    fn replay(&mut self, earlier: EarlierRun<'_>) -> Result<(), RunError> {
        let EarlierRun { checkpoint, verdicts, .. } = earlier;
        let milestones = checkpoint.milestones(&self.prepared.setup);
        // All of it before any is recorded: the files are the job's results, wherever the run is called off.
        let finished = milestones.iter().filter(|shown| shown.finished).zip(verdicts);
        let kept = finished.map(|(finished, verdict)| self.keep(&finished.motion, verdict));
        let mut kept = kept.collect::<Result<Vec<_>, _>>()?.into_iter();
        let mut show = |recorder: &mut Self, milestone: &Milestone| {
            if !milestone.finished {
                return recorder.play(&milestone.motion);
            }
            match kept.next().flatten() {
                Some(shown) => recorder.record(&milestone.motion, &shown),
                None => Ok(()),
            }
        };
        let mut milestones = milestones.iter().peekable();
        for figures in &checkpoint.curve() {
            while let Some(shown) =
                milestones.next_if(|shown| shown.motion.behaviour.generation <= figures.generation)
            {
                show(self, shown)?;
            }
            self.recording.generation(figures)?;
            self.last = Some(figures.clone());
        }
        milestones.try_for_each(|shown| show(self, shown))
    }

    /// Records a motion on the way, unless one took [too long](LONGEST_PREVIEW) to play.
    fn play(&mut self, motion: &LearnedMotion) -> Result<(), RunError> {
        if self.plays_slowly {
            return Ok(());
        }
        let player = motion.player(&self.prepared.setup.stance.angles);
        let check = motion.check(&self.prepared.setup, &player);
        let since = Instant::now();
        let takes_too_long = || since.elapsed() >= LONGEST_PREVIEW;
        let checked = check.run(&|| self.limit.is_cancelled() || takes_too_long())?;
        let trace = shown(&checked.trace, &player, SHOWN);
        self.plays_slowly = takes_too_long();
        if self.plays_slowly {
            return self.record(motion, &Shown { text: describe_slow(motion), trace });
        }
        self.watcher.improved(motion, &checked.gait);
        if let Some(files) = self.shelved.on_the_way((self.order, self.prepared), motion, &checked)? {
            self.on_the_way = files;
            self.tell()?;
        }
        let text = describe_on_the_way(motion, &checked.gait);
        self.record(motion, &Shown { text, trace })
    }

    /// Checks a finished motion, and keeps and records it.
    fn check(&mut self, motion: &LearnedMotion) -> Result<(), RunError> {
        let verdict = Finished::check((self.order, self.prepared), motion, self.limit, self.watcher)?;
        match self.keep(motion, verdict)? {
            Some(shown) => self.record(motion, &shown),
            None => Ok(()),
        }
    }

    /// Puts a finished motion with the others. What the recording shows of it, if anything.
    fn keep(&mut self, motion: &LearnedMotion, verdict: Verdict) -> Result<Option<Shown>, RunError> {
        let finished = match verdict {
            Ok(finished) => finished,
            Err(reason) => {
                self.shelved.refuse(reason);
                return Ok(None);
            }
        };
        let text = match self.shelved.add(&self.folder, motion, &finished)? {
            Some(entry) => {
                self.watcher.learned(entry);
                describe_motion(entry)
            }
            None => format!("# {}\n\n{}", motion.name, Unsuccessful::Fell),
        };
        if self.shelved.motion().is_some() {
            self.on_the_way.clear();
            self.tell()?;
        }
        Ok(Some(Shown { text, trace: finished.shown }))
    }

    /// Shows what there is so far of results that no file holds yet.
    fn tell(&mut self) -> Result<(), RunError> {
        let reached = Reached { ended: None, last: self.last.as_ref(), accuracy_check: None };
        let mut files = self.on_the_way.clone();
        let report = report((self.order, self.prepared), &self.shelved, reached);
        files.insert(Artefact::Report.file_name(), json(&report)?);
        files.insert(Artefact::Motions.file_name(), json(self.shelved.repertoire())?);
        self.watcher.on_the_way(files);
        Ok(())
    }

    fn record(&mut self, motion: &LearnedMotion, shown: &Shown) -> Result<(), RunError> {
        let setup = &self.prepared.setup;
        let detection = motion.check(setup, &motion.player(&setup.stance.angles)).detection()?;
        let place = (motion.behaviour.generation, shown.text.as_str());
        Ok(self.recording.motion(place, (&shown.trace, detection))?)
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
        self.last = Some(figures.clone());
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
        let kept = self.checked(|recorder| recorder.check(motion));
        self.note(kept);
    }

    fn checkpoint(&mut self, checkpoint: &TrainingCheckpoint) {
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
