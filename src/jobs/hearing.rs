//! Hears what other processes do that share the store.

use std::sync::Arc;
use std::time::Duration;

use uuid::Uuid;

use super::lease;
use super::service::{Jobs, Shared};
use super::store::{Happened, Listener, StoreError};

/// Time between two attempts to listen.
const AGAIN: Duration = Duration::from_secs(1);

/// Listens until the service shuts down, where anybody can be heard.
pub(super) async fn hear(jobs: Jobs) {
    let shared = jobs.shared();
    while !shared.shutdown.is_cancelled() {
        let heard = tokio::select! {
            () = shared.shutdown.cancelled() => return,
            heard = shared.store.listen() => heard,
        };
        match heard {
            Ok(None) => return,
            Ok(Some(listener)) => {
                // Anything may have happened before.
                shared.posted.notify_one();
                let error = tokio::select! {
                    () = shared.shutdown.cancelled() => return,
                    error = follow(shared, listener) => error,
                };
                tracing::warn!(%error, "what others do is no longer heard; it is looked for instead");
            }
            Err(error) => tracing::warn!(%error, "what others do cannot be heard; it is looked for instead"),
        }
        tokio::time::sleep(AGAIN).await;
    }
}

async fn follow(shared: &Arc<Shared>, mut listener: Listener) -> StoreError {
    loop {
        match listener.next().await {
            Ok((id, happened)) => react(shared, id, happened).await,
            Err(error) => return error,
        }
    }
}

async fn react(shared: &Arc<Shared>, id: Uuid, happened: Happened) {
    match happened {
        Happened::Queued => shared.posted.notify_one(),
        Happened::Unwanted => {
            if let Some(live) = shared.running.get(id) {
                lease::look(&shared.store, &live).await;
            }
        }
        Happened::Changed => {}
    }
    shared.changed(id);
}
