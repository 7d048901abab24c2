//! Jobs, learning curves and characters in one SQLite file.

use std::path::Path;
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sqlx::Row;
use sqlx::migrate::Migrator;
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteSynchronous,
};
use uuid::Uuid;

use super::check::Findings;
use super::job::{Job, JobState};
use super::once::IdempotencyKey;
use gaitwright_learning::learn::Generation;

static MIGRATIONS: Migrator = sqlx::migrate!("src/jobs/migrations");

/// The file under the data folder.
const FILE: &str = "gaitwright.db";

/// Why the store could not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database refused.
    #[error("the store failed: {0}")]
    Database(#[from] sqlx::Error),
    /// The database could not be brought to this version's tables.
    #[error("the store could not be prepared: {0}")]
    Migration(#[from] sqlx::migrate::MigrateError),
    /// A document in the database is not what this version writes.
    #[error("the store holds a document that cannot be read: {0}")]
    Document(#[from] serde_json::Error),
}

/// A handle on the database; clones share it.
#[derive(Debug, Clone)]
pub struct Store {
    pool: SqlitePool,
}

impl Store {
    /// Opens the database under the folder `data`, made if there is none.
    ///
    /// # Errors
    ///
    /// When the file cannot be opened or is not a database of this program.
    pub async fn open(data: &Path) -> Result<Self, StoreError> {
        let options = SqliteConnectOptions::new()
            .filename(data.join(FILE))
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Normal)
            .foreign_keys(true)
            .busy_timeout(Duration::from_secs(10));
        let pool = SqlitePoolOptions::new().max_connections(4).connect_with(options).await?;
        MIGRATIONS.run(&pool).await?;
        Ok(Self { pool })
    }

    /// Whether the database answers.
    ///
    /// # Errors
    ///
    /// When it does not.
    pub async fn ping(&self) -> Result<(), StoreError> {
        sqlx::query("SELECT 1").execute(&self.pool).await?;
        Ok(())
    }

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
        sqlx::query("INSERT INTO jobs (id, record, input, key, request) VALUES (?, ?, ?, ?, ?)")
            .bind(job.id.to_string())
            .bind(document(job)?)
            .bind(input)
            .bind(key.map(|key| &key.key))
            .bind(key.map(|key| &key.digest))
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// The job that was posted under `key`, and whether it was the same request.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn posted(&self, key: &IdempotencyKey) -> Result<Option<(Job, bool)>, StoreError> {
        let row = sqlx::query("SELECT record, request FROM jobs WHERE key = ?")
            .bind(&key.key)
            .fetch_optional(&self.pool)
            .await?;
        let Some(row) = row else { return Ok(None) };
        let request: String = row.try_get("request")?;
        Ok(Some((read(row.try_get("record")?)?, request == key.digest)))
    }

    /// Writes the record of a job that is queued again; that its end was asked for is forgotten.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn requeue(&self, job: &Job) -> Result<(), StoreError> {
        sqlx::query("UPDATE jobs SET record = ?, unwanted = 0 WHERE id = ?")
            .bind(document(job)?)
            .bind(job.id.to_string())
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// Writes a job's record, and points of its curve with it.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn update(&self, job: &Job, curve: &[Generation]) -> Result<(), StoreError> {
        let id = job.id.to_string();
        let mut transaction = self.pool.begin().await?;
        sqlx::query("UPDATE jobs SET record = ? WHERE id = ?")
            .bind(document(job)?)
            .bind(&id)
            .execute(&mut *transaction)
            .await?;
        for figures in curve {
            sqlx::query("INSERT OR REPLACE INTO generations (job, generation, figures) VALUES (?, ?, ?)")
                .bind(&id)
                .bind(figures.generation)
                .bind(document(figures)?)
                .execute(&mut *transaction)
                .await?;
        }
        transaction.commit().await?;
        Ok(())
    }

    /// The job called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError> {
        let row = sqlx::query("SELECT record FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .fetch_optional(&self.pool)
            .await?;
        row.map(|row| read(row.try_get("record")?)).transpose()
    }

    /// The bytes of what a job works on: a character, or a request for a study.
    ///
    /// # Errors
    ///
    /// When the database refuses, or there is no such job.
    pub async fn job_input(&self, id: Uuid) -> Result<Vec<u8>, StoreError> {
        let row = sqlx::query("SELECT input FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .fetch_one(&self.pool)
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
    ) -> Result<Vec<Job>, StoreError> {
        let rows = sqlx::query(
            "SELECT record FROM jobs WHERE (?1 IS NULL OR state = ?1) AND (?2 IS NULL OR id < ?2)
             ORDER BY id DESC LIMIT ?3",
        )
        .bind(state.map(JobState::name))
        .bind(after.map(|id| id.to_string()))
        .bind(limit)
        .fetch_all(&self.pool)
        .await?;
        rows.iter().map(|row| read(row.try_get("record")?)).collect()
    }

    /// The job that has waited longest.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn next(&self) -> Result<Option<Job>, StoreError> {
        let row = sqlx::query("SELECT record FROM jobs WHERE state = 'queued' ORDER BY id LIMIT 1")
            .fetch_optional(&self.pool)
            .await?;
        row.map(|row| read(row.try_get("record")?)).transpose()
    }

    /// Number of jobs in a state.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn count(&self, state: JobState) -> Result<u64, StoreError> {
        let row = sqlx::query("SELECT count(*) AS jobs FROM jobs WHERE state = ?")
            .bind(state.name())
            .fetch_one(&self.pool)
            .await?;
        let count: i64 = row.try_get("jobs")?;
        Ok(count.unsigned_abs())
    }

    /// Keeps in mind that the end of a job was asked for while it runs.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn abandon(&self, id: Uuid) -> Result<(), StoreError> {
        sqlx::query("UPDATE jobs SET unwanted = 1 WHERE id = ?")
            .bind(id.to_string())
            .execute(&self.pool)
            .await?;
        Ok(())
    }

    /// Whether the end of a job was asked for while it ran.
    ///
    /// # Errors
    ///
    /// When the database refuses, or there is no such job.
    pub async fn is_abandoned(&self, id: Uuid) -> Result<bool, StoreError> {
        let row = sqlx::query("SELECT unwanted FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .fetch_one(&self.pool)
            .await?;
        let unwanted: i64 = row.try_get("unwanted")?;
        Ok(unwanted != 0)
    }

    /// Removes a job and its curve.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn delete(&self, id: Uuid) -> Result<(), StoreError> {
        sqlx::query("DELETE FROM jobs WHERE id = ?").bind(id.to_string()).execute(&self.pool).await?;
        Ok(())
    }

    /// A job's learning curve, by generation.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn curve(&self, id: Uuid) -> Result<Vec<Generation>, StoreError> {
        let rows = sqlx::query("SELECT figures FROM generations WHERE job = ? ORDER BY generation")
            .bind(id.to_string())
            .fetch_all(&self.pool)
            .await?;
        rows.iter().map(|row| read(row.try_get("figures")?)).collect()
    }

    /// Forgets a job's learning curve.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn forget_curve(&self, id: Uuid) -> Result<(), StoreError> {
        sqlx::query("DELETE FROM generations WHERE job = ?").bind(id.to_string()).execute(&self.pool).await?;
        Ok(())
    }

    /// Keeps a character and what was found in it, and gives its id; the same bytes keep their id.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn keep_character(&self, findings: &Findings, bytes: &[u8]) -> Result<Uuid, StoreError> {
        let row = sqlx::query(
            "INSERT INTO characters (id, digest, findings, bytes) VALUES (?, ?, ?, ?)
             ON CONFLICT (digest) DO UPDATE SET findings = excluded.findings RETURNING id",
        )
        .bind(Uuid::now_v7().to_string())
        .bind(&findings.digest)
        .bind(document(findings)?)
        .bind(bytes)
        .fetch_one(&self.pool)
        .await?;
        let id: String = row.try_get("id")?;
        Uuid::parse_str(&id).map_err(|error| StoreError::Database(sqlx::Error::Decode(error.into())))
    }

    /// What was found in the character called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn findings(&self, id: Uuid) -> Result<Option<Findings>, StoreError> {
        let row = sqlx::query("SELECT findings FROM characters WHERE id = ?")
            .bind(id.to_string())
            .fetch_optional(&self.pool)
            .await?;
        row.map(|row| read(row.try_get("findings")?)).transpose()
    }

    /// The bytes of the character called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn character(&self, id: Uuid) -> Result<Option<Vec<u8>>, StoreError> {
        let row = sqlx::query("SELECT bytes FROM characters WHERE id = ?")
            .bind(id.to_string())
            .fetch_optional(&self.pool)
            .await?;
        Ok(row.map(|row| row.try_get("bytes")).transpose()?)
    }

    /// Writes everything to the file and lets go of it.
    pub async fn close(&self) {
        self.pool.close().await;
    }
}

fn document<T: Serialize>(value: &T) -> Result<String, StoreError> {
    Ok(serde_json::to_string(value)?)
}

fn read<T: DeserializeOwned>(text: &str) -> Result<T, StoreError> {
    Ok(serde_json::from_str(text)?)
}
