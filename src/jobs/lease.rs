//! The lease of a job that runs here: renewed, or only looked at.

use std::time::{Duration, Instant};

use super::live::Live;
use super::store::{Holding, Store};

/// Renews the lease of a job that runs here, and has its worker know what has become of its hold on it.
pub(super) async fn renew(store: &Store, live: &Live, lease: Duration) {
    let now = Instant::now();
    match store.renew(live.claim(), lease).await {
        Ok(holding) => {
            live.renew(now);
            obey(live, holding);
        }
        // It is tried again at the next look, long before the lease is over.
        Err(error) => tracing::error!(%error, "a lease could not be renewed"),
    }
}

/// Has the worker of a job that runs here know what has become of its hold on it.
pub(super) async fn look(store: &Store, live: &Live) {
    match store.holding(live.claim()).await {
        Ok(holding) => obey(live, holding),
        Err(error) => tracing::error!(%error, "it is not known whether a job is still wanted"),
    }
}

fn obey(live: &Live, holding: Holding) {
    match holding {
        Holding::Held => {}
        Holding::Unwanted => live.abandon(),
        Holding::Lost => live.lose(),
    }
}
