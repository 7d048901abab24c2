//! The keeper of the workers: renews the leases of those that show signs of life, and replaces those that do not.

use std::io;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use futures_util::future::join_all;
use tokio::runtime::Handle;

use super::figures::{self, FailureCause};
use super::lease;
use super::live::Live;
use super::service::Shared;
use super::store::Reclaimed;
use super::worker;

/// Longest time between two renewals of a lease, and between two looks at those of others.
const LONGEST_INTERVAL: Duration = Duration::from_secs(5);

/// Time after which it is looked whether somebody elsewhere has asked for the end of a job, if that has not been heard.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Shortest time between two looks at the workers.
const SHORTEST_INTERVAL: Duration = Duration::from_millis(20);

/// Starts the workers and looks after them until the service shuts down. They end then too.
///
/// # Errors
///
/// When a thread cannot be started.
pub(super) fn start(shared: &Arc<Shared>, runtime: &Handle) -> io::Result<()> {
    let keeper = Keeper { shared: Arc::clone(shared), runtime: runtime.clone() };
    keeper.fill()?;
    runtime.spawn(async move { keeper.keep().await });
    Ok(())
}

struct Keeper {
    shared: Arc<Shared>,
    runtime: Handle,
}

impl Keeper {
    async fn keep(&self) {
        let every = (self.shared.lease / 4).clamp(SHORTEST_INTERVAL, LONGEST_INTERVAL);
        let tick = if self.shared.store.is_shared() { every.min(LOOK_EVERY) } else { every };
        let mut last = Instant::now();
        while tokio::time::timeout(tick, self.shared.shutdown.cancelled()).await.is_err() {
            let due = last.elapsed() + tick / 2 >= every;
            self.look_after_leases(due).await;
            if !due {
                continue;
            }
            last = Instant::now();
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

    /// Renews the leases of the jobs whose workers have shown signs of life since the last time, where it is `due`.
    /// Otherwise looks whether they are wanted, and, where others may take them, has a worker stop whose lease is over:
    /// it cannot know that nobody has. A worker that does not stop within another lease is done without.
    async fn look_after_leases(&self, due: bool) {
        let shared = &self.shared;
        let looks = shared.running.all().into_iter().map(|live| async move {
            if live.is_lost() {
                if live.since_renewed() >= 2 * shared.lease {
                    self.give_up(&live);
                }
                return;
            }
            let left = shared.lease.saturating_sub(live.since_renewed());
            let looked = async {
                if !due {
                    lease::look(&shared.store, &live).await;
                } else if live.cancel().take_looked() {
                    lease::renew(&shared.store, &live, shared.lease).await;
                }
            };
            if !shared.store.is_shared() {
                looked.await;
            } else if tokio::time::timeout(left, looked).await.is_err() || live.since_renewed() >= shared.lease {
                tracing::error!(job_id = %live.claim().id, "its lease is over: the store cannot be reached, or the worker shows no sign of life");
                live.lose();
            }
        });
        join_all(looks).await;
    }

    /// Takes jobs from workers whose leases are over.
    async fn reclaim(&self) {
        let seconds = self.shared.lease.as_secs_f64();
        let cause = format!("its worker showed no sign of life for {seconds} s");
        // Whoever takes one of these jobs up again in the meantime is not the one that has lost it.
        let held = self.shared.running.all();
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
            if let Some(live) = held.iter().find(|live| live.claim().id == job.id) {
                self.give_up(live);
            }
            self.shared.posted.notify_one();
            self.shared.changed(job.id);
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
