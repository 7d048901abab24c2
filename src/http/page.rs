//! The page for people, and the viewer of recordings, both served from the program itself.

use std::io::Write;
use std::sync::LazyLock;

use axum::Router;
use axum::http::header::{
    ACCEPT_ENCODING, CACHE_CONTROL, CONTENT_ENCODING, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HeaderValue,
    VARY,
};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use flate2::Compression;
use flate2::write::GzEncoder;
use re_web_viewer_server::WebViewerData;

use super::app::App;
use super::conditional::{tag, tagged};
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

/// A large file compressed, and a tag of its contents.
struct LargeFile {
    compressed: Vec<u8>,
    tag: String,
}

impl LargeFile {
    fn new(contents: &[u8]) -> std::io::Result<Self> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(contents)?;
        let compressed = encoder.finish()?;
        Ok(Self { compressed, tag: tag(&[contents]) })
    }
}

/// The viewer's files.
struct Viewer {
    data: WebViewerData,
    script: LargeFile,
    program: LargeFile,
}

static VIEWER: LazyLock<Result<Viewer, String>> = LazyLock::new(|| {
    let data = WebViewerData::load(None).map_err(|error| error.to_string())?;
    let file = |contents: &[u8]| LargeFile::new(contents).map_err(|error| error.to_string());
    Ok(Viewer { script: file(data.viewer_js())?, program: file(data.viewer_wasm())?, data })
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
    Ok(large(&headers, "text/javascript", (viewer.data.viewer_js(), &viewer.script)))
}

async fn viewer_program(headers: HeaderMap) -> Result<Response, ProblemDetails> {
    let viewer = viewer().await?;
    Ok(large(&headers, "application/wasm", (viewer.data.viewer_wasm(), &viewer.program)))
}

async fn viewer() -> Result<&'static Viewer, ProblemDetails> {
    // Some 40 MB are compressed the first time.
    let loaded = tokio::task::spawn_blocking(|| VIEWER.as_ref()).await.map_err(ServiceError::from)?;
    loaded.map_err(|error| ProblemDetails::not_found(format!("the viewer is not in this program: {error}")))
}

/// A large file of the viewer, compressed for those who can read that.
fn large(
    headers: &HeaderMap,
    media_type: &'static str,
    (contents, file): (&'static [u8], &'static LargeFile),
) -> Response {
    let accepted = headers.get_all(ACCEPT_ENCODING).iter().filter_map(|value| value.to_str().ok());
    let gzip = accepted.flat_map(|value| value.split(',')).any(|coding| {
        let (name, weight) = coding.split_once(';').unwrap_or((coding, ""));
        name.trim().eq_ignore_ascii_case("gzip") && !["q=0", "q=0.0"].contains(&weight.trim())
    });
    let contents = if gzip { file.compressed.as_slice() } else { contents };
    let mut response = tagged(headers, media_type, &file.tag, contents);
    if gzip && response.status() == StatusCode::OK {
        response.headers_mut().insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
    }
    response.headers_mut().insert(VARY, HeaderValue::from_static("accept-encoding"));
    response
}
