//! The store of jobs: whose turn it is, who holds a job, and what an older version has left.

mod claims;
mod records;
mod retention;
mod turns;

use gaitwright::jobs::{CharacterName, Job, Priority, Settings, Store};

/// A job of `caller` that waits.
fn waiting(caller: &str, priority: i64) -> Job {
    let character = CharacterName { name: "any".to_owned(), digest: "sha256:0".to_owned() };
    let priority = Priority::try_from(priority).unwrap();
    Job::queued(character, Settings::default(), (caller.to_owned(), priority))
}

/// Adds a job of `caller` to the queue.
async fn post(store: &Store, caller: &str, priority: i64) -> Job {
    let job = waiting(caller, priority);
    store.insert(&job, b"input", None).await.unwrap();
    job
}
