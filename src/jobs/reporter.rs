//! What a running job tells of itself.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tokio::runtime::Handle;

use super::figures::GenerationMeter;
use super::files::{Artefact, Upload};
use super::job::{Job, Stage};
use super::live::{Live, OnTheWay};
use super::repertoire::{MotionSummary, RepertoireEntry};
use super::run::{PreparedRun, RunTimes, RunWatcher};
use super::store::Store;
use super::work::Work;
use gaitwright_learning::accuracy;
use gaitwright_learning::learn::{Generation, Learning};
use gaitwright_learning::training::TrainingCheckpoint;

/// Shortest time between two writings of a running job's record and curve.
const RECORD_EVERY: Duration = Duration::from_millis(500);

/// Shortest time between two writings of a running job's checkpoint, after the first.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(2);

/// Passes on what happens in a run: at once to those who watch, at a bounded rate to the disk.
pub(super) struct Reporter<'a> {
    store: &'a Store,
    runtime: &'a Handle,
    job: &'a mut Job,
    live: &'a Live,
    folder: PathBuf,
    /// What brings the files from there to where they are kept, if that is elsewhere.
    upload: Option<Arc<Upload>>,
    /// Points of the curve that are not in the store yet.
    unwritten: Vec<Generation>,
    /// The work proper has begun, and the store does not know yet that the files of this run are the job's.
    run_unrecorded: bool,
    recorded: Instant,
    /// The newest checkpoint, unless it is on the disk, and when it was made.
    checkpoint: Option<(TrainingCheckpoint, Instant)>,
    /// When the checkpoint that was written last in this run was made: the first is written at once, so that a job whose process never
    /// lives for long gets further all the same.
    kept: Option<Instant>,
    meter: GenerationMeter,
}

impl<'a> Reporter<'a> {
    /// Of `job`, which is worked at as `live` and has its files in the given folder.
    pub(super) fn new(
        (store, runtime): (&'a Store, &'a Handle),
        job: &'a mut Job,
        live: &'a Live,
        (folder, upload): (PathBuf, Option<Arc<Upload>>),
    ) -> Self {
        let now = Instant::now();
        Self {
            store,
            runtime,
            job,
            live,
            folder,
            upload,
            unwritten: Vec::new(),
            run_unrecorded: false,
            recorded: now,
            checkpoint: None,
            kept: None,
            meter: GenerationMeter::after(live.curve_from(0).pop()),
        }
    }

    fn record(&mut self) {
        self.job.progress.evaluations = self.live.tried();
        if self.upload.as_ref().is_some_and(|upload| upload.take_kept()) {
            self.job.get_further();
        }
        // The store may take its time.
        self.live.show_life();
        let claim = self.live.claim();
        let written = if self.run_unrecorded {
            self.runtime.block_on(self.store.record_run(claim, self.job, &self.unwritten))
        } else {
            self.runtime.block_on(self.store.record(claim, self.job, &self.unwritten))
        };
        match written {
            Ok(true) => {
                self.unwritten.clear();
                self.run_unrecorded = false;
            }
            Ok(false) => self.live.lose(),
            // What is unwritten stays so, and is tried again with the next.
            Err(error) => tracing::error!(%error, "progress could not be recorded"),
        }
        self.recorded = Instant::now();
    }

    /// Has what comes of this run be the job's from the next record on, with its files.
    fn begin(&mut self) {
        self.job.begin_anew(&self.live.curve_from(0));
        if let Some(upload) = &self.upload {
            upload.hurry();
            self.run_unrecorded = true;
        }
    }

    /// Whether it is time to write a checkpoint again.
    fn may_keep(&self) -> bool {
        self.kept.is_none_or(|kept| kept.elapsed() >= CHECKPOINT_EVERY)
    }

    fn keep(&mut self) {
        let Some((checkpoint, made)) = self.checkpoint.take() else { return };
        let written = serde_json::to_vec(&checkpoint)
            .map_err(io::Error::from)
            .and_then(|bytes| Artefact::Checkpoint.publish(&self.folder, &bytes));
        match written {
            // On the disk as well, or a process that ends now would count as one that got no further.
            Ok(()) => match &self.upload {
                // It counts once it has arrived.
                Some(upload) => upload.hurry(),
                None if self.job.get_further() => self.record(),
                None => {}
            },
            Err(error) => {
                tracing::error!(%error, "the checkpoint could not be written");
                self.checkpoint = Some((checkpoint, made));
                self.kept = Some(Instant::now());
                return;
            }
        }
        self.kept = Some(made);
    }

    /// Writes what has not been written yet; whether the store knows all of it now.
    fn flush(&mut self) -> bool {
        self.record();
        // Also while the store does not answer: whoever goes on from a checkpoint writes the curve that stands in it.
        if !self.live.is_lost() {
            self.keep();
        }
        self.unwritten.is_empty() && !self.run_unrecorded
    }

    /// Writes the rest of what has happened in a run that is over, as often as it takes: the end of a job is recorded when its whole
    /// curve is, and its files are those of the run that made them. Between two attempts it waits with `pause`, which says
    /// whether to go on; a job that is left then goes on from its checkpoint later.
    pub(super) fn write_out(&mut self, pause: impl Fn() -> bool) {
        while !self.flush() && !self.live.is_lost() {
            if !pause() {
                self.live.lose();
            }
        }
    }
}

impl RunWatcher for Reporter<'_> {
    fn stage(&mut self, stage: Stage) {
        self.job.stage = Some(stage);
        if matches!(stage, Stage::Learning | Stage::Studying) {
            self.begin();
        }
        self.record();
    }

    fn prepared(&mut self, prepared: &PreparedRun) {
        if let Work::Learning(learned) = &mut self.job.work {
            learned.settings.learning = Learning::from(&prepared.setup.parameters);
            learned.settings.accuracy = prepared.setup.accuracy.into();
            learned.accuracy_choice = prepared.accuracy_choice.clone();
            learned.effects = prepared.plan.decisions.clone();
        }
        self.job.timings.standing_seconds = Some(prepared.standing_seconds);
    }

    fn generation(&mut self, figures: &Generation) {
        self.job.advance(figures);
        self.unwritten.push(figures.clone());
        self.live.push(figures.clone());
        self.meter.count(self.job, figures);
        if self.checkpoint.is_some() && self.may_keep() {
            self.flush();
        } else if self.recorded.elapsed() >= RECORD_EVERY {
            self.record();
        }
    }

    fn on_the_way(&mut self, files: OnTheWay) {
        self.live.show(files);
    }

    fn learned(&mut self, entry: &RepertoireEntry) {
        if let Work::Learning(learned) = &mut self.job.work {
            learned.motions.retain(|known| known.number < entry.number);
            learned.motions.push(MotionSummary::from(entry));
        }
        if let Some(upload) = &self.upload {
            upload.hurry();
        }
        self.record();
    }

    fn checkpoint(&mut self, checkpoint: &TrainingCheckpoint) {
        self.checkpoint = Some((checkpoint.clone(), Instant::now()));
        if self.may_keep() {
            self.flush();
        }
    }

    fn spent(&mut self, times: RunTimes) {
        self.job.timings.learning_seconds = Some(times.learning.as_secs_f64());
        self.job.timings.checking_seconds = Some(times.checking.as_secs_f64());
    }

    fn is_lost(&self) -> bool {
        self.live.is_lost()
    }
}

impl accuracy::StudyObserver for Reporter<'_> {
    fn progress(&mut self, done: usize, all: usize, _: &str) {
        self.job.progress.fraction = done as f64 / all.max(1) as f64;
        if self.recorded.elapsed() >= RECORD_EVERY {
            self.record();
        }
    }

    fn stop(&self) -> bool {
        self.live.cancel().is_cancelled()
    }
}
