//! Running jobs as others see them: their curves as they grow, and the way to stop them.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::watch;
use uuid::Uuid;

use super::store::Claim;
use gaitwright_learning::learn::{Cancel, Generation};

/// How far a running job is; what changes whenever there is something new to see.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Moment {
    /// The job no longer runs, and its record shows it.
    pub over: bool,
}

/// What a running job has so far of results that no file holds yet, by the names of the files: the best motion before one is finished,
/// the report, and the list of motions.
pub type OnTheWay = BTreeMap<&'static str, Vec<u8>>;

/// A running job, shared by its worker and whoever watches it.
#[derive(Debug)]
pub struct Live {
    claim: Claim,
    cancel: Cancel,
    /// Candidates that were tried before the job was taken up.
    tried_before: u64,
    /// Somebody asked for the end of the job, rather than for the end of the service.
    unwanted: AtomicBool,
    /// The claim no longer holds.
    lost: AtomicBool,
    /// From when on the claim is known to hold for the length of a lease.
    renewed: Mutex<Instant>,
    /// Set by the first of two: its worker, which has left the job, or its keeper, which has given up the worker.
    parted: AtomicBool,
    curve: Mutex<Vec<Generation>>,
    on_the_way: Mutex<OnTheWay>,
    moment: watch::Sender<Moment>,
}

impl Live {
    /// A job that has been taken up, of which `tried_before` candidates have been tried before; its lease has not begun
    /// before `since`.
    pub fn new(claim: Claim, tried_before: u64, since: Instant) -> Self {
        Self {
            claim,
            tried_before,
            renewed: Mutex::new(since),
            cancel: Cancel::default(),
            unwanted: AtomicBool::new(false),
            lost: AtomicBool::new(false),
            parted: AtomicBool::new(false),
            curve: Mutex::default(),
            on_the_way: Mutex::default(),
            moment: watch::Sender::default(),
        }
    }

    /// Its worker's hold on it.
    pub fn claim(&self) -> Claim {
        self.claim
    }

    /// The flag its learner polls.
    pub fn cancel(&self) -> &Cancel {
        &self.cancel
    }

    /// Candidates tried so far.
    pub fn tried(&self) -> u64 {
        self.tried_before + self.cancel.tried()
    }

    /// Stops the job for good.
    pub fn abandon(&self) {
        self.unwanted.store(true, Ordering::Relaxed);
        self.cancel.cancel();
    }

    /// Whether the job was stopped for good.
    pub fn is_abandoned(&self) -> bool {
        self.unwanted.load(Ordering::Relaxed)
    }

    /// Stops the worker because the job is no longer its own.
    pub fn lose(&self) {
        self.lost.store(true, Ordering::Relaxed);
        self.cancel.cancel();
    }

    /// Whether the job is no longer its worker's own.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// Takes note that its lease has been renewed, not before `since`.
    pub fn renew(&self, since: Instant) {
        *self.renewed.lock().unwrap_or_else(PoisonError::into_inner) = since;
    }

    /// How long ago its lease was renewed, at most.
    pub fn since_renewed(&self) -> Duration {
        self.renewed.lock().unwrap_or_else(PoisonError::into_inner).elapsed()
    }

    /// Shows that its worker is there although the learner does not run.
    pub fn show_life(&self) {
        self.cancel.is_cancelled();
    }

    /// Ends the bond between the job and its worker, from either side; whether it was this call that did.
    pub fn part(&self) -> bool {
        !self.parted.swap(true, Ordering::AcqRel)
    }

    /// Starts from the curve of an earlier run of the same job.
    pub fn preload(&self, curve: Vec<Generation>) {
        *self.curve() = curve;
        // Whoever watches looks at the curve anew.
        self.moment.send_modify(|_| {});
    }

    /// Adds a point to the curve.
    pub fn push(&self, figures: Generation) {
        self.curve().push(figures);
        self.moment.send_modify(|_| {});
    }

    /// Shows these files in place of those before; they are kept in memory alone.
    pub fn show(&self, files: OnTheWay) {
        *self.on_the_way.lock().unwrap_or_else(PoisonError::into_inner) = files;
    }

    /// The file called `name` of what is shown.
    pub fn shown(&self, name: &str) -> Option<Vec<u8>> {
        self.on_the_way.lock().unwrap_or_else(PoisonError::into_inner).get(name).cloned()
    }

    /// Marks the job as over.
    pub fn finish(&self) {
        self.moment.send_modify(|moment| moment.over = true);
    }

    /// The curve from generation `first` on.
    pub fn curve_from(&self, first: u32) -> Vec<Generation> {
        let curve = self.curve();
        curve[curve.partition_point(|figures| figures.generation < first)..].to_vec()
    }

    /// A watch on what happens next.
    pub fn watch(&self) -> watch::Receiver<Moment> {
        self.moment.subscribe()
    }

    fn curve(&self) -> MutexGuard<'_, Vec<Generation>> {
        // A push cannot leave the curve half-made, so it is whole even if a holder panicked.
        self.curve.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The jobs that run in this process, by id.
#[derive(Debug, Default)]
pub struct Running(Mutex<BTreeMap<Uuid, Arc<Live>>>);

impl Running {
    /// Adds a job that has been taken up.
    pub fn add(&self, live: &Arc<Live>) {
        self.jobs().insert(live.claim.id, Arc::clone(live));
    }

    /// The job called `id`.
    pub fn get(&self, id: Uuid) -> Option<Arc<Live>> {
        self.jobs().get(&id).cloned()
    }

    /// All of them.
    pub fn all(&self) -> Vec<Arc<Live>> {
        self.jobs().values().cloned().collect()
    }

    /// Removes a job, unless it has been taken up again.
    pub fn remove(&self, live: &Arc<Live>) {
        let mut jobs = self.jobs();
        if jobs.get(&live.claim.id).is_some_and(|known| Arc::ptr_eq(known, live)) {
            jobs.remove(&live.claim.id);
        }
    }

    fn jobs(&self) -> MutexGuard<'_, BTreeMap<Uuid, Arc<Live>>> {
        // Whole after every change, even if a holder panicked.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
