//! Jobs as their clients see them: posted, shown, changed, deleted.

use std::collections::BTreeSet;

use sqlx::Row;
use sqlx::sqlite::{SqliteConnection, SqliteRow};
use uuid::Uuid;

use super::connection::{Store, StoreError, document, id};
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
    /// Its record is written, and that its end was asked for is forgotten.
    Requeue,
    /// It is kept in mind that its end was asked for. The record of a job that runs is its worker's alone to write.
    Abandon,
}

impl Store {
    /// Adds a job, the bytes of what it works on, and the key that it was posted under.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn insert(
        &self,
        job: &Job,
        input: &[u8],
        key: Option<&IdempotencyKey>,
    ) -> Result<(), StoreError> {
        let mut writing = self.begin().await?;
        sqlx::query("INSERT INTO jobs (id, record, input, key, request) VALUES (?, ?, ?, ?, ?)")
            .bind(job.id.to_string())
            .bind(document(job)?)
            .bind(input)
            .bind(key.map(|key| &key.key))
            .bind(key.map(|key| &key.digest))
            .execute(&mut writing.connection)
            .await?;
        writing.commit().await
    }

    /// The job that was posted under `key`, and whether it was the same request.
    ///
    /// # Errors
    ///
    /// When the database refuses, or the job's record cannot be read.
    pub async fn posted(&self, key: &IdempotencyKey) -> Result<Option<(Job, bool)>, StoreError> {
        let row = sqlx::query("SELECT id, record, request FROM jobs WHERE key = ?")
            .bind(&key.key)
            .fetch_optional(&self.readers)
            .await?;
        let Some(row) = row else { return Ok(None) };
        let request: String = row.try_get("request")?;
        Ok(Some((readable(&row)?, request == key.digest)))
    }

    /// The job called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses, or the job's record cannot be read.
    pub async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError> {
        let row = sqlx::query("SELECT id, record FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .fetch_optional(&self.readers)
            .await?;
        row.map(|row| readable(&row)).transpose()
    }

    /// The bytes of what a job works on: a character, or a request for a study.
    ///
    /// # Errors
    ///
    /// When the database refuses, or there is no such job.
    pub async fn job_input(&self, id: Uuid) -> Result<Vec<u8>, StoreError> {
        let row = sqlx::query("SELECT input FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .fetch_one(&self.readers)
            .await?;
        Ok(row.try_get("input")?)
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
        let rows = sqlx::query(
            "SELECT id, record FROM jobs WHERE (?1 IS NULL OR state = ?1) AND (?2 IS NULL OR id < ?2)
             ORDER BY id DESC LIMIT ?3",
        )
        .bind(state.map(JobState::name))
        .bind(after.map(|id| id.to_string()))
        .bind(limit)
        .fetch_all(&self.readers)
        .await?;
        rows.iter().map(stored).collect()
    }

    /// The ids of all jobs.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn ids(&self) -> Result<BTreeSet<Uuid>, StoreError> {
        let rows = sqlx::query("SELECT id FROM jobs").fetch_all(&self.readers).await?;
        rows.iter().map(id).collect()
    }

    /// Number of jobs in a state: of `caller`, or of everybody.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn count(&self, state: JobState, caller: Option<&str>) -> Result<u64, StoreError> {
        let row =
            sqlx::query("SELECT count(*) AS jobs FROM jobs WHERE state = ?1 AND (?2 IS NULL OR caller = ?2)")
                .bind(state.name())
                .bind(caller)
                .fetch_one(&self.readers)
                .await?;
        let count: i64 = row.try_get("jobs")?;
        Ok(count.unsigned_abs())
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
        let found = find(&mut writing.connection, id).await;
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
        let statement = match amendment {
            Amendment::Nothing => {
                writing.leave().await?;
                return Ok(Some(job));
            }
            Amendment::Record => "UPDATE jobs SET record = ?2 WHERE id = ?1",
            Amendment::Requeue => "UPDATE jobs SET record = ?2, unwanted = 0 WHERE id = ?1",
            Amendment::Abandon => "UPDATE jobs SET unwanted = 1 WHERE id = ?1 AND ?2 IS NOT NULL",
        };
        sqlx::query(statement)
            .bind(id.to_string())
            .bind(document(&job)?)
            .execute(&mut writing.connection)
            .await
            .map_err(StoreError::from)?;
        writing.commit().await?;
        Ok(Some(job))
    }

    /// Removes a job and its curve if `may` lets it; whether there was one.
    ///
    /// # Errors
    ///
    /// That of `may`, and then nothing has changed; when the database refuses.
    pub async fn delete<E: From<StoreError>>(
        &self,
        id: Uuid,
        may: impl FnOnce(&StoredJob) -> Result<(), E>,
    ) -> Result<bool, E> {
        let mut writing = self.begin().await?;
        let Some(job) = find(&mut writing.connection, id).await? else {
            writing.leave().await?;
            return Ok(false);
        };
        if let Err(refused) = may(&job) {
            writing.leave().await?;
            return Err(refused);
        }
        sqlx::query("DELETE FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .execute(&mut writing.connection)
            .await
            .map_err(StoreError::from)?;
        writing.commit().await?;
        Ok(true)
    }
}

/// The job called `id`, within somebody's changes.
async fn find(connection: &mut SqliteConnection, id: Uuid) -> Result<Option<StoredJob>, StoreError> {
    let row = sqlx::query("SELECT id, record FROM jobs WHERE id = ?")
        .bind(id.to_string())
        .fetch_optional(connection)
        .await?;
    row.map(|row| stored(&row)).transpose()
}

/// The job in a row with `id` and `record`.
///
/// # Errors
///
/// When the row is not one of that table.
pub(super) fn stored(row: &SqliteRow) -> Result<StoredJob, StoreError> {
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

fn readable(row: &SqliteRow) -> Result<Job, StoreError> {
    match stored(row)? {
        StoredJob::Readable(job) => Ok(*job),
        StoredJob::Unreadable { id, reason } => Err(StoreError::Unreadable { id, reason }),
    }
}
