//! The jobs of one data folder: opened, shared, watched over and closed. What clients may ask of them stands in the
//! files `queue`, `results` and `characters`.

use std::fs::File;
use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::{Mutex, Notify, Semaphore, broadcast};
use tokio_util::sync::CancellationToken;
use tracing::Instrument;
use uuid::Uuid;

use super::changes::Changes;
use super::error::ServiceError;
use super::files::{JobFiles, Run};
use super::live::Running;
use super::places::{FilesPlace, StorePlace};
use super::retention::RetentionOptions;
use super::store::{QueueRoom, Reclaimed, Store};
use super::study;
use gaitwright_learning::scenario::Scenario;
use gaitwright_physics::fault::InputError;

/// How long a short computation may wait for its turn.
const TURN_TIMEOUT: Duration = Duration::from_secs(5);

/// How long it is taken for granted that the data folder can be written, once it could.
const PROBE_EVERY: Duration = Duration::from_millis(500);

/// How long one who asks whether store and files can be written waits for them to answer.
const PROBE_TIMEOUT: Duration = Duration::from_secs(5);

/// Things that happened to jobs that one who waits may be behind; whoever is further behind looks at everything.
const CHANGES: usize = 1024;

/// Jobs worked at side by side, unless told otherwise.
pub const WORKERS: u16 = 1;

/// Jobs that may wait, unless told otherwise.
pub const QUEUE: u64 = 64;

/// How long a worker that shows no sign of life keeps its job, unless told otherwise, where nobody else can take it.
pub const LEASE: Duration = Duration::from_secs(60);

/// Memory that a job may come to need, unless told otherwise, bytes.
pub const JOB_MEMORY: u64 = 1 << 30;

/// How a service is set up.
#[derive(Debug, Clone)]
pub struct ServiceOptions {
    /// Folder of the store and of the jobs' files, as far as they are not elsewhere.
    pub data: PathBuf,
    /// Where the store is.
    pub store: StorePlace,
    /// Where the jobs' files are.
    pub files: FilesPlace,
    /// Jobs worked at side by side; none where other processes work.
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
            store: StorePlace::default(),
            files: FilesPlace::default(),
            workers: usize::from(WORKERS),
            queue: QUEUE,
            caller_queue: None,
            lease: LEASE,
            job_memory: JOB_MEMORY,
            retention: RetentionOptions::default(),
        }
    }
}

/// The jobs of one store; clones share them.
#[derive(Debug, Clone)]
pub struct Jobs {
    shared: Arc<Shared>,
}

#[derive(Debug)]
pub(super) struct Shared {
    pub(super) files: JobFiles,
    pub(super) workers: usize,
    /// When store and files could be written last, as far as somebody has asked.
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
    /// How many jobs may wait.
    pub(super) room: QueueRoom,
    pub(super) running: Running,
    /// Told of every new job.
    pub(super) posted: Notify,
    /// Told of every job that something happens to.
    changes: broadcast::Sender<Uuid>,
    pub(super) shutdown: CancellationToken,
    /// Short computations done for a waiting client.
    computations: Arc<Semaphore>,
    /// Keeps other processes out of the data folder, where the store is in it.
    _lock: Option<File>,
}

impl Jobs {
    /// Opens the data folder, made if there is none, and the places elsewhere that the options name. Where no other process
    /// can use the store, jobs that were running when it was last left are queued again, but for those that were to be
    /// cancelled. Everything ends when `shutdown` is cancelled.
    ///
    /// # Errors
    ///
    /// When a place cannot be used, or another process uses the folder.
    pub async fn open(options: ServiceOptions, shutdown: CancellationToken) -> Result<Self, ServiceError> {
        std::fs::create_dir_all(&options.data)?;
        let (lock, store) = match &options.store {
            StorePlace::Folder => (Some(lock(&options)?), Store::open(&options.data).await?),
            StorePlace::Server(url) => (None, Store::connect(url).await?),
        };
        let files = JobFiles::open(&options.files, &options.data)?;
        if !store.is_shared() {
            // Nobody else works on this folder: whoever did is gone.
            for job in store.reclaim(Reclaimed::All, "the service ended while it was worked at").await? {
                tracing::warn!(job_id = %job.id, attempts = job.attempts, state = job.state.name(), "found unfinished");
            }
            files.sweep()?;
        }
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let shared = Shared {
            files,
            workers: options.workers,
            proven: Mutex::default(),
            alive: AtomicUsize::new(0),
            lease: options.lease,
            job_memory: options.job_memory,
            retention: options.retention,
            store,
            room: QueueRoom { all: options.queue, caller: options.caller_queue.unwrap_or(options.queue) },
            running: Running::default(),
            posted: Notify::new(),
            changes: broadcast::Sender::new(CHANGES),
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
    pub fn changes(&self) -> Changes {
        Changes(self.shared.changes.subscribe())
    }

    /// Whether other processes may use the same jobs: what they do may come to be known late.
    pub fn is_shared(&self) -> bool {
        self.shared.store.is_shared()
    }

    /// Number of workers that are there.
    pub fn workers(&self) -> usize {
        self.shared.alive.load(Ordering::Relaxed)
    }

    /// Whether the character of `scenario` may be simulated with the memory that there is for a job.
    ///
    /// # Errors
    ///
    /// Every fault of the scenario and of its character; [`InputError::Impossible`] with the figures of one that is too large.
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

    /// Whether jobs are taken and worked at, and store and files can be written.
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
        let proof = async {
            // One at a time, and not at the rate at which anybody may ask.
            let mut proven = self.shared.proven.lock().await;
            if proven.is_none_or(|at| at.elapsed() >= PROBE_EVERY) {
                *proven = None;
                self.shared.probe().await?;
                *proven = Some(Instant::now());
            }
            Ok(())
        };
        tokio::time::timeout(PROBE_TIMEOUT, proof).await.unwrap_or(Err(ServiceError::Silent(PROBE_TIMEOUT)))
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

    /// The run whose files are those of the job called `id`.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn run(&self, id: Uuid) -> Result<Run, ServiceError> {
        let number = match self.shared.files {
            JobFiles::Folder(_) => 0,
            JobFiles::Objects(_) => self.shared.store.run(id).await?,
        };
        Ok(Run { id, number })
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
        (cores / self.workers.max(1)).max(1)
    }

    /// Whether store and files can be written, by writing to both.
    ///
    /// # Errors
    ///
    /// When one of them cannot.
    pub(super) async fn probe(&self) -> Result<(), ServiceError> {
        self.store.probe().await?;
        Ok(self.files.probe().await?)
    }

    /// Says that something has happened to a job.
    pub(super) fn changed(&self, id: Uuid) {
        // An error says that nobody waits for it.
        let _ = self.changes.send(id);
    }
}

/// Keeps other processes out of the data folder.
fn lock(options: &ServiceOptions) -> io::Result<File> {
    let lock = File::create(options.data.join("lock"))?;
    lock.try_lock().map_err(|error| {
        let reason = format!("{} is in use: {error}", options.data.display());
        io::Error::new(io::ErrorKind::ResourceBusy, reason)
    })?;
    Ok(lock)
}

/// Does something to its end even if nobody waits for it any more: a client that hangs up must not leave it half done.
pub(super) async fn uninterrupted<T: Send + 'static>(
    work: impl Future<Output = Result<T, ServiceError>> + Send + 'static,
) -> Result<T, ServiceError> {
    tokio::spawn(work.in_current_span()).await?
}
