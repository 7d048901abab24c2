//! What the handlers share.

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::sync::Semaphore;

use crate::jobs::Jobs;

/// The state of the router.
#[derive(Clone)]
pub(super) struct App {
    pub(super) jobs: Jobs,
    /// Simulations that may still be started.
    pub(super) simulations: Arc<Semaphore>,
    pub(super) figures: PrometheusHandle,
    /// The description of the interface.
    pub(super) openapi: Arc<serde_json::Value>,
}
