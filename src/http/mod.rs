//! The REST service: routes, and what every request and answer goes through.

mod accept;
mod accuracy;
mod app;
mod characters;
mod events;
mod extract;
mod jobs;
mod openapi;
mod page;
mod problem;
mod ranges;
mod responses;
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
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::csrf::CsrfLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::timeout::TimeoutLayer;
use tower_http::trace::TraceLayer;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::jobs::Jobs;
use app::App;

/// Greatest size of a request's body, bytes.
const MAX_BODY: usize = 32 << 20;

/// Longest time from a request's head to its answer's head.
const TIMEOUT: Duration = Duration::from_secs(60);

/// How long open connections may take to end once the service shuts down.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(3);

/// Serves `jobs` on `listener` until they shut down; then waits for open connections, but not for
/// long.
///
/// # Errors
///
/// When the service cannot be set up, or the listener fails.
pub async fn serve(listener: TcpListener, jobs: Jobs) -> io::Result<()> {
    let shutdown = jobs.shutdown().clone();
    let figures = status::collect().map_err(io::Error::other)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let simulations = Arc::new(Semaphore::new(cores));
    let (routes, description) = routes().split_for_parts();
    let openapi = Arc::new(openapi::complete(description)?);
    let router =
        layered(routes.merge(page::router())).with_state(App { jobs, simulations, figures, openapi });
    let serving = axum::serve(listener, router).with_graceful_shutdown(shutdown.clone().cancelled_owned());
    tokio::select! {
        served = serving => served,
        () = async { shutdown.cancelled().await; tokio::time::sleep(CLOSE_TIMEOUT).await } => Ok(()),
    }
}

/// Every call of the interface. Its path, its method and its description stand at its handler.
fn routes() -> OpenApiRouter<App> {
    OpenApiRouter::with_openapi(openapi::introduction())
        .routes(routes!(jobs::submit, jobs::list))
        .routes(routes!(jobs::show, jobs::delete))
        .routes(routes!(jobs::cancel))
        .routes(routes!(jobs::retry))
        .routes(routes!(events::events))
        .routes(routes!(results::recording))
        .routes(routes!(results::motion))
        .routes(routes!(results::gait))
        .routes(routes!(results::diagram))
        .routes(routes!(results::curve))
        .routes(routes!(results::report))
        .routes(routes!(results::table))
        .routes(routes!(results::front))
        .routes(routes!(characters::add))
        .routes(routes!(characters::show))
        .routes(routes!(characters::character_schema))
        .routes(routes!(simulations::simulate))
        .routes(routes!(accuracy::submit))
        .routes(routes!(status::alive))
        .routes(routes!(status::ready))
        .routes(routes!(status::metrics))
        .routes(routes!(status::openapi))
}

/// What every request and every answer goes through, the innermost first.
fn layered(routes: Router<App>) -> Router<App> {
    routes
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, TIMEOUT))
        .layer(CsrfLayer::new())
        .layer(CatchPanicLayer::custom(problem::of_panic))
        .layer(from_fn(status::count))
        .layer(from_fn(problem::describe_errors))
        .layer(map_response(add_security_headers))
        .layer(PropagateRequestIdLayer::x_request_id())
        .layer(TraceLayer::new_for_http().make_span_with(span))
        .layer(SetRequestIdLayer::x_request_id(MakeRequestUuid))
}

/// Headers of every answer: no guessing of types, and no caching unless the handler allows it.
async fn add_security_headers(mut response: Response) -> Response {
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
