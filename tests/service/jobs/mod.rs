//! The store of jobs: whose turn it is, who holds a job, and what an older version has left.

/// Has tests of a store run on both databases: in a folder, and on a server where there is one.
macro_rules! on_both_databases {
    ($($name:ident,)*) => {
        mod folder {
            $(
                #[tokio::test]
                async fn $name() {
                    super::$name(crate::jobs::Place::folder()).await;
                }
            )*
        }
        mod machines {
            $(
                #[tokio::test]
                #[ignore = "needs PostgreSQL"]
                async fn $name() {
                    super::$name(crate::jobs::Place::server().await).await;
                }
            )*
        }
    };
}

mod claims;
mod panics;
mod queueing;
mod records;
mod retention;
mod turns;

use gaitwright::jobs::{CharacterName, Job, Priority, QueueRoom, Settings, Store};
use tempfile::TempDir;

use crate::machines::postgres::Database;

/// Where a test has its store.
pub enum Place {
    Folder(TempDir),
    Server(Database),
}

impl Place {
    pub fn folder() -> Self {
        Self::Folder(TempDir::new().unwrap())
    }

    pub async fn server() -> Self {
        Self::Server(Database::new().await)
    }

    /// Another of the same kind.
    pub async fn another(&self) -> Self {
        match self {
            Self::Folder(_) => Self::folder(),
            Self::Server(_) => Self::server().await,
        }
    }

    /// A handle on the store, as another process has one.
    pub async fn open(&self) -> Store {
        match self {
            Self::Folder(data) => Store::open(data.path()).await.unwrap(),
            Self::Server(database) => Store::connect(&database.url().parse().unwrap()).await.unwrap(),
        }
    }
}

/// Room for as many jobs as anybody likes.
const ROOM: QueueRoom = QueueRoom { all: u64::MAX, caller: u64::MAX };

/// A job of `caller` that waits.
fn waiting(caller: &str, priority: i64) -> Job {
    let character = CharacterName { name: "any".to_owned(), digest: "sha256:0".to_owned() };
    let priority = Priority::try_from(priority).unwrap();
    Job::queued(character, Settings::default(), (caller.to_owned(), priority))
}

/// Adds a job of `caller` to the queue.
async fn post(store: &Store, caller: &str, priority: i64) -> Job {
    let job = waiting(caller, priority);
    assert!(store.post(&job, b"input", None, ROOM).await.unwrap().is_none());
    job
}
