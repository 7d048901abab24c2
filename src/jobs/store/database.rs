//! The database: a file that one connection writes and others read, or a server.
//!
//! What has been committed is on the disk. After an error a connection that writes is closed and another takes its
//! place: SQLite may have rolled back by itself, and a connection whose client believes otherwise would go on in a
//! transaction that is never committed; PostgreSQL rolls back what a connection that is closed has not committed.
//! Readers go on while nothing can be written.

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use serde::de::DeserializeOwned;
use sqlx::any::{AnyConnectOptions, AnyPoolOptions, AnyRow, install_default_drivers};
use sqlx::migrate::Migrator;
use sqlx::pool::PoolConnection;
use sqlx::{Any, AnyConnection, AnyPool, ConnectOptions, Connection, Executor, Row};
use tokio::sync::{Mutex, MutexGuard};
use url::Url;
use uuid::Uuid;

use super::dialect::{Dialect, Query};

static SQLITE: Migrator = sqlx::migrate!("src/jobs/store/migrations/sqlite");

static POSTGRES: Migrator = sqlx::migrate!("src/jobs/store/migrations/postgres");

/// The file under the data folder.
const FILE: &str = "gaitwright.db";

/// How long one who writes waits for another: here for its turn, and in the file for another program, such as a backup.
const BUSY_TIMEOUT: Duration = Duration::from_secs(2);

/// How long a server may take for an answer, or for letting a connection in: without a limit, whoever is cut off from it
/// would wait for as long as the network keeps silent.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// Connections of one process to a server.
const CONNECTIONS: u32 = 8;

/// The lock of those who add to the queue of a server: any number that the program uses for nothing else.
const QUEUE_LOCK: i64 = 0x6761_6974;

/// How every connection to the file is set up: what has been committed is on the disk even if the power fails.
const PRAGMAS: &str = "PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON; PRAGMA busy_timeout = 2000";

/// Why the store could not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database refused.
    #[error("the store failed: {0}")]
    Database(#[from] sqlx::Error),
    /// Others are writing, and do not come to an end.
    #[error("the store is busy")]
    Busy,
    /// As many jobs wait as may wait.
    #[error("{0} jobs are waiting already")]
    Full(u64),
    /// As many jobs of the caller wait as may wait.
    #[error("{0} jobs of this caller are waiting already")]
    FullForCaller(u64),
    /// The server keeps silent.
    #[error("the store does not answer")]
    Silent,
    /// The file's path cannot be written as a URL.
    #[error("the store cannot have the path {0}: it is not of Unicode characters")]
    Path(String),
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
            Self::Busy | Self::Silent => true,
            Self::Database(error) => matches!(
                error,
                E::Database(_) | E::Io(_) | E::PoolTimedOut | E::PoolClosed | E::WorkerCrashed
            ),
            Self::Full(_)
            | Self::FullForCaller(_)
            | Self::Path(_)
            | Self::Migration(_)
            | Self::Document(_)
            | Self::Unreadable { .. } => false,
        }
    }
}

/// A handle on the database; clones share it.
#[derive(Clone)]
pub struct Store {
    pub(super) dialect: Dialect,
    pub(super) options: AnyConnectOptions,
    /// Connections to read with, and on a server to write with as well.
    pool: AnyPool,
    /// The one connection that writes to a file: `None` before the first writing, during one, and after an error.
    writer: Arc<Mutex<Option<AnyConnection>>>,
}

impl fmt::Debug for Store {
    /// Without what it takes to connect: no log is to have a password.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Store").field("dialect", &self.dialect).finish_non_exhaustive()
    }
}

/// Changes that come about together or not at all. Dropped before they are committed, they are undone, and the
/// connection is closed with them.
pub(super) struct Writing<'a> {
    pub(super) dialect: Dialect,
    /// There until the end.
    connection: Option<WritingConnection<'a>>,
}

enum WritingConnection<'a> {
    /// To a file, and where it is kept between two writings.
    One(AnyConnection, MutexGuard<'a, Option<AnyConnection>>),
    /// To a server.
    Pooled(PoolConnection<Any>),
}

impl Drop for Writing<'_> {
    fn drop(&mut self) {
        if let Some(WritingConnection::Pooled(connection)) = self.connection.take() {
            drop(connection.detach());
        }
    }
}

impl Writing<'_> {
    fn connection(&mut self) -> Result<&mut AnyConnection, StoreError> {
        match &mut self.connection {
            Some(WritingConnection::One(connection, _)) => Ok(connection),
            Some(WritingConnection::Pooled(connection)) => Ok(&mut *connection),
            None => Err(StoreError::Database(sqlx::Error::PoolClosed)),
        }
    }

    /// Carries a statement out; the number of rows it was about.
    pub(super) async fn execute(&mut self, query: Query<'_>) -> Result<u64, StoreError> {
        let dialect = self.dialect;
        Ok(answered(dialect, query.execute(self.connection()?)).await?.rows_affected())
    }

    /// The first row of a statement's answer.
    pub(super) async fn row(&mut self, query: Query<'_>) -> Result<Option<AnyRow>, StoreError> {
        let dialect = self.dialect;
        answered(dialect, query.fetch_optional(self.connection()?)).await
    }

    /// The rows of a statement's answer.
    pub(super) async fn rows(&mut self, query: Query<'_>) -> Result<Vec<AnyRow>, StoreError> {
        let dialect = self.dialect;
        answered(dialect, query.fetch_all(self.connection()?)).await
    }

    /// Has nobody else add to the queue before these changes have ended.
    pub(super) async fn queue_alone(&mut self) -> Result<(), StoreError> {
        match self.dialect {
            // Whoever writes is alone.
            Dialect::Sqlite => Ok(()),
            Dialect::Postgres => {
                let query = sqlx::query("SELECT 1 FROM pg_advisory_xact_lock($1)");
                self.execute(query.bind(QUEUE_LOCK)).await.map(drop)
            }
        }
    }

    /// Makes the changes last: they are on the disk when this returns.
    pub(super) async fn commit(self) -> Result<(), StoreError> {
        self.end("COMMIT").await
    }

    /// Ends without a change, and keeps the connection.
    pub(super) async fn leave(self) -> Result<(), StoreError> {
        self.end("ROLLBACK").await
    }

    async fn end(mut self, how: &'static str) -> Result<(), StoreError> {
        self.execute(sqlx::query(how)).await?;
        match self.connection.take() {
            Some(WritingConnection::One(connection, mut place)) => *place = Some(connection),
            // Goes back to the others.
            Some(WritingConnection::Pooled(connection)) => drop(connection),
            None => {}
        }
        Ok(())
    }
}

impl Store {
    /// Opens the database in the folder `data`, made if there is none.
    ///
    /// # Errors
    ///
    /// When the file cannot be opened, is not a database of this program, or is one of a newer version.
    pub async fn open(data: &Path) -> Result<Self, StoreError> {
        install_default_drivers();
        let file = std::path::absolute(data.join(FILE)).map_err(sqlx::Error::from)?;
        let path = Url::from_file_path(&file).map_err(|()| StoreError::Path(file.display().to_string()))?;
        let options = |mode| format!("sqlite://{}?mode={mode}", path.path()).parse::<AnyConnectOptions>();
        let writing = options("rwc")?;
        let mut connection = writing.connect().await?;
        connection.execute(PRAGMAS).await?;
        SQLITE.run(&mut connection).await?;
        let pool = AnyPoolOptions::new().max_connections(4).acquire_timeout(BUSY_TIMEOUT);
        let pool = pool.connect_with(options("ro")?).await?;
        let writer = Arc::new(Mutex::new(Some(connection)));
        Ok(Self { dialect: Dialect::Sqlite, options: writing, pool, writer })
    }

    /// Opens the database at `url` (`postgres://…`), which others may use as well.
    ///
    /// # Errors
    ///
    /// When the server cannot be reached, or the database is not one of this program or one of a newer version.
    pub async fn connect(url: &Url) -> Result<Self, StoreError> {
        install_default_drivers();
        let options: AnyConnectOptions = url.as_str().parse()?;
        let pool = AnyPoolOptions::new().max_connections(CONNECTIONS).acquire_timeout(ANSWER_TIMEOUT);
        let pool = pool.connect_with(options.clone()).await?;
        POSTGRES.run(&pool).await?;
        Ok(Self { dialect: Dialect::Postgres, options, pool, writer: Arc::default() })
    }

    /// Whether other processes may use the same store.
    pub fn is_shared(&self) -> bool {
        self.dialect == Dialect::Postgres
    }

    /// Begins changes. In a file, whoever else wants to change something waits until these have ended.
    pub(super) async fn begin(&self) -> Result<Writing<'_>, StoreError> {
        let connection = match self.dialect {
            Dialect::Sqlite => {
                let turn = tokio::time::timeout(BUSY_TIMEOUT, self.writer.lock());
                let mut place = turn.await.map_err(|_| StoreError::Busy)?;
                let connection = match place.take() {
                    Some(connection) => connection,
                    None => {
                        let mut connection = self.options.connect().await?;
                        connection.execute(PRAGMAS).await?;
                        connection
                    }
                };
                WritingConnection::One(connection, place)
            }
            Dialect::Postgres => WritingConnection::Pooled(self.pool.acquire().await?),
        };
        let mut writing = Writing { dialect: self.dialect, connection: Some(connection) };
        writing.execute(sqlx::query(self.dialect.begin())).await?;
        Ok(writing)
    }

    /// The first row of a question's answer.
    pub(super) async fn row(&self, query: Query<'_>) -> Result<Option<AnyRow>, StoreError> {
        let mut connection = self.pool.acquire().await?;
        let row = answered(self.dialect, query.fetch_optional(&mut *connection)).await;
        self.give_back(connection, row)
    }

    /// The rows of a question's answer.
    pub(super) async fn rows(&self, query: Query<'_>) -> Result<Vec<AnyRow>, StoreError> {
        let mut connection = self.pool.acquire().await?;
        let rows = answered(self.dialect, query.fetch_all(&mut *connection)).await;
        self.give_back(connection, rows)
    }

    /// Keeps a connection that has answered; one to a server that has not is closed at once.
    fn give_back<T>(
        &self,
        connection: PoolConnection<Any>,
        answer: Result<T, StoreError>,
    ) -> Result<T, StoreError> {
        if answer.is_err() && self.is_shared() {
            drop(connection.detach());
        }
        answer
    }

    /// Whether the database can be written, by writing to it.
    ///
    /// # Errors
    ///
    /// When it cannot.
    pub async fn probe(&self) -> Result<(), StoreError> {
        let mut writing = self.begin().await?;
        let probe = self.dialect.query(
            "INSERT INTO probe (id, written) VALUES (1, CAST({now} AS TEXT))
             ON CONFLICT (id) DO UPDATE SET written = excluded.written",
        );
        writing.execute(probe).await?;
        writing.commit().await
    }

    /// Writes everything to the file and lets go of it.
    pub async fn close(&self) {
        // A server that keeps silent is left at the end of its time.
        let _ = tokio::time::timeout(ANSWER_TIMEOUT, self.pool.close()).await;
        if let Some(connection) = self.writer.lock().await.take()
            && let Err(error) = connection.close().await
        {
            tracing::warn!(%error, "the store could not be closed in order");
        }
    }
}

/// The answer to a question, if it comes in time. A file has as long as its disk takes.
async fn answered<T>(
    dialect: Dialect,
    answer: impl Future<Output = Result<T, sqlx::Error>>,
) -> Result<T, StoreError> {
    match dialect {
        Dialect::Sqlite => Ok(answer.await?),
        Dialect::Postgres => {
            Ok(tokio::time::timeout(ANSWER_TIMEOUT, answer).await.map_err(|_| StoreError::Silent)??)
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
pub(super) fn id(row: &AnyRow) -> Result<Uuid, StoreError> {
    let id: &str = row.try_get("id")?;
    Uuid::parse_str(id).map_err(|error| sqlx::Error::Decode(error.into()).into())
}
