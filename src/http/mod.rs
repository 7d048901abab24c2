//! The REST service: routes, and what every request and answer goes through.

mod accept;
mod access;
mod accuracy;
mod app;
mod bodies;
mod bounds;
mod caller;
mod characters;
mod conditional;
mod events;
mod exports;
mod extract;
mod figures;
mod jobs;
mod limits;
mod motions;
mod openapi;
mod page;
mod problem;
mod ranges;
mod recordings;
mod responses;
mod results;
mod server;
mod silence;
mod simulations;
mod status;
mod token;

use std::io;
use std::num::NonZeroU32;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::Body;
use axum::extract::{DefaultBodyLimit, Request};
use axum::http::StatusCode;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, HeaderName, HeaderValue, X_CONTENT_TYPE_OPTIONS,
};
use axum::middleware::{from_fn, from_fn_with_state, map_request, map_response};
use axum::response::Response;
use tokio::net::TcpListener;
use tokio_util::task::AbortOnDropHandle;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::csrf::CsrfLayer;
use tower_http::decompression::RequestDecompressionLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::timeout::{TimeoutBody, TimeoutLayer};
use tower_http::trace::TraceLayer;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::jobs::Jobs;
use access::Gate;
pub use access::{AccessPolicy, AccessPolicyError, Unprotected};
use app::App;
use bounds::{BODIES, BODY_TIMEOUT, CALLER_BODIES, MAX_BODY, TIMEOUT};
pub use figures::ProcessFigures;
use limits::{Places, RequestRate};
pub use token::{TokenDigest, TokenError, Tokens};

/// How long open connections may take to end once the service shuts down.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(3);

/// Longest part of a path that is logged, bytes.
const LONGEST_PATH: usize = 256;

/// How often what is counted is brought up to date.
const UPKEEP: Duration = Duration::from_secs(5);

/// How the service is offered.
#[derive(Debug, Clone)]
pub struct HttpOptions {
    /// Who may come in.
    pub access: AccessPolicy,
    /// Requests a second that one caller may send over time; as many as they like where there is none.
    pub request_rate: Option<NonZeroU32>,
    /// Connections that may be open at once; others wait.
    pub connections: usize,
    /// Events and growing recordings that may be followed at once.
    pub streams: usize,
    /// How many of them by one caller.
    pub caller_streams: usize,
    /// Simulations that may run at once.
    pub simulations: usize,
    /// How many of them of one caller.
    pub caller_simulations: usize,
}

/// Serves `jobs` and the figures of the process on `listener` until they shut down; then waits for open connections, but not for
/// long.
///
/// # Errors
///
/// When the service cannot be set up, or the listener fails.
pub async fn serve(
    listener: TcpListener,
    jobs: Jobs,
    figures: ProcessFigures,
    options: HttpOptions,
) -> io::Result<()> {
    let (routes, description) = routes().split_for_parts();
    let openapi = openapi::complete(description, options.access.asks_for_token())?;
    offer(listener, jobs, figures, options, (routes.merge(page::router()), openapi)).await
}

/// Serves no more of a process than how it is: whether it lives, whether it is ready, and its figures.
///
/// # Errors
///
/// As [`serve`].
pub async fn serve_status(
    listener: TcpListener,
    jobs: Jobs,
    figures: ProcessFigures,
    options: HttpOptions,
) -> io::Result<()> {
    let routes = OpenApiRouter::new()
        .routes(routes!(status::alive))
        .routes(routes!(status::ready))
        .routes(routes!(status::metrics));
    let (routes, _) = routes.split_for_parts();
    offer(listener, jobs, figures, options, (routes, serde_json::Value::Null)).await
}

/// Serves these routes, with their description.
async fn offer(
    listener: TcpListener,
    jobs: Jobs,
    figures: ProcessFigures,
    options: HttpOptions,
    (routes, openapi): (Router<App>, serde_json::Value),
) -> io::Result<()> {
    let shutdown = jobs.shutdown().clone();
    let simulations = Arc::new(Places::new(options.simulations, options.caller_simulations));
    let streams = Arc::new(Places::new(options.streams, options.caller_streams));
    let bodies = Arc::new(Places::new(BODIES, CALLER_BODIES));
    let app = App { jobs, simulations, streams, bodies, figures, openapi: Arc::new(openapi) };
    let gate = Arc::new(Gate { policy: options.access, rate: options.request_rate.map(RequestRate::new) });
    let kept_up = tokio::spawn(keep_up(app.figures.clone(), Arc::clone(&gate)));
    let _kept_up = AbortOnDropHandle::new(kept_up);
    let router = layered(routes, &app, gate).with_state(app);
    let serving = server::serve(listener, router, options.connections, shutdown.clone());
    tokio::select! {
        served = serving => served,
        () = async { shutdown.cancelled().await; tokio::time::sleep(CLOSE_TIMEOUT).await } => Ok(()),
    }
}

/// Keeps what is counted from growing without end: figures that nobody fetches, and callers that have left.
async fn keep_up(figures: ProcessFigures, gate: Arc<Gate>) {
    loop {
        tokio::time::sleep(UPKEEP).await;
        figures.keep_up();
        if let Some(rate) = &gate.rate {
            rate.forget_silent();
        }
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
        .routes(routes!(recordings::recording))
        .routes(routes!(results::motion))
        .routes(routes!(results::motions))
        .routes(routes!(motions::motion))
        .routes(routes!(motions::gait))
        .routes(routes!(exports::glb))
        .routes(routes!(exports::bvh))
        .routes(routes!(exports::csv))
        .routes(routes!(exports::ros))
        .routes(routes!(exports::mujoco))
        .routes(routes!(exports::repertoire))
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
fn layered(routes: Router<App>, app: &App, gate: Arc<Gate>) -> Router<App> {
    routes
        .layer(CompressionLayer::new().compress_when(conditional::is_text))
        // The handlers bound what they read, which is what comes out.
        .layer(RequestDecompressionLayer::new())
        .layer(DefaultBodyLimit::max(MAX_BODY))
        .layer(map_request(bound_body))
        .layer(from_fn_with_state(app.clone(), bodies::wait_for_place))
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, TIMEOUT))
        .layer(CsrfLayer::new())
        .layer(CatchPanicLayer::custom(problem::of_panic))
        .layer(from_fn_with_state(gate, access::check))
        .layer(from_fn(figures::observe))
        .layer(from_fn(problem::describe_errors))
        .layer(map_response(add_security_headers))
        .layer(PropagateRequestIdLayer::x_request_id())
        .layer(TraceLayer::new_for_http().make_span_with(span).on_request(()).on_response(()).on_failure(()))
        .layer(SetRequestIdLayer::x_request_id(MakeRequestUuid))
        .layer(map_request(access::bound_request_id))
}

/// Gives up a body that stops coming.
async fn bound_body(request: Request) -> Request {
    request.map(|body| Body::new(TimeoutBody::new(BODY_TIMEOUT, body)))
}

/// The policy of what is no page: diagrams keep their styles, nothing else is loaded or run.
const INERT: &str = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox";

/// Headers of every answer: no guessing of types, no caching unless the handler allows it, and nothing of what somebody has posted
/// runs in the service's name when a browser opens it (XML may contain scripts).
async fn add_security_headers(mut response: Response) -> Response {
    let headers = response.headers_mut();
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.entry(CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    headers.entry(CONTENT_SECURITY_POLICY).or_insert(HeaderValue::from_static(INERT));
    response
}

/// The span in which a request is logged.
fn span(request: &Request) -> tracing::Span {
    let id = request.headers().get(HeaderName::from_static("x-request-id"));
    let request_id = id.and_then(|id| id.to_str().ok()).unwrap_or_default();
    let (method, path) = (request.method(), request.uri().path());
    let path = path.get(..LONGEST_PATH).unwrap_or(path);
    tracing::info_span!("request", request_id, %method, path, caller = tracing::field::Empty)
}
