//! Workers: threads that take jobs from the queue, one at a time.
//!
//! Training never runs on an asynchronous thread; a worker enters the runtime only to speak with the
//! store, and at a bounded rate.

use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use jiff::Timestamp;
use tokio::runtime::Handle;

use super::error::ServiceError;
use super::files::{self, Artefact};
use super::job::{Job, JobState, Stage};
use super::live::Live;
use super::order::Order;
use super::repertoire::{MotionSummary, RepertoireEntry};
use super::request::Settings;
use super::run::{PreparedRun, RunError, RunOutcome, RunWatcher, Unsuccessful, run};
use super::service::{Jobs, Shared};
use super::study;
use super::work::Work;
use gaitwright_learning::accuracy;
use gaitwright_learning::learn::{Generation, Learning, StopReason};
use gaitwright_learning::training::TrainingCheckpoint;

/// Shortest time between two writings of a running job's record and curve.
const RECORD_EVERY: Duration = Duration::from_millis(500);

/// Shortest time between two writings of a running job's checkpoint.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(2);

/// How long a run that was called off may go on checking what it found.
const CANCELLED_CHECK: Duration = Duration::from_millis(400);

/// How long a worker waits after the store failed before it asks again.
const STORE_PAUSE: Duration = Duration::from_secs(1);

/// How often a job is tried again after a file failed although files can be written.
const SETBACKS: u32 = 3;

/// Starts the workers of `jobs`. They end when the service shuts down; a job that runs then is
/// queued again, with a checkpoint to go on from.
///
/// # Errors
///
/// When a thread cannot be started.
pub fn start(jobs: &Jobs, runtime: &Handle) -> io::Result<Vec<JoinHandle<()>>> {
    let shared = jobs.shared();
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let threads = (cores / shared.workers).max(1);
    (0..shared.workers)
        .map(|number| {
            let (shared, runtime) = (Arc::clone(shared), runtime.clone());
            std::thread::Builder::new().name(format!("job-worker-{number}")).spawn(move || {
                let _present = Present::new(&shared);
                Worker { shared: Arc::clone(&shared), runtime, threads }.work();
            })
        })
        .collect()
}

/// Counts a worker among those that are alive, even if it panics.
struct Present<'a> {
    shared: &'a Shared,
}

impl<'a> Present<'a> {
    fn new(shared: &'a Shared) -> Self {
        shared.alive.fetch_add(1, Ordering::Relaxed);
        Self { shared }
    }
}

impl Drop for Present<'_> {
    fn drop(&mut self) {
        self.shared.alive.fetch_sub(1, Ordering::Relaxed);
    }
}

struct Worker {
    shared: Arc<Shared>,
    runtime: Handle,
    threads: usize,
}

impl Worker {
    fn work(&self) {
        while !self.shared.shutdown.is_cancelled() {
            match self.runtime.block_on(self.take()) {
                Ok(Some((job, live))) => self.serve(job, &live),
                Ok(None) => self.runtime.block_on(self.wait()),
                Err(error) => {
                    tracing::error!(%error, "no job could be taken from the queue");
                    self.runtime.block_on(self.pause());
                }
            }
        }
        // The next worker that waits for a job is to see the end as well.
        self.shared.posted.notify_one();
    }

    /// Waits before the store is asked again; whether the service goes on.
    async fn pause(&self) -> bool {
        tokio::time::timeout(STORE_PAUSE, self.shared.shutdown.cancelled()).await.is_err()
    }

    /// Waits until the data folder can be written, or for the end.
    async fn recover(&self) {
        while let Err(error) = self.shared.probe().await {
            tracing::error!(%error, "the data folder cannot be written");
            if !self.pause().await {
                return;
            }
        }
    }

    /// Waits for a new job or for the end.
    async fn wait(&self) {
        tokio::select! {
            () = self.shared.posted.notified() => {}
            () = self.shared.shutdown.cancelled() => {}
        }
    }

    /// Takes the job that has waited longest.
    async fn take(&self) -> Result<Option<(Job, Arc<Live>)>, ServiceError> {
        let mut running = self.shared.running.lock().await;
        let Some(mut job) = self.shared.store.next().await? else { return Ok(None) };
        job.state = JobState::Running;
        job.timings.started = Some(Timestamp::now());
        self.shared.store.update(&job, &[]).await?;
        let live = Arc::new(Live::default());
        running.insert(job.id, Arc::clone(&live));
        self.shared.changes.send_replace(());
        // Whoever waits beside this worker looks for the job after this one.
        self.shared.posted.notify_one();
        Ok(Some((job, live)))
    }

    /// Works at a job until it ends, or the service does.
    fn serve(&self, mut job: Job, live: &Arc<Live>) {
        let span = tracing::info_span!("job", id = %job.id);
        let _entered = span.enter();
        tracing::info!(character = job.character.name, "started");
        let stopper = {
            let (live, shutdown) = (Arc::clone(live), self.shared.shutdown.clone());
            self.runtime.spawn(async move {
                shutdown.cancelled().await;
                live.cancel().cancel();
            })
        };
        let result = catch_unwind(AssertUnwindSafe(|| match &job.work {
            Work::Learning(learned) => {
                let settings = learned.wanted();
                self.learn(&mut job, live, settings)
            }
            Work::Accuracy(_) => self.study(&mut job, live),
        }));
        stopper.abort();
        let failed = match result {
            Ok(Ok(())) => None,
            // What a full disk has broken is no fault of the job.
            Ok(Err(error)) if error.is_about_storage() && self.runtime.block_on(self.may_pass(&job)) => {
                tracing::error!(%error, "the job is put back until the data folder can be written");
                put_back(&mut job);
                None
            }
            Ok(Err(error)) => Some(error.to_string()),
            Err(panic) => Some(format!("the program broke off: {}", message(&*panic))),
        };
        if let Some(reason) = failed {
            fail(&mut job, reason);
            self.withdraw(&job);
        }
        self.runtime.block_on(self.settle(&mut job, live));
        tracing::info!(state = job.state.name(), error = job.error, "left");
        if job.state.is_final() {
            metrics::counter!("gaitwright_jobs_ended_total", "state" => job.state.name()).increment(1);
        }
        live.finish();
        self.shared.changes.send_replace(());
    }

    /// Records where a job stands that is no longer worked at, as soon as the store can be written. At the end of
    /// the service it may stay unrecorded: the job counts as running then, and is taken up again at the next start.
    async fn settle(&self, job: &mut Job, live: &Live) {
        self.recover().await;
        loop {
            let mut running = self.shared.running.lock().await;
            // The request to cancel was accepted, and holds however far the job was.
            if live.is_abandoned() && job.state != JobState::Cancelled {
                job.error = None;
                job.end(JobState::Cancelled);
            }
            let recorded = self.shared.store.update(job, &[]).await;
            let Err(error) = recorded else {
                running.remove(&job.id);
                if job.state.is_final() {
                    self.shared.setbacks.lock().await.remove(&job.id);
                }
                return;
            };
            tracing::error!(%error, "the end of the job could not be recorded");
            drop(running);
            if !self.pause().await {
                self.shared.running.lock().await.remove(&job.id);
                return;
            }
        }
    }

    /// Whether a failure of the store or of a file is worth another try: as long as nothing can be written, and a
    /// few times after that, for it may have passed in the meantime. Waits a while if so.
    async fn may_pass(&self, job: &Job) -> bool {
        if self.shared.probe().await.is_ok() {
            let mut setbacks = self.shared.setbacks.lock().await;
            let number = setbacks.entry(job.id).or_default();
            *number += 1;
            if *number > SETBACKS {
                setbacks.remove(&job.id);
                return false;
            }
        }
        self.pause().await;
        true
    }

    /// Learns what a job wants, on from its checkpoint.
    fn learn(&self, job: &mut Job, live: &Live, settings: Settings) -> Result<(), RunError> {
        let folder = self.folder(job)?;
        let checkpoint = read_checkpoint(&folder);
        // Generations after the checkpoint are gone through again.
        self.runtime.block_on(self.shared.store.forget_curve(job.id))?;
        if let Some(checkpoint) = &checkpoint {
            self.runtime.block_on(self.shared.store.update(job, &checkpoint.curve()))?;
            live.preload(checkpoint.curve());
        }
        let bytes = self.runtime.block_on(self.shared.store.job_input(job.id))?;
        let order = Order::read(&bytes, None, "", settings)?;
        let cancel = live.cancel().clone();
        let mut reporter = Reporter::new(self, job, live, folder.clone());
        let outcome =
            run(&order, self.threads, &folder, (&cancel, CANCELLED_CHECK), checkpoint, &mut reporter);
        reporter.flush();
        let outcome = outcome?;
        let not_begun = outcome.motion == Err(Unsuccessful::NotBegun);
        conclude(job, live, outcome);
        if not_begun && job.state.is_final() {
            self.withdraw(job);
        }
        Ok(())
    }

    /// Does the study that a job wants, from its beginning.
    fn study(&self, job: &mut Job, live: &Live) -> Result<(), RunError> {
        let folder = self.folder(job)?;
        let bytes = self.runtime.block_on(self.shared.store.job_input(job.id))?;
        let mut reporter = Reporter::new(self, job, live, folder.clone());
        reporter.stage(Stage::Studying);
        match study::run(&bytes, &folder, &mut reporter)? {
            Some(studied) => {
                job.work = Work::Accuracy(Box::new(studied));
                job.end(JobState::Succeeded);
            }
            None => call_off(job, live),
        }
        Ok(())
    }

    /// Removes what an earlier run of a job that was tried again has left as its results.
    fn withdraw(&self, job: &Job) {
        if let Err(error) = files::withdraw(&files::folder(&self.shared.data, job.id)) {
            tracing::error!(%error, "the results of an earlier run could not be removed");
        }
    }

    /// The folder of a job's files.
    fn folder(&self, job: &Job) -> io::Result<PathBuf> {
        let folder = files::folder(&self.shared.data, job.id);
        std::fs::create_dir_all(&folder)?;
        Ok(folder)
    }
}

/// Passes on what happens in a run: at once to those who watch, at a bounded rate to the disk.
struct Reporter<'a> {
    worker: &'a Worker,
    job: &'a mut Job,
    live: &'a Live,
    folder: PathBuf,
    /// Points of the curve that are not in the store yet.
    unwritten: Vec<Generation>,
    recorded: Instant,
    /// The newest checkpoint, unless it is on the disk.
    checkpoint: Option<TrainingCheckpoint>,
    kept: Instant,
}

impl<'a> Reporter<'a> {
    fn new(worker: &'a Worker, job: &'a mut Job, live: &'a Live, folder: PathBuf) -> Self {
        let now = Instant::now();
        Self { worker, job, live, folder, unwritten: Vec::new(), recorded: now, checkpoint: None, kept: now }
    }

    fn record(&mut self) {
        let written =
            self.worker.runtime.block_on(self.worker.shared.store.update(self.job, &self.unwritten));
        match written {
            Ok(()) => self.unwritten.clear(),
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
        if let Err(error) = written {
            tracing::error!(%error, "the checkpoint could not be written");
        }
        self.kept = Instant::now();
    }

    /// Writes what has not been written yet.
    fn flush(&mut self) {
        // The curve first: a checkpoint is never ahead of it.
        self.record();
        self.keep();
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
        metrics::counter!("gaitwright_generations_total").increment(1);
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

/// Writes what came of a job that learns into its record.
fn conclude(job: &mut Job, live: &Live, outcome: RunOutcome) {
    let cancelled = outcome.ended == StopReason::Cancelled;
    job.timings.checking_seconds = Some(outcome.checking_seconds);
    if let Work::Learning(learned) = &mut job.work {
        learned.ended_by = (!cancelled || live.is_abandoned()).then_some(outcome.ended);
        learned.metrics = outcome.motion.as_ref().ok().cloned();
    }
    match outcome.motion {
        _ if cancelled => call_off(job, live),
        Ok(_) => job.end(JobState::Succeeded),
        Err(reason) => fail(job, reason.to_string()),
    }
}

/// Ends a job that was stopped for good; one that was stopped with the service waits for the next start.
fn call_off(job: &mut Job, live: &Live) {
    if live.is_abandoned() {
        job.end(JobState::Cancelled);
    } else {
        put_back(job);
    }
}

/// Has a job wait for a worker again.
fn put_back(job: &mut Job) {
    job.state = JobState::Queued;
    job.stage = None;
}

/// The checkpoint in a job's folder, when there is one that can be read.
fn read_checkpoint(folder: &Path) -> Option<TrainingCheckpoint> {
    let bytes = std::fs::read(Artefact::Checkpoint.path(folder)).ok()?;
    serde_json::from_slice(&bytes)
        .inspect_err(|error| tracing::warn!(%error, "the checkpoint cannot be read; the job starts afresh"))
        .ok()
}

fn fail(job: &mut Job, reason: String) {
    job.error = Some(reason);
    job.end(JobState::Failed);
}

/// The message of a panic.
fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given")
}
