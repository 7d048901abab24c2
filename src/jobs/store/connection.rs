//! The database file: one connection writes, others read.
//!
//! What the writer has committed is on the disk. After an error it is closed and another takes its place: SQLite may
//! have rolled back by itself, and a connection whose client believes otherwise would go on in a transaction that is
//! never committed. Readers go on while nothing can be written.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use jiff::Timestamp;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sqlx::migrate::Migrator;
use sqlx::sqlite::{
    SqliteConnectOptions, SqliteConnection, SqliteJournalMode, SqlitePool, SqlitePoolOptions, SqliteRow,
    SqliteSynchronous,
};
use sqlx::{ConnectOptions, Connection, Row};
use tokio::sync::{Mutex, MutexGuard};
use uuid::Uuid;

static MIGRATIONS: Migrator = sqlx::migrate!("src/jobs/migrations");

/// The file under the data folder.
const FILE: &str = "gaitwright.db";

/// How long one who writes waits for another: here for its turn, and in the file for another program, such as a backup.
const BUSY_TIMEOUT: Duration = Duration::from_secs(2);

/// Why the store could not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database refused.
    #[error("the store failed: {0}")]
    Database(#[from] sqlx::Error),
    /// Others are writing, and do not come to an end.
    #[error("the store is busy")]
    Busy,
    /// The database could not be brought to this version's tables.
    #[error("the store could not be prepared: {0}")]
    Migration(#[from] sqlx::migrate::MigrateError),
    /// A document in the database is not what this version writes.
    #[error("the store holds a document that cannot be read: {0}")]
    Document(#[from] serde_json::Error),
    /// The record of a job is not what this version writes.
    #[error("the record of the job {id} cannot be read: {reason}")]
    Unreadable {
        /// The job.
        id: Uuid,
        /// What is wrong with its record.
        reason: String,
    },
}

impl StoreError {
    /// Whether the database cannot be reached or written at present, which may pass.
    pub fn is_unavailable(&self) -> bool {
        use sqlx::Error as E;
        match self {
            Self::Busy => true,
            Self::Database(error) => matches!(
                error,
                E::Database(_) | E::Io(_) | E::PoolTimedOut | E::PoolClosed | E::WorkerCrashed
            ),
            Self::Migration(_) | Self::Document(_) | Self::Unreadable { .. } => false,
        }
    }
}

/// A handle on the database; clones share it.
#[derive(Debug, Clone)]
pub struct Store {
    pub(super) readers: SqlitePool,
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
pub(super) struct Writing<'a> {
    place: MutexGuard<'a, Option<SqliteConnection>>,
    pub(super) connection: SqliteConnection,
}

impl Writing<'_> {
    /// Makes the changes last: they are on the disk when this returns.
    pub(super) async fn commit(self) -> Result<(), StoreError> {
        let Self { mut place, mut connection } = self;
        sqlx::query("COMMIT").execute(&mut connection).await?;
        *place = Some(connection);
        Ok(())
    }

    /// Ends without a change, and keeps the connection.
    pub(super) async fn leave(self) -> Result<(), StoreError> {
        let Self { mut place, mut connection } = self;
        sqlx::query("ROLLBACK").execute(&mut connection).await?;
        *place = Some(connection);
        Ok(())
    }
}

impl Store {
    /// Opens the database under the folder `data`, made if there is none.
    ///
    /// # Errors
    ///
    /// When the file cannot be opened, is not a database of this program, or is one of a newer version.
    pub async fn open(data: &Path) -> Result<Self, StoreError> {
        let options = SqliteConnectOptions::new()
            .filename(data.join(FILE))
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .foreign_keys(true)
            .busy_timeout(BUSY_TIMEOUT);
        let mut connection = options.connect().await?;
        MIGRATIONS.run(&mut connection).await?;
        let reading = options.clone().read_only(true);
        let readers = SqlitePoolOptions::new().max_connections(4).connect_with(reading).await?;
        let connection = Mutex::new(Some(connection));
        Ok(Self { readers, writer: Arc::new(Writer { options, connection }) })
    }

    /// Begins changes; whoever else wants to change something waits until these have ended.
    pub(super) async fn begin(&self) -> Result<Writing<'_>, StoreError> {
        let turn = tokio::time::timeout(BUSY_TIMEOUT, self.writer.connection.lock());
        let mut place = turn.await.map_err(|_| StoreError::Busy)?;
        let mut connection = match place.take() {
            Some(connection) => connection,
            None => self.writer.options.connect().await?,
        };
        // Refused by a connection that is in a transaction already.
        sqlx::query("BEGIN IMMEDIATE").execute(&mut connection).await?;
        Ok(Writing { place, connection })
    }

    /// Whether the database can be written, by writing to it.
    ///
    /// # Errors
    ///
    /// When it cannot.
    pub async fn probe(&self) -> Result<(), StoreError> {
        let mut writing = self.begin().await?;
        sqlx::query("INSERT OR REPLACE INTO probe (id, written) VALUES (1, ?)")
            .bind(Timestamp::now().to_string())
            .execute(&mut writing.connection)
            .await?;
        writing.commit().await
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

pub(super) fn document<T: Serialize>(value: &T) -> Result<String, StoreError> {
    Ok(serde_json::to_string(value)?)
}

pub(super) fn read<T: DeserializeOwned>(text: &str) -> Result<T, StoreError> {
    Ok(serde_json::from_str(text)?)
}

/// The id in a row.
pub(super) fn id(row: &SqliteRow) -> Result<Uuid, StoreError> {
    let id: &str = row.try_get("id")?;
    Uuid::parse_str(id).map_err(|error| sqlx::Error::Decode(error.into()).into())
}
