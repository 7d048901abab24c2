//! What the handlers share.

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::problem::ProblemDetails;
use crate::jobs::Jobs;

/// The state of the router.
#[derive(Clone)]
pub(super) struct App {
    pub(super) jobs: Jobs,
    /// Simulations that may still be started.
    pub(super) simulations: Arc<Semaphore>,
    /// Events and growing recordings that may still be followed.
    pub(super) streams: Arc<Semaphore>,
    pub(super) figures: PrometheusHandle,
    /// The description of the interface.
    pub(super) openapi: Arc<serde_json::Value>,
}

impl App {
    /// A place among those who follow something, for as long as it is kept.
    pub(super) fn stream(&self) -> Result<OwnedSemaphorePermit, ProblemDetails> {
        let place = Arc::clone(&self.streams).try_acquire_owned();
        place.map_err(|_| ProblemDetails::crowded("as many streams are followed as may be at once"))
    }
}
