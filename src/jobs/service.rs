//! The jobs of one data folder: opened, shared, watched over and closed. What clients may ask of them stands in the
//! files `queue`, `results` and `characters`.

use std::fs::File;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::{Mutex, Notify, Semaphore, watch};
use tokio_util::sync::CancellationToken;
use tracing::Instrument;
use uuid::Uuid;

use super::error::ServiceError;
use super::files;
use super::live::Running;
use super::retention::RetentionOptions;
use super::store::{Reclaimed, Store};
use super::study;
use gaitwright_learning::scenario::Scenario;
use gaitwright_physics::fault::InputError;

/// How long a short computation may wait for its turn.
const TURN_TIMEOUT: Duration = Duration::from_secs(5);

/// How long it is taken for granted that the data folder can be written, once it could.
const PROBE_EVERY: Duration = Duration::from_millis(500);

/// Bytes written to see whether files can be: as many as the recording of a short job has.
const PROBE_SIZE: usize = 1 << 20;

/// How a service is set up.
#[derive(Debug, Clone)]
pub struct ServiceOptions {
    /// Folder of the store and of the jobs' files.
    pub data: PathBuf,
    /// Jobs worked at side by side.
    pub workers: usize,
    /// Jobs that may wait.
    pub queue: u64,
    /// Jobs of one caller that may wait; as many as of all where `None`.
    pub caller_queue: Option<u64>,
    /// How long a worker that shows no sign of life keeps its job.
    pub lease: Duration,
    /// Memory that a job may come to need, bytes.
    pub job_memory: u64,
    /// How much is kept of everything.
    pub retention: RetentionOptions,
}

impl ServiceOptions {
    /// On the folder `data`, with one worker and the usual limits.
    pub fn new(data: PathBuf) -> Self {
        Self {
            data,
            workers: 1,
            queue: 64,
            caller_queue: None,
            lease: Duration::from_secs(60),
            job_memory: 1 << 30,
            retention: RetentionOptions::default(),
        }
    }
}

/// The jobs of one data folder; clones share them.
#[derive(Debug, Clone)]
pub struct Jobs {
    shared: Arc<Shared>,
}

#[derive(Debug)]
pub(super) struct Shared {
    pub(super) data: PathBuf,
    pub(super) workers: usize,
    /// When the data folder could be written last, as far as somebody has asked.
    proven: Mutex<Option<Instant>>,
    /// Workers that have been started, and have neither ended nor been given up.
    pub(super) alive: AtomicUsize,
    /// How long a worker that shows no sign of life keeps its job.
    pub(super) lease: Duration,
    /// Memory that a job may come to need, bytes.
    pub(super) job_memory: u64,
    /// How much is kept of everything.
    pub(super) retention: RetentionOptions,
    pub(super) store: Store,
    /// Jobs that may wait.
    pub(super) queue: u64,
    /// Jobs of one caller that may wait.
    pub(super) caller_queue: u64,
    /// Held by whoever adds a job to those that wait: to count them and to add one is one step.
    pub(super) posting: Mutex<()>,
    pub(super) running: Running,
    /// Told of every new job.
    pub(super) posted: Notify,
    /// Told of every job that is taken up, put back or over.
    pub(super) changes: watch::Sender<()>,
    pub(super) shutdown: CancellationToken,
    /// Short computations done for a waiting client.
    computations: Arc<Semaphore>,
    /// Keeps other processes out of the data folder.
    _lock: File,
}

impl Jobs {
    /// Opens the data folder, made if there is none. Jobs that were running when it was last left
    /// are queued again, but for those that were to be cancelled. Everything ends when `shutdown` is cancelled.
    ///
    /// # Errors
    ///
    /// When the folder cannot be used, or another process uses it.
    pub async fn open(options: ServiceOptions, shutdown: CancellationToken) -> Result<Self, ServiceError> {
        std::fs::create_dir_all(options.data.join("jobs"))?;
        let lock = File::create(options.data.join("lock"))?;
        lock.try_lock().map_err(|error| {
            io::Error::new(
                io::ErrorKind::ResourceBusy,
                format!("{} is in use: {error}", options.data.display()),
            )
        })?;
        let store = Store::open(&options.data).await?;
        // Nobody else works on this folder: whoever did is gone.
        for job in store.reclaim(Reclaimed::All, "the service ended while it was worked at").await? {
            tracing::warn!(job_id = %job.id, attempts = job.attempts, state = job.state.name(), "found unfinished");
        }
        files::sweep(&options.data, &store.ids().await?)?;
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let shared = Shared {
            data: options.data,
            workers: options.workers.max(1),
            proven: Mutex::default(),
            alive: AtomicUsize::new(0),
            lease: options.lease,
            job_memory: options.job_memory,
            retention: options.retention,
            store,
            queue: options.queue,
            caller_queue: options.caller_queue.unwrap_or(options.queue),
            posting: Mutex::default(),
            running: Running::default(),
            posted: Notify::new(),
            changes: watch::Sender::default(),
            shutdown,
            computations: Arc::new(Semaphore::new(cores)),
            _lock: lock,
        };
        Ok(Self { shared: Arc::new(shared) })
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Told of every job that is taken up, put back or over.
    pub fn changes(&self) -> watch::Receiver<()> {
        self.shared.changes.subscribe()
    }

    /// Number of workers that are there.
    pub fn workers(&self) -> usize {
        self.shared.alive.load(Ordering::Relaxed)
    }

    /// Whether the character of `scenario` may be simulated with the memory that there is for a job.
    ///
    /// # Errors
    ///
    /// Every fault of the character; [`InputError::Impossible`] with the figures of one that is too large.
    pub fn check_memory(&self, scenario: &Scenario) -> Result<(), InputError> {
        study::check_memory(scenario, self.shared.job_memory)
    }

    /// Lets go of the store; nothing can be asked afterwards.
    pub async fn close(&self) {
        self.shared.store.close().await;
    }

    /// Cancelled when the service is about to end.
    pub fn shutdown(&self) -> &CancellationToken {
        &self.shared.shutdown
    }

    /// Whether jobs are taken and worked at, and the data folder can be written.
    ///
    /// # Errors
    ///
    /// When not, and why.
    pub async fn ready(&self) -> Result<(), ServiceError> {
        self.check_not_shutting_down()?;
        let (alive, workers) = (self.workers(), self.shared.workers);
        if alive < workers {
            return Err(ServiceError::Unmanned { alive, workers });
        }
        // One at a time, and not at the rate at which anybody may ask.
        let mut proven = self.shared.proven.lock().await;
        if proven.is_none_or(|at| at.elapsed() >= PROBE_EVERY) {
            *proven = None;
            self.shared.probe().await?;
            *proven = Some(Instant::now());
        }
        Ok(())
    }

    /// Runs a short computation off the asynchronous threads, as many at once as there are cores. It can
    /// ask whether nobody waits for it any more, to make room for others.
    ///
    /// # Errors
    ///
    /// That of the computation; [`ServiceError::Busy`] when its turn does not come soon;
    /// [`ServiceError::Broken`] when it panics.
    pub async fn compute<T: Send + 'static>(
        &self,
        computation: impl FnOnce(&dyn Fn() -> bool) -> Result<T, ServiceError> + Send + 'static,
    ) -> Result<T, ServiceError> {
        let turn = Arc::clone(&self.shared.computations).acquire_owned();
        let permit = tokio::time::timeout(TURN_TIMEOUT, turn)
            .await
            .map_err(|_| ServiceError::Busy)?
            .map_err(|_| ServiceError::ShuttingDown)?;
        let given_up = CancellationToken::new();
        // Dropped with this future, which a client that hangs up takes with it.
        let _guard = given_up.clone().drop_guard();
        tokio::task::spawn_blocking(move || {
            let _permit = permit;
            computation(&|| given_up.is_cancelled())
        })
        .await?
    }

    /// The folder of a job's files.
    pub(super) fn folder(&self, id: Uuid) -> PathBuf {
        files::folder(&self.shared.data, id)
    }

    /// # Errors
    ///
    /// [`ServiceError::ShuttingDown`].
    pub(super) fn check_not_shutting_down(&self) -> Result<(), ServiceError> {
        if self.shared.shutdown.is_cancelled() { Err(ServiceError::ShuttingDown) } else { Ok(()) }
    }
}

impl Shared {
    /// Threads of a worker: the workers share the cores.
    pub(super) fn threads(&self) -> usize {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        (cores / self.workers).max(1)
    }

    /// Whether store and files can be written, by writing to both.
    ///
    /// # Errors
    ///
    /// When one of them cannot.
    pub(super) async fn probe(&self) -> Result<(), ServiceError> {
        self.store.probe().await?;
        let data = self.data.clone();
        tokio::task::spawn_blocking(move || {
            let mut file = files::probe(&data)?;
            file.write_all(&vec![0; PROBE_SIZE])?;
            file.as_file().sync_all()
        })
        .await??;
        Ok(())
    }
}

/// Does something to its end even if nobody waits for it any more: a client that hangs up must not leave it half done.
pub(super) async fn uninterrupted<T: Send + 'static>(
    work: impl Future<Output = Result<T, ServiceError>> + Send + 'static,
) -> Result<T, ServiceError> {
    tokio::spawn(work.in_current_span()).await?
}
