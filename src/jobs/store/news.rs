//! What others who share the store do, as they do it: PostgreSQL's LISTEN and NOTIFY.
//!
//! News may be missed, while a connection is made anew or the network keeps silent. Whoever waits for something looks for
//! it now and then as well.

use std::time::Duration;

use sqlx::postgres::PgListener;
use uuid::Uuid;

use super::database::{Store, StoreError, Writing};
use super::dialect::Dialect;

/// The channel of the program.
const CHANNEL: &str = "gaitwright";

/// How long nothing may be heard before it is asked whether the server is still there.
const QUIET: Duration = Duration::from_secs(15);

/// How long the server may take to let the listener in, or to answer it.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// What happens to a job.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Happened {
    /// It waits for a worker.
    Queued,
    /// Somebody has asked for its end while it runs.
    Unwanted,
    /// Something else but progress: it has been taken up, has ended, is gone.
    Changed,
}

impl Happened {
    const ALL: [Self; 3] = [Self::Queued, Self::Unwanted, Self::Changed];

    fn word(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Unwanted => "unwanted",
            Self::Changed => "changed",
        }
    }

    /// The message that tells it of a job.
    fn about(self, id: Uuid) -> String {
        format!("{} {id}", self.word())
    }

    fn read(message: &str) -> Option<(Uuid, Self)> {
        let (word, id) = message.split_once(' ')?;
        let happened = Self::ALL.into_iter().find(|happened| happened.word() == word)?;
        Some((Uuid::parse_str(id).ok()?, happened))
    }
}

/// Hears what others do. It stops hearing when it is dropped.
pub struct Listener(PgListener);

impl Writing<'_> {
    /// Has others who share the store hear of a job once the changes last.
    pub(super) async fn tell(&mut self, id: Uuid, happened: Happened) -> Result<(), StoreError> {
        match self.dialect {
            // Nobody shares it.
            Dialect::Sqlite => Ok(()),
            Dialect::Postgres => {
                let query = sqlx::query("SELECT 1 FROM pg_notify($1, $2)");
                self.execute(query.bind(CHANNEL).bind(happened.about(id))).await.map(drop)
            }
        }
    }
}

impl Store {
    /// Listens to those who share the store; `None` where nobody can.
    ///
    /// # Errors
    ///
    /// When the server cannot be reached.
    pub async fn listen(&self) -> Result<Option<Listener>, StoreError> {
        if !self.is_shared() {
            return Ok(None);
        }
        let listening = async {
            let mut listener = PgListener::connect(self.options.database_url.as_str()).await?;
            listener.listen(CHANNEL).await?;
            Ok::<_, sqlx::Error>(Listener(listener))
        };
        let listener = tokio::time::timeout(ANSWER_TIMEOUT, listening).await;
        Ok(Some(listener.map_err(|_| StoreError::Silent)??))
    }
}

impl Listener {
    /// What happens next, and to which job.
    ///
    /// # Errors
    ///
    /// When the server can no longer be heard: anything may have happened since, and another listener is needed.
    pub async fn next(&mut self) -> Result<(Uuid, Happened), StoreError> {
        loop {
            let Ok(heard) = tokio::time::timeout(QUIET, self.0.try_recv()).await else {
                // Answered at once, unless the network keeps silent.
                let asked = tokio::time::timeout(ANSWER_TIMEOUT, self.0.listen(CHANNEL)).await;
                asked.map_err(|_| StoreError::Silent)??;
                continue;
            };
            let Some(notification) = heard? else { return Err(StoreError::Silent) };
            match Happened::read(notification.payload()) {
                Some(news) => return Ok(news),
                None => tracing::warn!(message = notification.payload(), "somebody else uses the channel"),
            }
        }
    }
}
