//! How the service itself is.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};

use super::app::App;
use super::problem::ProblemDetails;
use super::responses::NotReady;
use crate::jobs::JobState;

/// Retry-After of a service that is not ready, s.
const READY_RETRY: u32 = 5;

/// Liveness: the process answers.
#[utoipa::path(
    get, path = "/healthz", tag = "service",
    responses((status = 200, description = "Alive", content_type = "text/plain", body = String)))]
pub(super) async fn alive() -> &'static str {
    "ok\n"
}

/// Readiness: jobs are taken and worked at, and store and files can be written.
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
    Ok(([(CONTENT_TYPE, "text/plain; version=0.0.4")], app.figures.text()).into_response())
}

/// The description of this interface.
#[utoipa::path(
    get, path = "/openapi.json", tag = "service",
    responses((status = 200, description = "OpenAPI 3.1", body = ref("#/components/schemas/AnyObject"))))]
pub(super) async fn openapi(State(app): State<App>) -> Json<serde_json::Value> {
    Json((*app.openapi).clone())
}
