//! Jobs as their clients see them: posted, shown, changed, deleted.

use std::collections::BTreeSet;

use sqlx::Row;
use sqlx::any::AnyRow;
use uuid::Uuid;

use super::database::{Store, StoreError, Writing, document, id};
use super::dialect::{Dialect, Query};
use super::news::Happened;
use crate::jobs::job::{Job, JobState};
use crate::jobs::once::IdempotencyKey;
use crate::jobs::request::FORMAT;

/// A job in the database.
#[derive(Debug, Clone, PartialEq)]
pub enum StoredJob {
    /// One that this version can read.
    Readable(Box<Job>),
    /// One whose record is damaged or of a newer version. It is left alone.
    Unreadable {
        /// The job.
        id: Uuid,
        /// What is wrong with its record.
        reason: String,
    },
}

impl StoredJob {
    /// The job.
    pub fn id(&self) -> Uuid {
        match self {
            Self::Readable(job) => job.id,
            Self::Unreadable { id, .. } => *id,
        }
    }
}

/// What is done to a job that was looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Amendment {
    /// It stays as it is.
    Nothing,
    /// Its record is written.
    Record,
    /// Its record is written, and that its end was asked for is forgotten: it waits again, where there is room.
    Requeue(QueueRoom),
    /// It is kept in mind that its end was asked for. The record of a job that runs is its worker's alone to write.
    Abandon,
}

/// How many jobs may wait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QueueRoom {
    /// Of everybody.
    pub all: u64,
    /// Of one caller.
    pub caller: u64,
}

impl QueueRoom {
    /// Whether another job of `caller` may wait, within changes that add it and that are alone with the queue.
    async fn check(self, writing: &mut Writing<'_>, caller: &str) -> Result<(), StoreError> {
        let waiting = count(writing.row(counting(writing.dialect, JobState::Queued, None)).await?)?;
        if waiting >= self.all {
            return Err(StoreError::Full(waiting));
        }
        let own = count(writing.row(counting(writing.dialect, JobState::Queued, Some(caller))).await?)?;
        if own >= self.caller { Err(StoreError::FullForCaller(own)) } else { Ok(()) }
    }
}

impl Store {
    /// Adds a job that waits, the bytes of what it works on, and the key that it was posted under. Gives what
    /// [`Store::posted`] gives where there is a job of that key already, and then nothing has changed.
    ///
    /// # Errors
    ///
    /// [`StoreError::Full`] and [`StoreError::FullForCaller`] where there is no room; when the database refuses.
    pub async fn post(
        &self,
        job: &Job,
        input: &[u8],
        key: Option<&IdempotencyKey>,
        room: QueueRoom,
    ) -> Result<Option<(Job, bool)>, StoreError> {
        let mut writing = self.begin().await?;
        // The same request may have come twice at once.
        writing.queue_alone().await?;
        if let Some(key) = key
            && let Some(row) = writing.row(posted_under(self.dialect, key)).await?
        {
            writing.leave().await?;
            return known_job(&row, key).map(Some);
        }
        if let Err(full) = room.check(&mut writing, &job.caller).await {
            writing.leave().await?;
            return Err(full);
        }
        let query = self
            .dialect
            .query("INSERT INTO jobs (id, record, input, key, request) VALUES ($1, $2, $3, $4, $5)");
        let query = query.bind(job.id.to_string()).bind(document(job)?).bind(input);
        let query = query.bind(key.map(|key| key.key.as_str())).bind(key.map(|key| key.digest.as_str()));
        writing.execute(query).await?;
        writing.tell(job.id, Happened::Queued).await?;
        writing.commit().await?;
        Ok(None)
    }

    /// The job that was posted under `key`, and whether it was the same request.
    ///
    /// # Errors
    ///
    /// When the database refuses, or the job's record cannot be read.
    pub async fn posted(&self, key: &IdempotencyKey) -> Result<Option<(Job, bool)>, StoreError> {
        let row = self.row(posted_under(self.dialect, key)).await?;
        row.map(|row| known_job(&row, key)).transpose()
    }

    /// The job called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses, or the job's record cannot be read.
    pub async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError> {
        let query = self.dialect.query("SELECT id, record FROM jobs WHERE id = $1");
        let row = self.row(query.bind(id.to_string())).await?;
        row.map(|row| readable(&row)).transpose()
    }

    /// The bytes of what a job works on: a character, or a request for a study; `None` where there is no such job.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn job_input(&self, id: Uuid) -> Result<Option<Vec<u8>>, StoreError> {
        let query = self.dialect.query("SELECT input FROM jobs WHERE id = $1");
        let row = self.row(query.bind(id.to_string())).await?;
        Ok(row.map(|row| row.try_get("input")).transpose()?)
    }

    /// At most `limit` jobs, the newest first: those older than `after`, in the given state.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn jobs(
        &self,
        state: Option<JobState>,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<StoredJob>, StoreError> {
        let query = self.dialect.query(
            "SELECT id, record FROM jobs WHERE ($1 IS NULL OR state = $1) AND ($2 IS NULL OR id < $2)
             ORDER BY id DESC LIMIT $3",
        );
        let query = query.bind(state.map(JobState::name)).bind(after.map(|id| id.to_string()));
        let rows = self.rows(query.bind(i64::from(limit))).await?;
        rows.iter().map(stored).collect()
    }

    /// The ids of all jobs.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn ids(&self) -> Result<BTreeSet<Uuid>, StoreError> {
        let rows = self.rows(self.dialect.query("SELECT id FROM jobs")).await?;
        rows.iter().map(id).collect()
    }

    /// The ids of the jobs that were deleted and are not [forgotten](Self::forget).
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn deleted(&self) -> Result<BTreeSet<Uuid>, StoreError> {
        let rows = self.rows(self.dialect.query("SELECT id FROM deleted")).await?;
        rows.iter().map(id).collect()
    }

    /// Forgets that the job `id` was deleted: nothing is left of it.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn forget(&self, id: Uuid) -> Result<(), StoreError> {
        let mut writing = self.begin().await?;
        let query = self.dialect.query("DELETE FROM deleted WHERE id = $1");
        writing.execute(query.bind(id.to_string())).await?;
        writing.commit().await
    }

    /// Number of jobs in a state: of `caller`, or of everybody.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn count(&self, state: JobState, caller: Option<&str>) -> Result<u64, StoreError> {
        count(self.row(counting(self.dialect, state, caller)).await?)
    }

    /// Reads the job called `id`, has `change` decide what is done to it, and does it, with nobody in between. Gives
    /// the job as it then is; `None` when there is none.
    ///
    /// # Errors
    ///
    /// That of `change`, and then nothing has changed; when the database refuses, or the job's record cannot be read.
    pub async fn amend<E: From<StoreError>>(
        &self,
        id: Uuid,
        change: impl FnOnce(&mut Job) -> Result<Amendment, E>,
    ) -> Result<Option<Job>, E> {
        let mut writing = self.begin().await?;
        let found = find(&mut writing, id).await;
        let mut job = match found {
            Ok(Some(StoredJob::Readable(job))) => *job,
            other => {
                writing.leave().await?;
                return match other? {
                    Some(StoredJob::Unreadable { id, reason }) => {
                        Err(StoreError::Unreadable { id, reason }.into())
                    }
                    _ => Ok(None),
                };
            }
        };
        let amendment = match change(&mut job) {
            Ok(amendment) => amendment,
            Err(refused) => {
                writing.leave().await?;
                return Err(refused);
            }
        };
        let (statement, happened) = match amendment {
            Amendment::Nothing => {
                writing.leave().await?;
                return Ok(Some(job));
            }
            Amendment::Record => ("UPDATE jobs SET record = $2 WHERE id = $1", Happened::Changed),
            Amendment::Requeue(room) => {
                writing.queue_alone().await?;
                if let Err(full) = room.check(&mut writing, &job.caller).await {
                    writing.leave().await?;
                    return Err(full.into());
                }
                // A worker that repeats the end of the job, not knowing that it was recorded, no longer holds it.
                (
                    "UPDATE jobs SET record = $2, unwanted = 0, fence = fence + 1 WHERE id = $1",
                    Happened::Queued,
                )
            }
            Amendment::Abandon => {
                ("UPDATE jobs SET unwanted = 1 WHERE id = $1 AND $2 IS NOT NULL", Happened::Unwanted)
            }
        };
        let query = self.dialect.query(statement).bind(id.to_string()).bind(document(&job)?);
        writing.execute(query).await?;
        writing.tell(id, happened).await?;
        writing.commit().await?;
        Ok(Some(job))
    }

    /// Removes a job and its curve if `may` lets it, which is told whether a worker holds the job; whether there was one.
    ///
    /// # Errors
    ///
    /// That of `may`, and then nothing has changed; when the database refuses.
    pub async fn delete<E: From<StoreError>>(
        &self,
        id: Uuid,
        may: impl FnOnce(StoredJob, bool) -> Result<(), E>,
    ) -> Result<bool, E> {
        let mut writing = self.begin().await?;
        let Some(job) = find(&mut writing, id).await? else {
            writing.leave().await?;
            return Ok(false);
        };
        let query = self.dialect.query(
            "SELECT 1 FROM jobs WHERE id = $1 AND state = 'running' AND coalesce(lease_until, 0) >= {now}",
        );
        let held = writing.row(query.bind(id.to_string())).await?.is_some();
        if let Err(refused) = may(job, held) {
            writing.leave().await?;
            return Err(refused);
        }
        let query = self.dialect.query("DELETE FROM jobs WHERE id = $1");
        writing.execute(query.bind(id.to_string())).await?;
        let query = self.dialect.query("INSERT INTO deleted (id) VALUES ($1)");
        writing.execute(query.bind(id.to_string())).await?;
        writing.tell(id, Happened::Changed).await?;
        writing.commit().await?;
        Ok(true)
    }
}

/// The job called `id`, within somebody's changes of it.
async fn find(writing: &mut Writing<'_>, id: Uuid) -> Result<Option<StoredJob>, StoreError> {
    let query = writing.dialect.query("SELECT id, record FROM jobs WHERE id = $1 {lock}");
    let row = writing.row(query.bind(id.to_string())).await?;
    row.map(|row| stored(&row)).transpose()
}

/// Asks for the job that was posted under `key`.
fn posted_under(dialect: Dialect, key: &IdempotencyKey) -> Query<'_> {
    dialect.query("SELECT id, record, request FROM jobs WHERE key = $1").bind(key.key.as_str())
}

/// The job in a row that was found by `key`, and whether it was the same request.
fn known_job(row: &AnyRow, key: &IdempotencyKey) -> Result<(Job, bool), StoreError> {
    let request: &str = row.try_get("request")?;
    Ok((readable(row)?, request == key.digest))
}

/// Asks for the number of jobs in a state: of `caller`, or of everybody.
fn counting(dialect: Dialect, state: JobState, caller: Option<&str>) -> Query<'_> {
    match caller {
        None => dialect.query("SELECT count(*) AS jobs FROM jobs WHERE state = $1").bind(state.name()),
        Some(caller) => dialect
            .query("SELECT count(*) AS jobs FROM jobs WHERE state = $1 AND caller = $2")
            .bind(state.name())
            .bind(caller),
    }
}

fn count(row: Option<AnyRow>) -> Result<u64, StoreError> {
    let count: i64 = row.ok_or(sqlx::Error::RowNotFound)?.try_get("jobs")?;
    Ok(count.unsigned_abs())
}

/// The job in a row with `id` and `record`.
///
/// # Errors
///
/// When the row is not one of that table.
pub(super) fn stored(row: &AnyRow) -> Result<StoredJob, StoreError> {
    let id = id(row)?;
    let record: &str = row.try_get("record")?;
    Ok(match serde_json::from_str::<Job>(record) {
        Ok(job) if job.format != FORMAT => {
            let reason = format!("it is a `{}`, and this version knows `{FORMAT}`", job.format);
            StoredJob::Unreadable { id, reason }
        }
        Ok(job) => StoredJob::Readable(Box::new(job)),
        Err(error) => StoredJob::Unreadable { id, reason: error.to_string() },
    })
}

fn readable(row: &AnyRow) -> Result<Job, StoreError> {
    match stored(row)? {
        StoredJob::Readable(job) => Ok(*job),
        StoredJob::Unreadable { id, reason } => Err(StoreError::Unreadable { id, reason }),
    }
}
