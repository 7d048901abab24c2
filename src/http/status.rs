//! How the service itself is.

use axum::Json;
use axum::extract::{MatchedPath, Request, State};
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use metrics_exporter_prometheus::{BuildError, PrometheusBuilder, PrometheusHandle};
use std::time::Instant;

use super::app::App;
use super::problem::ProblemDetails;
use super::responses::NotReady;
use crate::jobs::JobState;

/// Retry-After of a service that is not ready, s.
const READY_RETRY: u32 = 5;

/// Collects figures from here on, to be shown by [`metrics()`].
///
/// # Errors
///
/// When something else in the process collects them already.
pub(super) fn collect() -> Result<PrometheusHandle, BuildError> {
    let handle = PrometheusBuilder::new().install_recorder()?;
    metrics::describe_gauge!("gaitwright_jobs", "Jobs by state");
    metrics::describe_counter!("gaitwright_jobs_posted_total", "Jobs queued since the start");
    metrics::describe_counter!(
        "gaitwright_jobs_ended_total",
        "Jobs ended since the start, by their last state"
    );
    metrics::describe_counter!("gaitwright_generations_total", "Generations evaluated since the start");
    metrics::describe_counter!("http_requests_total", "Requests answered since the start");
    metrics::describe_histogram!(
        "http_request_duration_seconds",
        metrics::Unit::Seconds,
        "Time to an answer's head"
    );
    Ok(handle)
}

/// Liveness: the process answers.
#[utoipa::path(
    get, path = "/healthz", tag = "service",
    responses((status = 200, description = "Alive", content_type = "text/plain", body = String)))]
pub(super) async fn alive() -> &'static str {
    "ok\n"
}

/// Readiness: jobs are taken and worked at, and the data folder can be written.
#[utoipa::path(
    get, path = "/readyz", tag = "service",
    responses(
        (status = 200, description = "Ready", content_type = "text/plain", body = String),
        NotReady))]
pub(super) async fn ready(State(app): State<App>) -> Result<&'static str, ProblemDetails> {
    match app.jobs.ready().await {
        Ok(()) => Ok("ready\n"),
        Err(error) => {
            Err(ProblemDetails::new(StatusCode::SERVICE_UNAVAILABLE, error.to_string())
                .retry_after(READY_RETRY))
        }
    }
}

/// Figures for Prometheus.
#[utoipa::path(
    get, path = "/metrics", tag = "service",
    responses((status = 200, description = "Prometheus text format", content_type = "text/plain", body = String)))]
pub(super) async fn metrics(State(app): State<App>) -> Result<Response, ProblemDetails> {
    for state in JobState::ALL {
        let jobs = app.jobs.count(state).await?;
        metrics::gauge!("gaitwright_jobs", "state" => state.name()).set(jobs as f64);
    }
    app.figures.run_upkeep();
    Ok(([(CONTENT_TYPE, "text/plain; version=0.0.4")], app.figures.render()).into_response())
}

/// The description of this interface.
#[utoipa::path(
    get, path = "/openapi.json", tag = "service",
    responses((status = 200, description = "OpenAPI 3.1", body = ref("#/components/schemas/AnyObject"))))]
pub(super) async fn openapi(State(app): State<App>) -> Json<serde_json::Value> {
    Json((*app.openapi).clone())
}

/// Counts a request and times its answer.
pub(super) async fn count(request: Request, next: Next) -> Response {
    let method = match *request.method() {
        axum::http::Method::GET => "GET",
        axum::http::Method::HEAD => "HEAD",
        axum::http::Method::POST => "POST",
        axum::http::Method::DELETE => "DELETE",
        _ => "other",
    };
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let start = Instant::now();
    let response = next.run(request).await;
    let status = response.status().as_u16().to_string();
    metrics::counter!("http_requests_total", "method" => method, "route" => route.clone(), "status" => status)
        .increment(1);
    metrics::histogram!("http_request_duration_seconds", "method" => method, "route" => route)
        .record(start.elapsed());
    response
}
