//! Jobs, learning curves and characters in one SQLite file.
//!
//! One connection writes, and what it has committed is on the disk. After an error it is closed and another takes its
//! place: SQLite may have rolled back by itself, and a connection whose client believes otherwise would go on in a
//! transaction that is never committed. Others read, and go on while nothing can be written.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use jiff::Timestamp;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sqlx::migrate::Migrator;
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteConnection, SqliteJournalMode, SqlitePool, SqlitePoolOptions,
    SqliteSynchronous,
};
use sqlx::{ConnectOptions, Connection, Row};
use tokio::sync::{Mutex, MutexGuard};
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

impl StoreError {
    /// Whether the database cannot be reached or written at present, which may pass.
    pub fn is_unavailable(&self) -> bool {
        use sqlx::Error as E;
        matches!(
            self,
            Self::Database(E::Database(_) | E::Io(_) | E::PoolTimedOut | E::PoolClosed | E::WorkerCrashed)
        )
    }
}

/// A handle on the database; clones share it.
#[derive(Debug, Clone)]
pub struct Store {
    readers: SqlitePool,
    writer: Arc<Writer>,
}

/// The one connection that writes.
#[derive(Debug)]
struct Writer {
    options: SqliteConnectOptions,
    /// `None` before the first writing, during one, and after an error.
    connection: Mutex<Option<SqliteConnection>>,
}

/// Changes that come about together or not at all. Dropped before they are committed, they are undone, and the
/// connection is closed with them.
struct Writing<'a> {
    place: MutexGuard<'a, Option<SqliteConnection>>,
    connection: SqliteConnection,
}

impl Writer {
    async fn begin(&self) -> Result<Writing<'_>, StoreError> {
        let mut place = self.connection.lock().await;
        let mut connection = match place.take() {
            Some(connection) => connection,
            None => self.options.connect().await?,
        };
        // Refused by a connection that is in a transaction already.
        sqlx::query("BEGIN IMMEDIATE").execute(&mut connection).await?;
        Ok(Writing { place, connection })
    }
}

impl Writing<'_> {
    /// Makes the changes last: they are on the disk when this returns.
    async fn commit(self) -> Result<(), StoreError> {
        let Self { mut place, mut connection } = self;
        sqlx::query("COMMIT").execute(&mut connection).await?;
        *place = Some(connection);
        Ok(())
    }
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
            .synchronous(SqliteSynchronous::Full)
            .foreign_keys(true)
            .busy_timeout(Duration::from_secs(10));
        let mut connection = options.connect().await?;
        MIGRATIONS.run(&mut connection).await?;
        let reading = options.clone().read_only(true);
        let readers = SqlitePoolOptions::new().max_connections(4).connect_with(reading).await?;
        let connection = Mutex::new(Some(connection));
        Ok(Self { readers, writer: Arc::new(Writer { options, connection }) })
    }

    /// Whether the database can be written, by writing to it.
    ///
    /// # Errors
    ///
    /// When it cannot.
    pub async fn probe(&self) -> Result<(), StoreError> {
        let mut writing = self.writer.begin().await?;
        sqlx::query("INSERT OR REPLACE INTO probe (id, written) VALUES (1, ?)")
            .bind(Timestamp::now().to_string())
            .execute(&mut writing.connection)
            .await?;
        writing.commit().await
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
        let mut writing = self.writer.begin().await?;
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
    /// When the database refuses.
    pub async fn posted(&self, key: &IdempotencyKey) -> Result<Option<(Job, bool)>, StoreError> {
        let row = sqlx::query("SELECT record, request FROM jobs WHERE key = ?")
            .bind(&key.key)
            .fetch_optional(&self.readers)
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
        let mut writing = self.writer.begin().await?;
        sqlx::query("UPDATE jobs SET record = ?, unwanted = 0 WHERE id = ?")
            .bind(document(job)?)
            .bind(job.id.to_string())
            .execute(&mut writing.connection)
            .await?;
        writing.commit().await
    }

    /// Writes a job's record, and points of its curve with it.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn update(&self, job: &Job, curve: &[Generation]) -> Result<(), StoreError> {
        let id = job.id.to_string();
        let mut writing = self.writer.begin().await?;
        sqlx::query("UPDATE jobs SET record = ? WHERE id = ?")
            .bind(document(job)?)
            .bind(&id)
            .execute(&mut writing.connection)
            .await?;
        for figures in curve {
            sqlx::query("INSERT OR REPLACE INTO generations (job, generation, figures) VALUES (?, ?, ?)")
                .bind(&id)
                .bind(figures.generation)
                .bind(document(figures)?)
                .execute(&mut writing.connection)
                .await?;
        }
        writing.commit().await
    }

    /// The job called `id`.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError> {
        let row = sqlx::query("SELECT record FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .fetch_optional(&self.readers)
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
    ) -> Result<Vec<Job>, StoreError> {
        let rows = sqlx::query(
            "SELECT record FROM jobs WHERE (?1 IS NULL OR state = ?1) AND (?2 IS NULL OR id < ?2)
             ORDER BY id DESC LIMIT ?3",
        )
        .bind(state.map(JobState::name))
        .bind(after.map(|id| id.to_string()))
        .bind(limit)
        .fetch_all(&self.readers)
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
            .fetch_optional(&self.readers)
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
            .fetch_one(&self.readers)
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
        let mut writing = self.writer.begin().await?;
        sqlx::query("UPDATE jobs SET unwanted = 1 WHERE id = ?")
            .bind(id.to_string())
            .execute(&mut writing.connection)
            .await?;
        writing.commit().await
    }

    /// Whether the end of a job was asked for while it ran.
    ///
    /// # Errors
    ///
    /// When the database refuses, or there is no such job.
    pub async fn is_abandoned(&self, id: Uuid) -> Result<bool, StoreError> {
        let row = sqlx::query("SELECT unwanted FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .fetch_one(&self.readers)
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
        let mut writing = self.writer.begin().await?;
        sqlx::query("DELETE FROM jobs WHERE id = ?")
            .bind(id.to_string())
            .execute(&mut writing.connection)
            .await?;
        writing.commit().await
    }

    /// A job's learning curve, by generation.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn curve(&self, id: Uuid) -> Result<Vec<Generation>, StoreError> {
        let rows = sqlx::query("SELECT figures FROM generations WHERE job = ? ORDER BY generation")
            .bind(id.to_string())
            .fetch_all(&self.readers)
            .await?;
        rows.iter().map(|row| read(row.try_get("figures")?)).collect()
    }

    /// Forgets a job's learning curve.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn forget_curve(&self, id: Uuid) -> Result<(), StoreError> {
        let mut writing = self.writer.begin().await?;
        sqlx::query("DELETE FROM generations WHERE job = ?")
            .bind(id.to_string())
            .execute(&mut writing.connection)
            .await?;
        writing.commit().await
    }

    /// Keeps a character and what was found in it, and gives its id; the same bytes keep their id.
    ///
    /// # Errors
    ///
    /// When the database refuses.
    pub async fn keep_character(&self, findings: &Findings, bytes: &[u8]) -> Result<Uuid, StoreError> {
        let mut writing = self.writer.begin().await?;
        let row = sqlx::query(
            "INSERT INTO characters (id, digest, findings, bytes) VALUES (?, ?, ?, ?)
             ON CONFLICT (digest) DO UPDATE SET findings = excluded.findings RETURNING id",
        )
        .bind(Uuid::now_v7().to_string())
        .bind(&findings.digest)
        .bind(document(findings)?)
        .bind(bytes)
        .fetch_one(&mut writing.connection)
        .await?;
        writing.commit().await?;
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
            .fetch_optional(&self.readers)
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
            .fetch_optional(&self.readers)
            .await?;
        Ok(row.map(|row| row.try_get("bytes")).transpose()?)
    }

    /// Writes everything to the file and lets go of it.
    pub async fn close(&self) {
        self.readers.close().await;
        if let Some(connection) = self.writer.connection.lock().await.take()
            && let Err(error) = connection.close().await
        {
            tracing::warn!(%error, "the store could not be closed in order");
        }
    }
}

fn document<T: Serialize>(value: &T) -> Result<String, StoreError> {
    Ok(serde_json::to_string(value)?)
}

fn read<T: DeserializeOwned>(text: &str) -> Result<T, StoreError> {
    Ok(serde_json::from_str(text)?)
}
