//! The REST service: routes, and what every request and answer goes through.

mod accept;
mod access;
mod accuracy;
mod app;
mod characters;
mod conditional;
mod events;
mod exports;
mod extract;
mod jobs;
mod motions;
mod openapi;
mod page;
mod problem;
mod ranges;
mod responses;
mod results;
mod server;
mod simulations;
mod status;

use std::io;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::{DefaultBodyLimit, Request};
use axum::http::StatusCode;
use axum::http::header::{CACHE_CONTROL, HeaderName, HeaderValue, X_CONTENT_TYPE_OPTIONS};
use axum::middleware::{from_fn, from_fn_with_state, map_request, map_response};
use axum::response::Response;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::csrf::CsrfLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::timeout::{TimeoutBody, TimeoutLayer};
use tower_http::trace::TraceLayer;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::jobs::Jobs;
pub use access::{AccessPolicy, AccessPolicyError, Unprotected};
use app::App;

/// Greatest size of a request's body, bytes.
const MAX_BODY: usize = 32 << 20;

/// Longest time from a request's head to its answer's head.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Longest silence while a request's body is sent.
const BODY_TIMEOUT: Duration = Duration::from_secs(15);

/// How long open connections may take to end once the service shuts down.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(3);

/// How the service is offered.
#[derive(Debug, Clone)]
pub struct HttpOptions {
    /// Who may come in.
    pub access: AccessPolicy,
    /// Connections that may be open at once; others wait.
    pub connections: usize,
    /// Events and growing recordings that may be followed at once.
    pub streams: usize,
}

/// Serves `jobs` on `listener` until they shut down; then waits for open connections, but not for
/// long.
///
/// # Errors
///
/// When the service cannot be set up, or the listener fails.
pub async fn serve(listener: TcpListener, jobs: Jobs, options: HttpOptions) -> io::Result<()> {
    let shutdown = jobs.shutdown().clone();
    let figures = status::collect().map_err(io::Error::other)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let simulations = Arc::new(Semaphore::new(cores));
    let streams = Arc::new(Semaphore::new(options.streams));
    let (routes, description) = routes().split_for_parts();
    let openapi = Arc::new(openapi::complete(description)?);
    let app = App { jobs, simulations, streams, figures, openapi };
    let router = layered(routes.merge(page::router()), options.access).with_state(app);
    let serving = server::serve(listener, router, options.connections, shutdown.clone());
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
        .routes(routes!(results::motions))
        .routes(routes!(motions::motion))
        .routes(routes!(motions::gait))
        .routes(routes!(exports::glb))
        .routes(routes!(exports::bvh))
        .routes(routes!(exports::csv))
        .routes(routes!(exports::ros))
        .routes(routes!(exports::mujoco))
        .routes(routes!(results::gait))
        .routes(routes!(results::diagram))
        .routes(routes!(results::curve))
        .routes(routes!(results::report))
        .routes(routes!(results::table))
        .routes(routes!(results::front))
        .routes(routes!(characters::add, characters::list))
        .routes(routes!(characters::show, characters::delete))
        .routes(routes!(characters::file))
        .routes(routes!(characters::standing))
        .routes(routes!(characters::of_job))
        .routes(routes!(characters::character_schema))
        .routes(routes!(simulations::simulate))
        .routes(routes!(accuracy::submit))
        .routes(routes!(status::alive))
        .routes(routes!(status::ready))
        .routes(routes!(status::metrics))
        .routes(routes!(status::openapi))
}

/// What every request and every answer goes through, the innermost first.
fn layered(routes: Router<App>, access: AccessPolicy) -> Router<App> {
    routes
        .layer(CompressionLayer::new().compress_when(conditional::is_text))
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(map_request(bound_body))
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, TIMEOUT))
        .layer(CsrfLayer::new())
        .layer(CatchPanicLayer::custom(problem::of_panic))
        .layer(from_fn_with_state(Arc::new(access), access::check))
        .layer(from_fn(status::count))
        .layer(from_fn(problem::describe_errors))
        .layer(map_response(add_security_headers))
        .layer(PropagateRequestIdLayer::x_request_id())
        .layer(TraceLayer::new_for_http().make_span_with(span))
        .layer(SetRequestIdLayer::x_request_id(MakeRequestUuid))
        .layer(map_request(access::bound_request_id))
}

/// Gives up a body that stops coming.
async fn bound_body(request: Request) -> Request {
    request.map(|body| Body::new(TimeoutBody::new(BODY_TIMEOUT, body)))
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
