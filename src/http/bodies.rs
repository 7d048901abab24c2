//! How many large bodies of requests are in memory at once.

use axum::body::HttpBody;
use axum::extract::{Request, State};
use axum::http::header::CONTENT_ENCODING;
use axum::middleware::Next;
use axum::response::Response;

use super::app::App;
use super::bounds::SMALL_BODY;
use super::caller::Caller;

/// Lets a request with a large body wait, before any of it is read, until there is a place for it: characters as large as a body may be
/// (see [`MAX_BODY`](super::bounds::MAX_BODY)) from every connection that may be open would take all memory.
pub(super) async fn wait_for_place(
    State(app): State<App>,
    caller: Caller,
    request: Request,
    next: Next,
) -> Response {
    let compressed = request.headers().contains_key(CONTENT_ENCODING);
    let declared = request.body().size_hint().exact().filter(|_| !compressed);
    let small = declared.is_some_and(|length| length <= SMALL_BODY);
    let _place = if small { None } else { Some(app.bodies.wait(caller).await) };
    next.run(request).await
}
