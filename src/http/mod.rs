//! The REST service: routes, and what every request and answer goes through.

mod accept;
mod accuracy;
mod characters;
mod events;
mod extract;
mod jobs;
mod openapi;
mod page;
mod problem;
mod ranges;
mod results;
mod simulations;
mod status;

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::extract::{DefaultBodyLimit, Request};
use axum::http::StatusCode;
use axum::http::header::{CACHE_CONTROL, HeaderName, HeaderValue, X_CONTENT_TYPE_OPTIONS};
use axum::middleware::{from_fn, map_response};
use axum::response::Response;
use axum::routing::{get, post};
use metrics_exporter_prometheus::PrometheusHandle;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::csrf::CsrfLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::timeout::TimeoutLayer;
use tower_http::trace::TraceLayer;

use crate::jobs::Jobs;

/// Greatest size of a request's body, bytes.
const MAX_BODY: usize = 32 << 20;

/// Longest time from a request's head to its answer's head.
const TIMEOUT: Duration = Duration::from_secs(60);

/// How long open connections may take to end once the service shuts down.
const FAREWELL: Duration = Duration::from_secs(3);

/// What handlers share.
#[derive(Clone)]
struct App {
    jobs: Jobs,
    /// Simulations that may still be started.
    simulations: Arc<Semaphore>,
    figures: PrometheusHandle,
    openapi: Arc<serde_json::Value>,
}

/// Serves `jobs` on `listener` until they shut down; then waits for open connections, but not for
/// long.
///
/// # Errors
///
/// When the service cannot be set up, or the listener fails.
pub async fn serve(listener: TcpListener, jobs: Jobs) -> io::Result<()> {
    let shutdown = jobs.shutdown().clone();
    let figures = status::collect().map_err(io::Error::other)?;
    let openapi = Arc::new(openapi::description()?);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let simulations = Arc::new(Semaphore::new(cores));
    let router = router(App { jobs, simulations, figures, openapi });
    let serving = axum::serve(listener, router).with_graceful_shutdown(shutdown.clone().cancelled_owned());
    tokio::select! {
        served = serving => served,
        () = async { shutdown.cancelled().await; tokio::time::sleep(FAREWELL).await } => Ok(()),
    }
}

/// Every route of the service.
fn router(app: App) -> Router {
    Router::new()
        .route("/v1/jobs", post(jobs::submit).get(jobs::list))
        .route("/v1/jobs/{id}", get(jobs::show).delete(jobs::remove))
        .route("/v1/jobs/{id}/events", get(events::events))
        .route("/v1/jobs/{id}/recording.rrd", get(results::recording))
        .route("/v1/jobs/{id}/motion", get(results::motion))
        .route("/v1/jobs/{id}/gait", get(results::gait))
        .route("/v1/jobs/{id}/gait.svg", get(results::diagram))
        .route("/v1/jobs/{id}/curve", get(results::curve))
        .route("/v1/jobs/{id}/report", get(results::report))
        .route("/v1/jobs/{id}/table", get(results::table))
        .route("/v1/jobs/{id}/front.svg", get(results::front))
        .route("/v1/characters", post(characters::add))
        .route("/v1/characters/{id}", get(characters::show))
        .route("/v1/schemas/character", get(characters::character_schema))
        .route("/v1/simulations", post(simulations::simulate))
        .route("/v1/accuracy", post(accuracy::submit))
        .route("/healthz", get(status::alive))
        .route("/readyz", get(status::ready))
        .route("/metrics", get(status::metrics))
        .route("/openapi.json", get(status::openapi))
        .merge(page::router())
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, TIMEOUT))
        .layer(CsrfLayer::new())
        .layer(CatchPanicLayer::custom(problem::of_panic))
        .layer(from_fn(status::count))
        .layer(from_fn(problem::everywhere))
        .layer(map_response(harden))
        .layer(PropagateRequestIdLayer::x_request_id())
        .layer(TraceLayer::new_for_http().make_span_with(span))
        .layer(SetRequestIdLayer::x_request_id(MakeRequestUuid))
        .with_state(app)
}

/// Headers of every answer: no guessing of types, and no caching unless the handler allows it.
async fn harden(mut response: Response) -> Response {
    let headers = response.headers_mut();
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.entry(CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}

/// The span in which a request is logged.
fn span(request: &Request) -> tracing::Span {
    let id = request.headers().get(HeaderName::from_static("x-request-id"));
    let id = id.and_then(|id| id.to_str().ok()).unwrap_or_default();
    tracing::info_span!("request", id, method = %request.method(), path = request.uri().path())
}
