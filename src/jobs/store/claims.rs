//! Jobs as their workers hold them: taken up in turn, renewed, recorded, given back.

use std::time::Duration;

use sqlx::Row;
use sqlx::any::AnyRow;
use uuid::Uuid;

use super::curves;
use super::database::{Store, StoreError, Writing, document};
use super::news::Happened;
use super::records::{StoredJob, stored};
use crate::jobs::job::{Job, JobState};
use gaitwright_learning::learn::Generation;

/// Whose turn it is: of the callers who have jobs waiting, the one with the greatest priority; of these the one with the
/// fewest jobs running, then the one who was served longest ago, then the one whose job has waited longest. The
/// recursion steps along the index from one caller to the next, however many jobs each has there.
const TURNS: &str = "
    WITH RECURSIVE turns (turn) AS (
        SELECT min(turn) FROM jobs WHERE state = 'queued'
        UNION ALL
        SELECT (SELECT min(jobs.turn) FROM jobs WHERE jobs.state = 'queued' AND jobs.turn > turns.turn)
            FROM turns WHERE turns.turn IS NOT NULL
    )
    SELECT turns.turn FROM turns LEFT JOIN callers ON callers.caller = substr(turns.turn, 4)
    WHERE turns.turn IS NOT NULL
    ORDER BY
        substr(turns.turn, 1, 2),
        (SELECT count(*) FROM jobs WHERE jobs.state = 'running' AND jobs.caller = substr(turns.turn, 4)),
        coalesce(callers.served, 0),
        (SELECT min(jobs.id) FROM jobs WHERE jobs.state = 'queued' AND jobs.turn = turns.turn)";

/// Of the jobs in a turn, the one after `$2` that has waited longest and that nobody else is just taking.
const NEXT: &str = "
    SELECT id, record, fence FROM jobs WHERE state = 'queued' AND turn = $1 AND id > $2 ORDER BY id LIMIT 1 {free}";

/// A worker's hold on a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Claim {
    /// The job.
    pub id: Uuid,
    /// Number of the claim among those of the job; every later one is greater.
    fence: i64,
}

impl Claim {
    /// Its number.
    pub fn number(self) -> i64 {
        self.fence
    }
}

/// A job that was taken up.
#[derive(Debug, Clone, PartialEq)]
pub struct Claimed {
    /// The hold on it.
    pub claim: Claim,
    /// Its record.
    pub job: Job,
    /// Whether it was never taken before.
    pub first: bool,
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
    /// are passed over. Two who share a server and ask at the same moment may both serve the caller whose turn it is.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn claim(&self, worker: &str, lease: Duration) -> Result<Option<Claimed>, StoreError> {
        let mut writing = self.begin().await?;
        let Some((mut job, fence)) = next(&mut writing).await? else {
            writing.leave().await?;
            return Ok(None);
        };
        let first = job.timings.started.is_none();
        job.take_up();
        let query = self.dialect.query(
            "UPDATE jobs SET record = $1, fence = $2, worker = $3, lease_until = {now} + $4 WHERE id = $5",
        );
        let query = query.bind(document(&job)?).bind(fence).bind(worker).bind(milliseconds(lease));
        writing.execute(query.bind(job.id.to_string())).await?;
        let query = self.dialect.query(
            "INSERT INTO callers (caller, served) VALUES ($1, (SELECT coalesce(max(served), 0) + 1 FROM callers))
             ON CONFLICT (caller) DO UPDATE SET served = excluded.served",
        );
        writing.execute(query.bind(job.caller.as_str())).await?;
        writing.tell(job.id, Happened::Changed).await?;
        writing.commit().await?;
        Ok(Some(Claimed { claim: Claim { id: job.id, fence }, job, first }))
    }

    /// Prolongs a claim to `lease` from now.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn renew(&self, claim: Claim, lease: Duration) -> Result<Holding, StoreError> {
        let mut writing = self.begin().await?;
        let query = self.dialect.query(
            "UPDATE jobs SET lease_until = {now} + $1 WHERE id = $2 AND fence = $3 RETURNING unwanted",
        );
        let query = query.bind(milliseconds(lease)).bind(claim.id.to_string()).bind(claim.fence);
        let holding = holding(writing.row(query).await?)?;
        writing.commit().await?;
        Ok(holding)
    }

    /// Whether a claim holds, without prolonging it.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn holding(&self, claim: Claim) -> Result<Holding, StoreError> {
        let query = self.dialect.query("SELECT unwanted FROM jobs WHERE id = $1 AND fence = $2");
        holding(self.row(query.bind(claim.id.to_string()).bind(claim.fence)).await?)
    }

    /// Writes the record of a job that is worked at, and points of its curve with it; whether it is still the worker's,
    /// otherwise nothing has changed.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn record(&self, claim: Claim, job: &Job, curve: &[Generation]) -> Result<bool, StoreError> {
        self.write(claim, job, Written::More, curve).await
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
        self.write(claim, job, Written::Afresh, curve).await
    }

    /// As [`Store::record`], when the work proper begins: from now on the files of this claim are the job's, and those
    /// of earlier ones no longer.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn record_run(
        &self,
        claim: Claim,
        job: &Job,
        curve: &[Generation],
    ) -> Result<bool, StoreError> {
        self.write(claim, job, Written::Run, curve).await
    }

    async fn write(
        &self,
        claim: Claim,
        job: &Job,
        written: Written,
        curve: &[Generation],
    ) -> Result<bool, StoreError> {
        let mut writing = self.begin().await?;
        if held(&mut writing, claim).await?.is_none() {
            writing.leave().await?;
            return Ok(false);
        }
        let id = claim.id.to_string();
        let query = self.dialect.query(match written {
            Written::Run => "UPDATE jobs SET record = $1, run = fence WHERE id = $2",
            Written::More | Written::Afresh => "UPDATE jobs SET record = $1 WHERE id = $2",
        });
        writing.execute(query.bind(document(job)?).bind(id.as_str())).await?;
        if written == Written::Afresh {
            curves::forget(&mut writing, &id).await?;
        }
        // Nobody is told: commits that tell something are made one after the other, and these are the most by far.
        curves::extend(&mut writing, &id, curve).await?;
        writing.commit().await?;
        Ok(true)
    }

    /// The number of the claim whose files are those of the job called `id`; 0 before there is one.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn run(&self, id: Uuid) -> Result<i64, StoreError> {
        let query = self.dialect.query("SELECT run FROM jobs WHERE id = $1");
        let row = self.row(query.bind(id.to_string())).await?;
        Ok(row.map(|row| row.try_get("run")).transpose()?.unwrap_or(0))
    }

    /// Gives a job back that has ended, or waits again; one whose end was asked for is cancelled, however far it was.
    /// Whether it was still the worker's, otherwise nothing has changed.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn settle(&self, claim: Claim, job: &mut Job) -> Result<bool, StoreError> {
        let mut writing = self.begin().await?;
        let Some(unwanted) = held(&mut writing, claim).await? else {
            writing.leave().await?;
            return Ok(false);
        };
        if unwanted && job.state != JobState::Cancelled {
            job.call_off();
        }
        give_back(&mut writing, job, claim.fence).await?;
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
        const LAPSED: &str = "SELECT id, record, fence, unwanted FROM jobs
            WHERE state = 'running' AND coalesce(lease_until, 0) < {now}";
        const ALL: &str = "SELECT id, record, fence, unwanted FROM jobs WHERE state = 'running'";
        const LOCKED: &str = "SELECT id, record, fence, unwanted FROM jobs
            WHERE state = 'running' AND coalesce(lease_until, 0) < {now} {free}";
        let (look, take) = match which {
            Reclaimed::Lapsed => (LAPSED, LOCKED),
            Reclaimed::All => (ALL, ALL),
        };
        // Most of the time there is none, and looking needs no turn among those who write.
        if self.row(self.dialect.query(look)).await?.is_none() {
            return Ok(Vec::new());
        }
        let mut writing = self.begin().await?;
        let rows = writing.rows(self.dialect.query(take)).await?;
        let mut jobs = Vec::new();
        for row in &rows {
            let StoredJob::Readable(mut job) = stored(row)? else { continue };
            if unwanted(row)? {
                job.call_off();
            } else {
                job.lose(cause);
            }
            // The next number, so that the worker that still holds the present one is known to have lost the job.
            give_back(&mut writing, &job, fence(row)? + 1).await?;
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

/// What is written beside the record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Written {
    /// Further points of the curve.
    More,
    /// A curve in place of the one that there was.
    Afresh,
    /// Whose files are the job's.
    Run,
}

/// The job whose turn it is and the number of the next claim on it, within changes that take it up.
async fn next(writing: &mut Writing<'_>) -> Result<Option<(Job, i64)>, StoreError> {
    for turn in writing.rows(writing.dialect.query(TURNS)).await? {
        let turn: &str = turn.try_get("turn")?;
        let mut after = String::new();
        loop {
            let query = writing.dialect.query(NEXT).bind(turn).bind(after.as_str());
            let Some(row) = writing.row(query).await? else { break };
            match stored(&row)? {
                StoredJob::Readable(job) => return Ok(Some((*job, fence(&row)? + 1))),
                StoredJob::Unreadable { id, .. } => after = id.to_string(),
            }
        }
    }
    Ok(None)
}

/// How a worker holds the job in a row that was found by the claim.
fn holding(row: Option<AnyRow>) -> Result<Holding, StoreError> {
    Ok(match row {
        None => Holding::Lost,
        Some(row) if unwanted(&row)? => Holding::Unwanted,
        Some(_) => Holding::Held,
    })
}

/// Whether somebody has asked for the end of a claimed job; `None` if the claim no longer holds.
async fn held(writing: &mut Writing<'_>, claim: Claim) -> Result<Option<bool>, StoreError> {
    let query = writing.dialect.query("SELECT unwanted FROM jobs WHERE id = $1 AND fence = $2 {lock}");
    let row = writing.row(query.bind(claim.id.to_string()).bind(claim.fence)).await?;
    row.map(|row| unwanted(&row)).transpose()
}

/// Writes the record of a job that is no longer worked at.
async fn give_back(writing: &mut Writing<'_>, job: &Job, fence: i64) -> Result<(), StoreError> {
    let query = writing
        .dialect
        .query("UPDATE jobs SET record = $1, fence = $2, worker = NULL, lease_until = NULL WHERE id = $3");
    writing.execute(query.bind(document(job)?).bind(fence).bind(job.id.to_string())).await?;
    let happened = if job.state == JobState::Queued { Happened::Queued } else { Happened::Changed };
    writing.tell(job.id, happened).await
}

fn fence(row: &AnyRow) -> Result<i64, StoreError> {
    Ok(row.try_get("fence")?)
}

fn unwanted(row: &AnyRow) -> Result<bool, StoreError> {
    let unwanted: i64 = row.try_get("unwanted")?;
    Ok(unwanted != 0)
}

fn milliseconds(length: Duration) -> i64 {
    // The longest that may be added to any time of the clock.
    i64::try_from(length.as_millis()).unwrap_or(i64::MAX).min(i64::MAX / 2)
}
