//! What a running job tells of itself.

use std::io;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use tokio::runtime::Handle;

use super::figures::GenerationMeter;
use super::files::Artefact;
use super::job::{Job, Stage};
use super::live::Live;
use super::repertoire::{MotionSummary, RepertoireEntry};
use super::run::{PreparedRun, RunWatcher};
use super::store::Store;
use super::work::Work;
use gaitwright_learning::accuracy;
use gaitwright_learning::learn::{Generation, Learning};
use gaitwright_learning::training::TrainingCheckpoint;

/// Shortest time between two writings of a running job's record and curve.
const RECORD_EVERY: Duration = Duration::from_millis(500);

/// Shortest time between two writings of a running job's checkpoint.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(2);

/// Passes on what happens in a run: at once to those who watch, at a bounded rate to the disk.
pub(super) struct Reporter<'a> {
    store: &'a Store,
    runtime: &'a Handle,
    job: &'a mut Job,
    live: &'a Live,
    folder: PathBuf,
    /// Points of the curve that are not in the store yet.
    unwritten: Vec<Generation>,
    recorded: Instant,
    /// The newest checkpoint, unless it is on the disk.
    checkpoint: Option<TrainingCheckpoint>,
    kept: Instant,
    meter: GenerationMeter,
}

impl<'a> Reporter<'a> {
    /// Of `job`, which is worked at as `live` and has its files in `folder`.
    pub(super) fn new(
        (store, runtime): (&'a Store, &'a Handle),
        job: &'a mut Job,
        live: &'a Live,
        folder: PathBuf,
    ) -> Self {
        let now = Instant::now();
        Self {
            store,
            runtime,
            job,
            live,
            folder,
            unwritten: Vec::new(),
            recorded: now,
            checkpoint: None,
            kept: now,
            meter: GenerationMeter::after(live.curve_from(0).pop()),
        }
    }

    fn record(&mut self) {
        let written = self.store.record(self.live.claim(), self.job, &self.unwritten);
        match self.runtime.block_on(written) {
            Ok(true) => self.unwritten.clear(),
            Ok(false) => self.live.lose(),
            // They stay unwritten, and are tried again with the next.
            Err(error) => tracing::error!(%error, "progress could not be recorded"),
        }
        self.recorded = Instant::now();
    }

    fn keep(&mut self) {
        let Some(checkpoint) = self.checkpoint.take() else { return };
        let written = serde_json::to_vec(&checkpoint)
            .map_err(io::Error::from)
            .and_then(|bytes| Artefact::Checkpoint.publish(&self.folder, &bytes));
        match written {
            Ok(()) => self.job.get_further(),
            Err(error) => tracing::error!(%error, "the checkpoint could not be written"),
        }
        self.kept = Instant::now();
    }

    /// Writes what has not been written yet.
    pub(super) fn flush(&mut self) {
        // The curve first: a checkpoint is never ahead of it.
        self.record();
        if !self.live.is_lost() {
            self.keep();
        }
    }
}

impl RunWatcher for Reporter<'_> {
    fn stage(&mut self, stage: Stage) {
        self.job.stage = Some(stage);
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
        if self.recorded.elapsed() >= RECORD_EVERY {
            self.record();
        }
    }

    fn learned(&mut self, entry: &RepertoireEntry) {
        if let Work::Learning(learned) = &mut self.job.work {
            learned.motions.retain(|known| known.number < entry.number);
            learned.motions.push(MotionSummary::from(entry));
        }
        self.record();
    }

    fn checkpoint(&mut self, checkpoint: &TrainingCheckpoint) {
        self.checkpoint = Some(checkpoint.clone());
        if self.kept.elapsed() >= CHECKPOINT_EVERY {
            self.flush();
        }
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
