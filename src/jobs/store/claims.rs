//! Jobs as their workers hold them: taken up in turn, renewed, recorded, given back.

use std::time::Duration;

use jiff::Timestamp;
use sqlx::Row;
use sqlx::sqlite::{SqliteConnection, SqliteRow};
use uuid::Uuid;

use super::connection::{Store, StoreError, document};
use super::curves;
use super::records::{StoredJob, stored};
use crate::jobs::job::{Job, JobState};
use gaitwright_learning::learn::Generation;

/// What is next: the greatest priority; of that the caller with the fewest jobs running, then the one who was
/// served longest ago; of that caller's jobs the one that has waited longest.
const NEXT: &str = "
    SELECT id, record, fence FROM jobs AS waiting
    LEFT JOIN callers ON callers.caller = waiting.caller
    WHERE state = 'queued'
    ORDER BY
        priority DESC,
        (SELECT count(*) FROM jobs AS running
            WHERE running.state = 'running' AND running.caller = waiting.caller),
        coalesce(callers.served, 0),
        id
    LIMIT 1 OFFSET ?";

/// A worker's hold on a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim {
    /// The job.
    pub id: Uuid,
    /// Number of the claim among those of the job; every later one is greater.
    fence: i64,
}

/// A job that was taken up.
#[derive(Debug, Clone, PartialEq)]
pub struct Claimed {
    /// The hold on it.
    pub claim: Claim,
    /// Its record.
    pub job: Job,
}

/// How a worker holds its job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holding {
    /// It is the worker's.
    Held,
    /// It is the worker's, and somebody has asked for its end.
    Unwanted,
    /// It is no longer the worker's: whatever the worker still does at it counts for nothing.
    Lost,
}

impl Store {
    /// Takes up the job whose turn it is, for `worker` and for as long as `lease`. Jobs whose records cannot be read
    /// are passed over.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn claim(&self, worker: &str, lease: Duration) -> Result<Option<Claimed>, StoreError> {
        let mut writing = self.begin().await?;
        let mut passed_over = 0_i64;
        let (mut job, fence) = loop {
            let row = sqlx::query(NEXT).bind(passed_over).fetch_optional(&mut writing.connection).await?;
            let Some(row) = row else {
                writing.leave().await?;
                return Ok(None);
            };
            match stored(&row)? {
                StoredJob::Readable(job) => break (*job, fence(&row)? + 1),
                StoredJob::Unreadable { .. } => passed_over += 1,
            }
        };
        job.take_up();
        sqlx::query("UPDATE jobs SET record = ?, fence = ?, worker = ?, lease_until = ? WHERE id = ?")
            .bind(document(&job)?)
            .bind(fence)
            .bind(worker)
            .bind(end_of(lease))
            .bind(job.id.to_string())
            .execute(&mut writing.connection)
            .await?;
        sqlx::query(
            "INSERT OR REPLACE INTO callers (caller, served)
             VALUES (?, (SELECT coalesce(max(served), 0) + 1 FROM callers))",
        )
        .bind(&job.caller)
        .execute(&mut writing.connection)
        .await?;
        writing.commit().await?;
        Ok(Some(Claimed { claim: Claim { id: job.id, fence }, job }))
    }

    /// Prolongs a claim to `lease` from now.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn renew(&self, claim: Claim, lease: Duration) -> Result<Holding, StoreError> {
        let mut writing = self.begin().await?;
        let row =
            sqlx::query("UPDATE jobs SET lease_until = ? WHERE id = ? AND fence = ? RETURNING unwanted")
                .bind(end_of(lease))
                .bind(claim.id.to_string())
                .bind(claim.fence)
                .fetch_optional(&mut writing.connection)
                .await?;
        let holding = match row {
            None => Holding::Lost,
            Some(row) if unwanted(&row)? => Holding::Unwanted,
            Some(_) => Holding::Held,
        };
        writing.commit().await?;
        Ok(holding)
    }

    /// Writes the record of a job that is worked at, and points of its curve with it; whether it is still the worker's,
    /// otherwise nothing has changed.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn record(&self, claim: Claim, job: &Job, curve: &[Generation]) -> Result<bool, StoreError> {
        self.write(claim, job, false, curve).await
    }

    /// The same with `curve` in place of the points that there were.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn record_afresh(
        &self,
        claim: Claim,
        job: &Job,
        curve: &[Generation],
    ) -> Result<bool, StoreError> {
        self.write(claim, job, true, curve).await
    }

    async fn write(
        &self,
        claim: Claim,
        job: &Job,
        afresh: bool,
        curve: &[Generation],
    ) -> Result<bool, StoreError> {
        let mut writing = self.begin().await?;
        if held(&mut writing.connection, claim).await?.is_none() {
            writing.leave().await?;
            return Ok(false);
        }
        let id = claim.id.to_string();
        sqlx::query("UPDATE jobs SET record = ? WHERE id = ?")
            .bind(document(job)?)
            .bind(&id)
            .execute(&mut writing.connection)
            .await?;
        if afresh {
            curves::forget(&mut writing.connection, &id).await?;
        }
        curves::extend(&mut writing.connection, &id, curve).await?;
        writing.commit().await?;
        Ok(true)
    }

    /// Gives a job back that has ended, or waits again; one whose end was asked for is cancelled, however far it was.
    /// Whether it was still the worker's, otherwise nothing has changed.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn settle(&self, claim: Claim, job: &mut Job) -> Result<bool, StoreError> {
        let mut writing = self.begin().await?;
        let Some(unwanted) = held(&mut writing.connection, claim).await? else {
            writing.leave().await?;
            return Ok(false);
        };
        if unwanted && job.state != JobState::Cancelled {
            job.call_off();
        }
        give_back(&mut writing.connection, job, claim.fence).await?;
        writing.commit().await?;
        Ok(true)
    }

    /// Takes the jobs from their workers whose leases are over, or all of them, for the given cause: they wait again,
    /// or have ended if that has happened too often. Gives them as they then are.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn reclaim(&self, which: Reclaimed, cause: &str) -> Result<Vec<Job>, StoreError> {
        let latest = match which {
            Reclaimed::Lapsed => Timestamp::now().as_millisecond(),
            Reclaimed::All => i64::MAX,
        };
        let query = "SELECT id, record, fence, unwanted FROM jobs WHERE state = 'running' AND coalesce(lease_until, 0) < ?";
        // Most of the time there is none, and looking needs no turn among those who write.
        if sqlx::query(query).bind(latest).fetch_optional(&self.readers).await?.is_none() {
            return Ok(Vec::new());
        }
        let mut writing = self.begin().await?;
        let rows = sqlx::query(query).bind(latest).fetch_all(&mut writing.connection).await?;
        let mut jobs = Vec::new();
        for row in &rows {
            let StoredJob::Readable(mut job) = stored(row)? else { continue };
            if unwanted(row)? {
                job.call_off();
            } else {
                job.lose(cause);
            }
            // The next number, so that the worker that still holds the present one is known to have lost the job.
            give_back(&mut writing.connection, &job, fence(row)? + 1).await?;
            jobs.push(*job);
        }
        writing.commit().await?;
        Ok(jobs)
    }
}

/// Which jobs are taken from their workers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reclaimed {
    /// Those whose leases are over.
    Lapsed,
    /// All: whoever worked at them is known to be gone.
    All,
}

/// Whether somebody has asked for the end of a claimed job; `None` if the claim no longer holds.
async fn held(connection: &mut SqliteConnection, claim: Claim) -> Result<Option<bool>, StoreError> {
    let row = sqlx::query("SELECT unwanted FROM jobs WHERE id = ? AND fence = ?")
        .bind(claim.id.to_string())
        .bind(claim.fence)
        .fetch_optional(connection)
        .await?;
    row.map(|row| unwanted(&row)).transpose()
}

/// Writes the record of a job that is no longer worked at.
async fn give_back(connection: &mut SqliteConnection, job: &Job, fence: i64) -> Result<(), StoreError> {
    sqlx::query("UPDATE jobs SET record = ?, fence = ?, worker = NULL, lease_until = NULL WHERE id = ?")
        .bind(document(job)?)
        .bind(fence)
        .bind(job.id.to_string())
        .execute(connection)
        .await?;
    Ok(())
}

fn fence(row: &SqliteRow) -> Result<i64, StoreError> {
    Ok(row.try_get("fence")?)
}

fn unwanted(row: &SqliteRow) -> Result<bool, StoreError> {
    let unwanted: i64 = row.try_get("unwanted")?;
    Ok(unwanted != 0)
}

/// The end of a lease that begins now, ms since 1970.
fn end_of(lease: Duration) -> i64 {
    let length = i64::try_from(lease.as_millis()).unwrap_or(i64::MAX);
    Timestamp::now().as_millisecond().saturating_add(length)
}
