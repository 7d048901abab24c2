//! Figures of the service, for Prometheus: what is collected, and what every request adds to them.
//!
//! What jobs add stands in [`crate::jobs`].

use std::time::Instant;

use axum::extract::{MatchedPath, Request};
use axum::http::{Method, StatusCode};
use axum::middleware::Next;
use axum::response::Response;
use metrics_exporter_prometheus::{BuildError, Matcher, PrometheusBuilder, PrometheusHandle};

use crate::jobs::{COUNTERS, HISTOGRAMS};

/// Time from a request to its answer's head.
const REQUEST_SECONDS: &str = "http_request_duration_seconds";

/// Upper ends of the buckets of request times, s: from an answer out of memory to the longest that one may take.
const REQUEST_BUCKETS: [f64; 14] =
    [0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 15.0, 60.0];

/// What this process has counted so far.
#[derive(Clone)]
pub struct ProcessFigures(PrometheusHandle);

impl ProcessFigures {
    /// Collects the figures of this process from here on: to be called before its workers start, since what happens earlier
    /// is not counted.
    ///
    /// # Errors
    ///
    /// When something else in the process collects them already.
    pub fn collect() -> Result<Self, BuildError> {
        let mut builder = PrometheusBuilder::new()
            .set_buckets_for_metric(Matcher::Full(REQUEST_SECONDS.to_owned()), &REQUEST_BUCKETS)?;
        for histogram in HISTOGRAMS {
            builder = builder
                .set_buckets_for_metric(Matcher::Full(histogram.name.to_owned()), histogram.buckets)?;
        }
        let handle = builder.install_recorder()?;
        for histogram in HISTOGRAMS {
            metrics::describe_histogram!(histogram.name, metrics::Unit::Seconds, histogram.about);
        }
        for (name, about) in COUNTERS {
            metrics::describe_counter!(name, about);
        }
        metrics::describe_gauge!("gaitwright_jobs", "Jobs by state");
        metrics::describe_counter!(
            "gaitwright_connections_ended_total",
            "Silent connections ended since the start because others needed their place"
        );
        metrics::describe_counter!("http_requests_total", "Requests answered since the start");
        metrics::describe_histogram!(REQUEST_SECONDS, metrics::Unit::Seconds, "Time to an answer's head");
        metrics::describe_gauge!("gaitwright_build_info", "The program that runs; always 1");
        metrics::gauge!("gaitwright_build_info", "version" => env!("CARGO_PKG_VERSION")).set(1.0);
        Ok(Self(handle))
    }

    /// All of it, as text that Prometheus reads.
    pub(super) fn text(&self) -> String {
        self.keep_up();
        self.0.render()
    }

    /// Keeps it from growing without end where nobody asks for it.
    pub(super) fn keep_up(&self) {
        self.0.run_upkeep();
    }
}

/// Counts a request, times its answer and logs it.
pub(super) async fn observe(request: Request, next: Next) -> Response {
    let (method, reads) = match *request.method() {
        Method::GET => ("GET", true),
        Method::HEAD => ("HEAD", true),
        Method::POST => ("POST", false),
        Method::DELETE => ("DELETE", false),
        _ => ("other", true),
    };
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let start = Instant::now();
    let response = next.run(request).await;
    let (status, taken) = (response.status(), start.elapsed());
    log(status, taken.as_secs_f64(), reads);
    let status = status.as_u16().to_string();
    metrics::counter!("http_requests_total", "method" => method, "route" => route.clone(), "status" => status)
        .increment(1);
    metrics::histogram!(REQUEST_SECONDS, "method" => method, "route" => route).record(taken);
    response
}

/// Logs an answer: what the service could not do as a warning, a change as information, and reading for those who look
/// for it.
fn log(status: StatusCode, seconds: f64, reads: bool) {
    let status = status.as_u16();
    match status {
        500.. => tracing::warn!(status, seconds, "answered"),
        _ if reads => tracing::debug!(status, seconds, "answered"),
        _ => tracing::info!(status, seconds, "answered"),
    }
}
