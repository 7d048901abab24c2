//! The page for people, and the viewer of recordings, both served from the program itself.

use std::sync::LazyLock;

use axum::Router;
use axum::http::header::{CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use re_web_viewer_server::WebViewerData;
use sha2::{Digest, Sha256};

use super::app::App;
use super::problem::ProblemDetails;
use crate::jobs::ServiceError;

/// A file of the program.
#[derive(Debug, Clone, Copy)]
struct Asset {
    media_type: &'static str,
    contents: &'static [u8],
}

const PAGE: Asset =
    Asset { media_type: "text/html; charset=utf-8", contents: include_bytes!("../../static/index.html") };
const STYLE: Asset =
    Asset { media_type: "text/css; charset=utf-8", contents: include_bytes!("../../static/style.css") };
const SCRIPT: Asset =
    Asset { media_type: "text/javascript; charset=utf-8", contents: include_bytes!("../../static/app.js") };
const VIEWER_PAGE: Asset =
    Asset { media_type: "text/html; charset=utf-8", contents: include_bytes!("../../static/viewer.html") };
const VIEWER_START: Asset = Asset {
    media_type: "text/javascript; charset=utf-8",
    contents: include_bytes!("../../static/viewer.js"),
};

/// Nothing comes from elsewhere; the viewer is WebAssembly and sets styles from its code.
const POLICY: &str = "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; \
    style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; frame-ancestors 'self'";

/// The viewer's files, and a tag for each by its contents.
struct Viewer {
    data: WebViewerData,
    script_tag: String,
    program_tag: String,
}

static VIEWER: LazyLock<Result<Viewer, String>> = LazyLock::new(|| {
    let data = WebViewerData::load(None).map_err(|error| error.to_string())?;
    let (script_tag, program_tag) = (tag(data.viewer_js()), tag(data.viewer_wasm()));
    Ok(Viewer { data, script_tag, program_tag })
});

/// The page at `/` and the viewer at `/viewer/`.
pub(super) fn router() -> Router<App> {
    let file = |asset: Asset| get(move || async move { asset.into_response() });
    Router::new()
        .route("/", file(PAGE))
        .route("/style.css", file(STYLE))
        .route("/app.js", file(SCRIPT))
        .route("/viewer/", file(VIEWER_PAGE))
        .route("/viewer/start.js", file(VIEWER_START))
        .route("/viewer/re_viewer.js", get(viewer_script))
        .route("/viewer/re_viewer_bg.wasm", get(viewer_program))
}

impl IntoResponse for Asset {
    fn into_response(self) -> Response {
        let headers =
            [(CONTENT_TYPE, self.media_type), (CONTENT_SECURITY_POLICY, POLICY), (CACHE_CONTROL, "no-cache")];
        (headers, self.contents).into_response()
    }
}

async fn viewer_script(headers: HeaderMap) -> Result<Response, ProblemDetails> {
    let viewer = viewer().await?;
    Ok(tagged(&headers, "text/javascript", &viewer.script_tag, viewer.data.viewer_js()))
}

async fn viewer_program(headers: HeaderMap) -> Result<Response, ProblemDetails> {
    let viewer = viewer().await?;
    Ok(tagged(&headers, "application/wasm", &viewer.program_tag, viewer.data.viewer_wasm()))
}

async fn viewer() -> Result<&'static Viewer, ProblemDetails> {
    // The tags of some 40 MB are computed the first time.
    let loaded = tokio::task::spawn_blocking(|| VIEWER.as_ref()).await.map_err(ServiceError::from)?;
    loaded.map_err(|error| ProblemDetails::not_found(format!("the viewer is not in this program: {error}")))
}

/// A large file that a browser may keep as long as its tag stays the same.
fn tagged(
    headers: &HeaderMap,
    media_type: &'static str,
    tag: &'static str,
    contents: &'static [u8],
) -> Response {
    let kept = [(ETAG, tag), (CACHE_CONTROL, "no-cache")];
    if headers.get(IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes()) {
        return (StatusCode::NOT_MODIFIED, kept).into_response();
    }
    (kept, [(CONTENT_TYPE, media_type)], contents).into_response()
}

fn tag(contents: &[u8]) -> String {
    let digest = Sha256::digest(contents);
    let digits: String = digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    format!("\"{digits}\"")
}
