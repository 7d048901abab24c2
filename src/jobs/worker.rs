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
use std::time::{Duration, Instant};

use tokio::runtime::Handle;
use uuid::Uuid;

use super::error::ServiceError;
use super::figures::{self, FailureCause};
use super::files::{self, Artefact, Run, Upload};
use super::job::{Job, JobState, Stage};
use super::lease;
use super::live::{Live, OnTheWay};
use super::order::Order;
use super::reporter::Reporter;
use super::request::Settings;
use super::run::{RunError, RunOutcome, RunWatcher, run};
use super::service::Shared;
use super::store::{Claimed, StoreError};
use super::study;
use super::work::{MotionOutcome, Work};
use gaitwright_learning::learn::StopReason;
use gaitwright_learning::training::TrainingCheckpoint;

/// How long a run that was called off may go on checking what it found.
const CANCELLED_CHECK: Duration = Duration::from_millis(400);

/// How long a worker waits after the store failed before it asks again.
const STORE_PAUSE: Duration = Duration::from_secs(1);

/// Time after which a worker that waits for work looks for some, where others may post it.
const LOOK_EVERY: Duration = Duration::from_secs(2);

/// Time between two signs of life of a worker that waits for a store.
const SIGN_EVERY: Duration = Duration::from_millis(250);

/// Starts a worker. It ends when the service shuts down; a job that runs
/// then is queued again, with a checkpoint to go on from.
///
/// # Errors
///
/// When its thread cannot be started.
pub(super) fn spawn(shared: &Arc<Shared>, runtime: &Handle) -> io::Result<()> {
    let name = format!("{}/{}", std::process::id(), Uuid::now_v7());
    let worker = Worker { shared: Arc::clone(shared), runtime: runtime.clone(), name };
    let thread = std::thread::Builder::new().name("job-worker".to_owned());
    shared.alive.fetch_add(1, Ordering::Relaxed);
    let started = thread.spawn(move || {
        let mut present = Present { shared: Arc::clone(&worker.shared), given_up: false };
        present.given_up = worker.work() == Left::GivenUp;
    });
    if started.is_err() {
        shared.alive.fetch_sub(1, Ordering::Relaxed);
    }
    started.map(drop)
}

/// Counts a worker out when it ends, even by a panic; one that was given up has been counted out.
struct Present {
    shared: Arc<Shared>,
    given_up: bool,
}

impl Drop for Present {
    fn drop(&mut self) {
        if !self.given_up {
            self.shared.alive.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

/// Why a worker has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Left {
    /// The service shuts down.
    AtTheEnd,
    /// It showed no sign of life for too long, and another has its place.
    GivenUp,
}

struct Worker {
    shared: Arc<Shared>,
    runtime: Handle,
    /// What the store knows it by.
    name: String,
}

impl Worker {
    fn work(&self) -> Left {
        while !self.shared.shutdown.is_cancelled() {
            match self.runtime.block_on(self.take()) {
                Ok(Some((job, live))) => {
                    self.serve(job, &live);
                    if !live.part() {
                        return Left::GivenUp;
                    }
                }
                Ok(None) => self.runtime.block_on(self.wait()),
                Err(error) => {
                    tracing::error!(%error, "no job could be taken from the queue");
                    self.runtime.block_on(self.pause());
                }
            }
        }
        // The next worker that waits for a job is to see the end as well.
        self.shared.posted.notify_one();
        Left::AtTheEnd
    }

    /// Waits before the store is asked again; whether the service goes on.
    async fn pause(&self) -> bool {
        tokio::time::timeout(STORE_PAUSE, self.shared.shutdown.cancelled()).await.is_err()
    }

    /// Waits until store and files can be written, or for the end, or until the job is lost.
    async fn recover(&self, live: &Live) {
        loop {
            let probe = self.shared.probe();
            let probed =
                if self.shared.store.is_shared() { lively(live, probe).await } else { Some(probe.await) };
            let Some(Err(error)) = probed else { return };
            tracing::error!(%error, "store or files cannot be written");
            live.show_life();
            if !self.pause().await {
                return;
            }
        }
    }

    /// Waits for a new job or for the end.
    async fn wait(&self) {
        let look = async {
            if self.shared.store.is_shared() {
                tokio::time::sleep(LOOK_EVERY).await;
            } else {
                std::future::pending().await
            }
        };
        tokio::select! {
            () = self.shared.posted.notified() => {}
            () = self.shared.shutdown.cancelled() => {}
            () = look => {}
        }
    }

    /// Takes the job whose turn it is.
    async fn take(&self) -> Result<Option<(Job, Arc<Live>)>, ServiceError> {
        let length = self.shared.lease;
        let now = Instant::now();
        let Some(Claimed { claim, job, first }) = self.shared.store.claim(&self.name, length).await? else {
            return Ok(None);
        };
        if first {
            figures::taken_up_first(&job);
        }
        let live = Arc::new(Live::new(claim, job.progress.evaluations, now));
        self.shared.running.add(&live);
        // Somebody may have asked for its end before it could be found among those that run.
        lease::renew(&self.shared.store, &live, length).await;
        self.shared.changed(claim.id);
        // Whoever waits beside this worker looks for the job after this one.
        self.shared.posted.notify_one();
        Ok(Some((job, live)))
    }

    /// Works at a job until it ends, or the service does.
    fn serve(&self, mut job: Job, live: &Arc<Live>) {
        let span = tracing::info_span!("job", job_id = %job.id);
        let _entered = span.enter();
        tracing::info!(character = job.character.name, attempt = job.attempts, "started");
        let stopper = {
            let (live, shutdown) = (Arc::clone(live), self.shared.shutdown.clone());
            self.runtime.spawn(async move {
                shutdown.cancelled().await;
                live.cancel().cancel();
            })
        };
        let place = self.shared.files.work_folder(live.claim().into(), &self.runtime);
        let result = catch_unwind(AssertUnwindSafe(|| {
            let place = match &place {
                Ok((folder, upload)) => (folder.clone(), upload.clone()),
                Err(error) => return Err(io::Error::new(error.kind(), error.to_string()).into()),
            };
            match &job.work {
                Work::Learning(learned) => {
                    let settings = learned.wanted();
                    self.learn(&mut job, live, place, settings)
                }
                Work::Accuracy(_) => self.study(&mut job, live, place),
            }
        }));
        stopper.abort();
        let place = place.ok();
        let whole = matches!(result, Ok(Ok(())));
        let had_earlier = job.has_earlier_results();
        // Why it has failed, if it has.
        let cause = match result {
            Ok(Ok(())) => FailureCause::NoMotion,
            Ok(Err(error)) if error.is_about_storage() => {
                self.set_back(&mut job, live, &error);
                FailureCause::Storage
            }
            Ok(Err(error)) => {
                job.fail(error.to_string());
                FailureCause::Run
            }
            Err(panic) => {
                job.fail(format!("the program broke off: {}", message(&*panic)));
                FailureCause::Panic
            }
        };
        if let Some((folder, _)) = &place
            && !whole
            && !had_earlier
            && !job.has_motions()
            && job.state == JobState::Failed
            && !live.is_lost()
        {
            withdraw(folder);
        }
        self.runtime.block_on(self.settle(&mut job, live, place.as_ref()));
        if live.is_lost() {
            tracing::warn!("the job has passed to another worker");
        } else {
            if job.state.is_final() {
                figures::ended(&job, cause);
            }
            tracing::info!(state = job.state.name(), error = job.error, "left");
        }
        live.finish();
        self.shared.changed(job.id);
    }

    /// Has a job wait again for which the store or a file has failed. While nothing can be written that is no fault of
    /// the job; otherwise it counts as an attempt.
    fn set_back(&self, job: &mut Job, live: &Live, error: &RunError) {
        tracing::error!(%error, "the job is put back");
        if self.runtime.block_on(self.shared.probe()).is_err() {
            job.put_back();
        } else {
            job.lose(&error.to_string());
        }
        live.show_life();
        self.runtime.block_on(self.pause());
    }

    /// Records where a job stands that is no longer worked at, as soon as its files are where they are kept and the store
    /// can be written. At the end of the service it may stay unrecorded: the job counts as running then, and is taken up
    /// again by another worker or at the next start.
    async fn settle(&self, job: &mut Job, live: &Arc<Live>, place: Option<&(PathBuf, Option<Arc<Upload>>)>) {
        // One that would only fail again is not put back before that has passed. The end of a job does not wait for a probe:
        // below it is tried until it can be recorded.
        if job.state == JobState::Queued && !live.is_lost() {
            self.recover(live).await;
        }
        let (folder, upload) = match place {
            Some((folder, upload)) => (Some(folder), upload.as_ref()),
            None => (None, None),
        };
        // A job that waits again can do with what has arrived by now.
        while let Some(upload) = upload
            && let Some(Err(error)) = lively(live, upload.finish()).await
        {
            tracing::error!(%error, "the files of the job could not be brought to where they are kept");
            if !self.pause().await {
                if job.state.is_final() {
                    live.lose();
                }
                break;
            }
        }
        let own = Run::from(live.claim());
        let kept = if upload.is_none() { Some(own) } else { self.kept_run(live).await };
        let begun = kept == Some(own);
        let earlier = match kept {
            Some(run) if !begun => lively(live, self.shared.files.storage(run)).await.and_then(Result::ok),
            _ => None,
        };
        // The process of an attempt may have ended before it could record what its motion is worth.
        if job.lacks_figures()
            && let Some(run) = kept
            && let Some(Ok(Some(list))) =
                lively(live, self.shared.files.read(run, Artefact::Motions.file_name())).await
            && let Ok(repertoire) = serde_json::from_slice(&list)
        {
            job.recall(&repertoire);
        }
        while !live.is_lost() {
            live.show_life();
            if begun && let Some(folder) = folder {
                job.storage = files::storage(folder);
            } else if let Some(earlier) = &earlier {
                job.storage.clone_from(earlier);
            }
            match self.shared.store.settle(live.claim(), job).await {
                Ok(true) => break,
                Ok(false) => live.lose(),
                Err(error) => {
                    tracing::error!(%error, "the end of the job could not be recorded");
                    if !self.pause().await {
                        break;
                    }
                }
            }
        }
        if let Some(upload) = upload
            && job.state.is_final()
            && let Some(Err(error)) = lively(live, upload.tidy(job.state == JobState::Succeeded, begun)).await
        {
            tracing::warn!(%error, "files that the job no longer needs are left over");
        }
        self.shared.running.remove(live);
    }

    /// The run whose files are the job's, where runs are kept apart: until the work proper begins, an earlier one. `None` where the
    /// store does not say.
    async fn kept_run(&self, live: &Live) -> Option<Run> {
        let id = live.claim().id;
        let number = lively(live, self.shared.store.run(id)).await?.ok()?;
        Some(Run { id, number })
    }

    /// Learns what a job wants, on from its checkpoint.
    fn learn(
        &self,
        job: &mut Job,
        live: &Live,
        (folder, upload): (PathBuf, Option<Arc<Upload>>),
        settings: Settings,
    ) -> Result<(), RunError> {
        let looked = self.shared.files.checkpoint(job.id);
        let found = match &upload {
            Some(_) => self.runtime.block_on(lively(live, looked)),
            // A disk may never answer, and its worker has to be given up then.
            None => Some(self.runtime.block_on(looked)),
        };
        let Some(found) = found else { return Ok(()) };
        let checkpoint = found?.and_then(|bytes| read_checkpoint(&bytes));
        // What an attempt that was broken off has left counts until this one gets as far.
        if let Work::Learning(learned) = &mut job.work {
            learned.set_aside();
        }
        // Generations after the checkpoint are gone through again.
        let curve = checkpoint.as_ref().map(TrainingCheckpoint::curve).unwrap_or_default();
        if checkpoint.is_some() {
            tracing::info!(generations = curve.len(), "goes on from its checkpoint");
        }
        if !self.runtime.block_on(self.shared.store.record_afresh(live.claim(), job, &curve))? {
            live.lose();
            return Ok(());
        }
        live.preload(curve);
        let bytes = self.input(job.id)?;
        let order = Order::read(&bytes, None, "", settings)?;
        let threads = self.shared.threads();
        // The budget may have been another when the job was posted.
        order.memory(threads).check(self.shared.job_memory)?;
        let cancel = live.cancel().clone();
        let place = (folder.clone(), upload);
        let mut reporter = Reporter::new((&self.shared.store, &self.runtime), job, live, place);
        let outcome = run(&order, threads, &folder, (&cancel, CANCELLED_CHECK), checkpoint, &mut reporter);
        live.show(OnTheWay::new());
        reporter.write_out(|| self.runtime.block_on(self.pause()));
        if live.is_lost() {
            return Ok(());
        }
        let outcome = outcome?;
        conclude(job, live, outcome);
        Ok(())
    }

    /// The bytes of what a job works on. One that is worked at is never deleted.
    fn input(&self, id: Uuid) -> Result<Vec<u8>, StoreError> {
        let input = self.runtime.block_on(self.shared.store.job_input(id))?;
        Ok(input.ok_or(sqlx::Error::RowNotFound)?)
    }

    /// Does the study that a job wants, from its beginning.
    fn study(
        &self,
        job: &mut Job,
        live: &Live,
        (folder, upload): (PathBuf, Option<Arc<Upload>>),
    ) -> Result<(), RunError> {
        let bytes = self.input(job.id)?;
        let place = (folder.clone(), upload);
        let mut reporter = Reporter::new((&self.shared.store, &self.runtime), job, live, place);
        reporter.stage(Stage::Studying);
        let studied = study::run((&bytes, self.shared.job_memory), &folder, &mut reporter);
        reporter.write_out(|| self.runtime.block_on(self.pause()));
        if live.is_lost() {
            return Ok(());
        }
        match studied? {
            Some(studied) => {
                job.work = Work::Accuracy(Box::new(studied));
                job.end(JobState::Succeeded);
            }
            None => call_off(job, live),
        }
        Ok(())
    }
}

/// What comes of waiting for a store that answers within a limited time, in which a worker shows signs of life; `None` once the job is no longer its own.
async fn lively<T>(live: &Live, waited: impl Future<Output = T>) -> Option<T> {
    let mut waited = std::pin::pin!(waited);
    loop {
        live.show_life();
        if live.is_lost() {
            return None;
        }
        if let Ok(came) = tokio::time::timeout(SIGN_EVERY, &mut waited).await {
            return Some(came);
        }
    }
}

/// Removes what an earlier run of a job that was tried again has left as its results.
fn withdraw(folder: &Path) {
    if let Err(error) = files::withdraw(folder) {
        tracing::error!(%error, "the results of an earlier run could not be removed");
    }
}

/// Writes what came of a job that learns into its record.
fn conclude(job: &mut Job, live: &Live, outcome: RunOutcome) {
    let cancelled = outcome.ended == StopReason::Cancelled;
    if let Work::Learning(learned) = &mut job.work {
        learned.ended_by = (!cancelled || live.is_abandoned()).then_some(outcome.ended);
        learned.metrics = outcome.motion.as_ref().ok().cloned();
        learned.accuracy_check.clone_from(&outcome.accuracy_check);
        learned.outcome = Some(MotionOutcome::of(learned.metrics.as_ref()));
    }
    match outcome.motion {
        _ if cancelled => call_off(job, live),
        Ok(_) => job.end(JobState::Succeeded),
        Err(reason) => job.fail(reason.to_string()),
    }
}

/// Ends a job that was stopped for good; one that was stopped with the service waits for the next start.
fn call_off(job: &mut Job, live: &Live) {
    if live.is_abandoned() {
        job.end(JobState::Cancelled);
    } else {
        job.put_back();
    }
}

/// The checkpoint in a file, when it can be read.
fn read_checkpoint(bytes: &[u8]) -> Option<TrainingCheckpoint> {
    serde_json::from_slice(bytes)
        .inspect_err(|error| tracing::warn!(%error, "the checkpoint cannot be read; the job starts afresh"))
        .ok()
}

/// The message of a panic.
fn message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given")
}
