//! The keeper of the workers: renews the leases of those that show signs of life, and replaces those that do not.

use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use tokio::runtime::Handle;

use super::figures::{self, FailureCause};
use super::housekeeping::keep_house;
use super::live::Live;
use super::service::{Jobs, Shared};
use super::store::{Holding, Reclaimed};
use super::worker;

/// Longest time between two looks at the workers: a job that is cancelled on another machine ends after as long.
const LONGEST_INTERVAL: Duration = Duration::from_secs(5);

/// Shortest time between two looks at the workers.
const SHORTEST_INTERVAL: Duration = Duration::from_millis(20);

/// Starts the workers of `jobs`, looks after them and keeps house until the service shuts down. The workers end then too.
///
/// # Errors
///
/// When a thread cannot be started.
pub fn start(jobs: &Jobs, runtime: &Handle) -> io::Result<()> {
    let keeper = Keeper { shared: Arc::clone(jobs.shared()), runtime: runtime.clone() };
    keeper.fill()?;
    runtime.spawn(async move { keeper.keep().await });
    runtime.spawn(keep_house(jobs.clone()));
    Ok(())
}

struct Keeper {
    shared: Arc<Shared>,
    runtime: Handle,
}

impl Keeper {
    async fn keep(&self) {
        let every = (self.shared.lease / 4).clamp(SHORTEST_INTERVAL, LONGEST_INTERVAL);
        while tokio::time::timeout(every, self.shared.shutdown.cancelled()).await.is_err() {
            self.renew().await;
            self.reclaim().await;
            if let Err(error) = self.fill() {
                tracing::error!(%error, "a worker could not be replaced");
            }
        }
    }

    /// Starts as many workers as are missing.
    fn fill(&self) -> io::Result<()> {
        while self.shared.alive.load(Ordering::Relaxed) < self.shared.workers {
            worker::spawn(&self.shared, &self.runtime)?;
        }
        Ok(())
    }

    /// Renews the leases of the jobs whose workers have shown signs of life since the last look.
    async fn renew(&self) {
        for live in self.shared.running.all().iter().filter(|live| live.cancel().take_looked()) {
            match self.shared.store.renew(live.claim(), self.shared.lease).await {
                Ok(Holding::Held) => {}
                Ok(Holding::Unwanted) => live.abandon(),
                Ok(Holding::Lost) => live.lose(),
                // It is tried again at the next look, long before the lease is over.
                Err(error) => tracing::error!(%error, "a lease could not be renewed"),
            }
        }
    }

    /// Takes jobs from workers whose leases are over.
    async fn reclaim(&self) {
        let seconds = self.shared.lease.as_secs_f64();
        let cause = format!("its worker showed no sign of life for {seconds} s");
        let jobs = match self.shared.store.reclaim(Reclaimed::Lapsed, &cause).await {
            Ok(jobs) => jobs,
            Err(error) => {
                tracing::error!(%error, "leases that are over could not be looked for");
                return;
            }
        };
        for job in jobs {
            if job.state.is_final() {
                figures::ended(&job, FailureCause::Interrupted);
            }
            tracing::error!(job_id = %job.id, attempts = job.attempts, state = job.state.name(), cause);
            if let Some(live) = self.shared.running.get(job.id) {
                self.give_up(&live);
            }
            self.shared.posted.notify_one();
            self.shared.changes.send_replace(());
        }
    }

    /// Does without the worker of a job that has been taken from it.
    fn give_up(&self, live: &Arc<Live>) {
        live.lose();
        if live.part() {
            self.shared.alive.fetch_sub(1, Ordering::Relaxed);
        }
        self.shared.running.remove(live);
        live.finish();
    }
}
