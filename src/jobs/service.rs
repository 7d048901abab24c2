//! The service's core: what clients may ask of the jobs, whoever carries the question.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use tokio::sync::{Mutex, Notify, Semaphore, watch};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::check::{Findings, check_until};
use super::files::{self, Artefact, Shelf};
use super::job::{CharacterName, Job, JobState};
use super::live::Live;
use super::once::IdempotencyKey;
use super::order::{Order, read_character};
use super::repertoire::Repertoire;
use super::request::{CharacterChoice, Settings};
use super::store::{Store, StoreError};
use super::study::StudyRequest;
use crate::export::{ExportFormat, ExportOptions, export};
use gaitwright_learning::learn::Generation;
use gaitwright_physics::character::{Options, Source};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::Motion;
use gaitwright_physics::scene::Scene;

/// How long a short computation may wait for its turn.
const TURN_TIMEOUT: Duration = Duration::from_secs(5);

/// How long it is taken for granted that the data folder can be written, once it could.
const PROBE_EVERY: Duration = Duration::from_millis(500);

/// Bytes written to see whether files can be: as many as the recording of a short job has.
const PROBE_SIZE: usize = 1 << 20;

/// Why a question could not be answered.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// The input cannot be used.
    #[error(transparent)]
    Input(#[from] InputError),
    /// There is no job of this id.
    #[error("there is no job {0}")]
    UnknownJob(Uuid),
    /// There is no character of this id.
    #[error("there is no character {0}")]
    UnknownCharacter(Uuid),
    /// The job is not in a state for what was asked.
    #[error("the job {id} is {}; {needs}", state.name())]
    WrongState {
        /// The job.
        id: Uuid,
        /// Where it stands.
        state: JobState,
        /// Which jobs it can be asked of.
        needs: &'static str,
    },
    /// The key of the request has come before with another request.
    #[error("the idempotency key has been used for another request")]
    KeyReused,
    /// As many jobs wait as may wait.
    #[error("{0} jobs are waiting already")]
    Full(u64),
    /// As much is computed as may be at once.
    #[error("as much is being computed as may be at once")]
    Busy,
    /// Nobody waits for the answer any more.
    #[error("the answer was given up")]
    GivenUp,
    /// The service is about to end.
    #[error("the service is shutting down")]
    ShuttingDown,
    /// Workers have ended although the service has not.
    #[error("{alive} of {workers} workers are left")]
    Unmanned {
        /// Workers that are left.
        alive: usize,
        /// Workers that there should be.
        workers: usize,
    },
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A file could not be read or written.
    #[error("a file failed: {0}")]
    File(#[from] io::Error),
    /// Computing the answer broke off.
    #[error("computing the answer broke off: {0}")]
    Broken(#[from] tokio::task::JoinError),
}

/// How a service is set up.
#[derive(Debug, Clone)]
pub struct ServiceOptions {
    /// Folder of the store and of the jobs' files.
    pub data: PathBuf,
    /// Jobs worked at side by side.
    pub workers: usize,
    /// Jobs that may wait.
    pub queue: u64,
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
    /// How often a job has been put back because a file failed, by job.
    pub(super) setbacks: Mutex<BTreeMap<Uuid, u32>>,
    /// Workers that have begun and not ended.
    pub(super) alive: AtomicUsize,
    pub(super) store: Store,
    queue: u64,
    /// Held by whoever moves a job from one state to another, so that no two do at once.
    pub(super) running: Mutex<BTreeMap<Uuid, Arc<Live>>>,
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
        for mut job in store.jobs(Some(JobState::Running), None, u32::MAX).await? {
            if store.is_abandoned(job.id).await? {
                job.end(JobState::Cancelled);
            } else {
                job.state = JobState::Queued;
                job.stage = None;
            }
            store.update(&job, &[]).await?;
        }
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let shared = Shared {
            data: options.data,
            workers: options.workers.max(1),
            proven: Mutex::default(),
            setbacks: Mutex::default(),
            alive: AtomicUsize::new(0),
            store,
            queue: options.queue,
            running: Mutex::default(),
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
        let (alive, workers) = (self.shared.alive.load(Ordering::Relaxed), self.shared.workers);
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

    /// The job that was posted under `key` before, where there is one.
    ///
    /// # Errors
    ///
    /// [`ServiceError::KeyReused`] when it was another request.
    pub async fn posted(&self, key: &IdempotencyKey) -> Result<Option<Job>, ServiceError> {
        match self.shared.store.posted(key).await? {
            Some((_, false)) => Err(ServiceError::KeyReused),
            Some((job, true)) => Ok(Some(job)),
            None => Ok(None),
        }
    }

    /// Queues a job; with a key that has come before, it gives the job of that time.
    ///
    /// # Errors
    ///
    /// [`ServiceError::Input`] with every fault of the character and of what is wanted of it;
    /// [`ServiceError::KeyReused`]; [`ServiceError::Full`]; [`ServiceError::ShuttingDown`].
    pub async fn submit(
        &self,
        character: CharacterChoice,
        settings: Settings,
        key: Option<IdempotencyKey>,
    ) -> Result<Job, ServiceError> {
        let (bytes, source, place) = match character {
            CharacterChoice::Urdf(text) => (text.into_bytes(), Some(Source::Urdf), "/character/urdf"),
            CharacterChoice::Json(fields) => {
                let bytes = serde_json::to_vec(&fields).map_err(StoreError::Document)?;
                (bytes, Some(Source::Json), "/character/json")
            }
            CharacterChoice::Id(id) => {
                let bytes = self.shared.store.character(id).await?.ok_or_else(|| {
                    InputError::impossible("/character/id", format!("there is no character {id}"))
                })?;
                (bytes, None, "")
            }
        };
        self.submit_bytes(bytes, source, place, settings, key).await
    }

    /// Queues a job for the character in `bytes`; faults of a character document are named from
    /// `place` on.
    ///
    /// # Errors
    ///
    /// As [`Jobs::submit`].
    pub async fn submit_bytes(
        &self,
        bytes: Vec<u8>,
        source: Option<Source>,
        place: &'static str,
        settings: Settings,
        key: Option<IdempotencyKey>,
    ) -> Result<Job, ServiceError> {
        self.check_not_shutting_down()?;
        let bytes = Arc::new(bytes);
        let name = {
            let (bytes, settings) = (Arc::clone(&bytes), settings.clone());
            self.compute(move |_| {
                let order = Order::read(&bytes, source, place, settings)?;
                let character = &order.reading.character;
                Ok(CharacterName { name: character.name.clone(), digest: character.digest.clone() })
            })
            .await?
        };
        self.queue(Job::queued(name, settings), bytes, key).await
    }

    /// Queues a study of what accuracy costs.
    ///
    /// # Errors
    ///
    /// [`ServiceError::Input`] with every fault of the request; [`ServiceError::Full`];
    /// [`ServiceError::ShuttingDown`].
    pub async fn submit_study(&self, bytes: Vec<u8>) -> Result<Job, ServiceError> {
        self.check_not_shutting_down()?;
        let bytes = Arc::new(bytes);
        let (name, request) = {
            let bytes = Arc::clone(&bytes);
            self.compute(move |_| {
                let (request, setup) = StudyRequest::parse(&bytes)?;
                let character = &setup.model.character;
                let name = CharacterName { name: character.name.clone(), digest: character.digest.clone() };
                Ok((name, request))
            })
            .await?
        };
        self.queue(Job::queued(name, request), bytes, None).await
    }

    /// Puts a job that works on `input` into the queue.
    async fn queue(
        &self,
        job: Job,
        input: Arc<Vec<u8>>,
        key: Option<IdempotencyKey>,
    ) -> Result<Job, ServiceError> {
        let jobs = self.clone();
        uninterrupted(async move {
            let _turn = jobs.shared.running.lock().await;
            // The same request may have come twice at once.
            if let Some(key) = &key
                && let Some(job) = jobs.posted(key).await?
            {
                return Ok(job);
            }
            jobs.check_queue().await?;
            jobs.shared.store.insert(&job, &input, key.as_ref()).await?;
            jobs.shared.posted.notify_one();
            metrics::counter!("gaitwright_jobs_posted_total").increment(1);
            Ok(job)
        })
        .await
    }

    async fn check_queue(&self) -> Result<(), ServiceError> {
        let waiting = self.shared.store.count(JobState::Queued).await?;
        if waiting >= self.shared.queue { Err(ServiceError::Full(waiting)) } else { Ok(()) }
    }

    /// The job called `id`.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`].
    pub async fn job(&self, id: Uuid) -> Result<Job, ServiceError> {
        self.shared.store.job(id).await?.ok_or_else(|| ServiceError::UnknownJob(id))
    }

    /// At most `limit` jobs, the newest first: those older than `after`, in the given state.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn list(
        &self,
        state: Option<JobState>,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<Job>, ServiceError> {
        Ok(self.shared.store.jobs(state, after, limit).await?)
    }

    /// Number of jobs in a state.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn count(&self, state: JobState) -> Result<u64, ServiceError> {
        Ok(self.shared.store.count(state).await?)
    }

    /// Cancels a job that waits or runs, and gives it as it then is; the same again changes nothing. A running job
    /// ends within a second of this, and is not taken up again even if the process ends first.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::WrongState`] when it has ended otherwise.
    pub async fn cancel(&self, id: Uuid) -> Result<Job, ServiceError> {
        let jobs = self.clone();
        uninterrupted(async move {
            let running = jobs.shared.running.lock().await;
            let mut job = jobs.job(id).await?;
            match job.state {
                JobState::Queued => {
                    job.end(JobState::Cancelled);
                    jobs.shared.store.update(&job, &[]).await?;
                    jobs.shared.changes.send_replace(());
                }
                JobState::Running => {
                    jobs.shared.store.abandon(id).await?;
                    if let Some(live) = running.get(&id) {
                        live.abandon();
                    }
                }
                JobState::Cancelled => {}
                state @ (JobState::Succeeded | JobState::Failed) => {
                    let needs = "only a job that waits or runs can be cancelled";
                    return Err(ServiceError::WrongState { id, state, needs });
                }
            }
            Ok(job)
        })
        .await
    }

    /// Queues a failed or cancelled job again; it goes on from its last checkpoint.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::WrongState`] when it has neither failed nor been cancelled;
    /// [`ServiceError::Full`]; [`ServiceError::ShuttingDown`].
    pub async fn retry(&self, id: Uuid) -> Result<Job, ServiceError> {
        self.check_not_shutting_down()?;
        let jobs = self.clone();
        uninterrupted(async move {
            let _turn = jobs.shared.running.lock().await;
            let mut job = jobs.job(id).await?;
            if !matches!(job.state, JobState::Failed | JobState::Cancelled) {
                let needs = "only a job that failed or was cancelled can be tried again";
                return Err(ServiceError::WrongState { id, state: job.state, needs });
            }
            jobs.check_queue().await?;
            job.reopen();
            jobs.shared.store.requeue(&job).await?;
            jobs.shared.posted.notify_one();
            jobs.shared.changes.send_replace(());
            Ok(job)
        })
        .await
    }

    /// Deletes a job that has ended, with its files.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::WrongState`] unless it has ended.
    pub async fn delete(&self, id: Uuid) -> Result<(), ServiceError> {
        let jobs = self.clone();
        uninterrupted(async move {
            let _turn = jobs.shared.running.lock().await;
            let state = jobs.job(id).await?.state;
            if !state.is_final() {
                let needs = "only a job that has ended can be deleted; cancel it first";
                return Err(ServiceError::WrongState { id, state, needs });
            }
            jobs.shared.store.delete(id).await?;
            match std::fs::remove_dir_all(jobs.folder(id)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error.into()),
                _ => Ok(()),
            }
        })
        .await
    }

    /// A job's learning curve so far.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn curve(&self, id: Uuid) -> Result<Vec<Generation>, ServiceError> {
        match self.live(id).await {
            Some(live) => Ok(live.curve_from(0)),
            None => Ok(self.shared.store.curve(id).await?),
        }
    }

    /// The job called `id` as it runs, when it does.
    pub async fn live(&self, id: Uuid) -> Option<Arc<Live>> {
        self.shared.running.lock().await.get(&id).cloned()
    }

    /// Where an artefact of the job called `id` lies, whether or not it is there yet.
    pub fn artefact(&self, id: Uuid, artefact: Artefact) -> PathBuf {
        artefact.path(&self.folder(id))
    }

    /// Where a file with this name of the job called `id` lies on a shelf, whether or not it is there.
    pub fn shelved(&self, id: Uuid, shelf: Shelf, name: &str) -> PathBuf {
        shelf.path(&self.folder(id), name)
    }

    /// The motions that the job called `id` has learned; `None` when there are none (yet).
    ///
    /// # Errors
    ///
    /// When the file that is there cannot be read.
    pub async fn repertoire(&self, id: Uuid) -> Result<Option<Repertoire>, ServiceError> {
        match tokio::fs::read(self.artefact(id, Artefact::Motions)).await {
            Ok(bytes) => Ok(Some(serde_json::from_slice(&bytes).map_err(io::Error::from)?)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// The motion document at `path`, of the job called `id`, in a format that other programs open; `None` when there
    /// is none (yet).
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::Input`] when the format cannot hold what is asked for.
    pub async fn exported(
        &self,
        id: Uuid,
        path: PathBuf,
        format: ExportFormat,
        options: ExportOptions,
    ) -> Result<Option<Vec<u8>>, ServiceError> {
        let motion = match tokio::fs::read(path).await {
            Ok(motion) => motion,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let character = self.shared.store.job_input(id).await?;
        self.compute(move |_| {
            let motion = Motion::parse(&motion)?;
            let reading = read_character(&character, None, Options::default())?;
            Ok(Some(export(&motion, &reading.character, format, &options)?))
        })
        .await
    }

    /// Keeps a character for later jobs, and gives its id and what was found in it.
    ///
    /// # Errors
    ///
    /// [`ServiceError::Input`] with every fault of the character.
    pub async fn add_character(
        &self,
        bytes: Vec<u8>,
        source: Option<Source>,
    ) -> Result<(Uuid, Findings), ServiceError> {
        self.check_not_shutting_down()?;
        let bytes = Arc::new(bytes);
        let findings = {
            let bytes = Arc::clone(&bytes);
            self.compute(move |given_up| {
                let reading = read_character(&bytes, source, Options::default())?;
                let findings = check_until(&reading, &Scene::default(), given_up);
                if given_up() { Err(ServiceError::GivenUp) } else { Ok(findings) }
            })
            .await?
        };
        let id = self.shared.store.keep_character(&findings, &bytes).await?;
        Ok((id, findings))
    }

    /// What was found in the character called `id`.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownCharacter`].
    pub async fn findings(&self, id: Uuid) -> Result<Findings, ServiceError> {
        self.shared.store.findings(id).await?.ok_or_else(|| ServiceError::UnknownCharacter(id))
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

    fn folder(&self, id: Uuid) -> PathBuf {
        files::folder(&self.shared.data, id)
    }

    fn check_not_shutting_down(&self) -> Result<(), ServiceError> {
        if self.shared.shutdown.is_cancelled() { Err(ServiceError::ShuttingDown) } else { Ok(()) }
    }
}

impl Shared {
    /// Whether store and files can be written, by writing to both.
    ///
    /// # Errors
    ///
    /// When one of them cannot.
    pub(super) async fn probe(&self) -> Result<(), ServiceError> {
        self.store.probe().await?;
        let folder = self.data.join("jobs");
        tokio::task::spawn_blocking(move || {
            // Removed when it is dropped.
            let mut file = tempfile::Builder::new().prefix(".probe").tempfile_in(folder)?;
            file.write_all(&vec![0; PROBE_SIZE])?;
            file.as_file().sync_all()
        })
        .await??;
        Ok(())
    }
}

/// Does something to its end even if nobody waits for it any more: a client that hangs up must not leave it half done.
async fn uninterrupted<T: Send + 'static>(
    work: impl Future<Output = Result<T, ServiceError>> + Send + 'static,
) -> Result<T, ServiceError> {
    tokio::spawn(work).await?
}
