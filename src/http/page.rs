//! The page for people, and the viewer of recordings, both served from the program itself.

use std::io::Write;
use std::sync::LazyLock;

use axum::Router;
use axum::http::header::{ACCEPT_ENCODING, CONTENT_ENCODING, CONTENT_SECURITY_POLICY, HeaderValue, VARY};
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

/// A file of the folder `static` or `examples` that is served, with its address there.
macro_rules! file {
    ($folder:literal, $name:literal at $address:literal) => {
        ($address, $name, include_bytes!(concat!("../../", $folder, "/", $name)))
    };
    ($name:literal) => {
        (concat!("/", $name), $name, include_bytes!(concat!("../../static/", $name)))
    };
}

/// Address, name and contents of every file of the page.
const FILES: &[(&str, &str, &[u8])] = &[
    file!("static", "index.html" at "/"),
    file!("style.css"),
    file!("app.js"),
    file!("modules/aim.js"),
    file!("modules/api.js"),
    file!("modules/arrow.js"),
    file!("modules/character.js"),
    file!("modules/curve.js"),
    file!("modules/dial.js"),
    file!("modules/dom.js"),
    file!("modules/downloads.js"),
    file!("modules/findings.js"),
    file!("modules/footfalls.js"),
    file!("modules/job.js"),
    file!("modules/jobs.js"),
    file!("modules/model.js"),
    file!("modules/motion.js"),
    file!("modules/orbit.js"),
    file!("modules/player.js"),
    file!("modules/price.js"),
    file!("modules/progress.js"),
    file!("modules/quaternion.js"),
    file!("modules/question.js"),
    file!("modules/repertoire.js"),
    file!("modules/settings.js"),
    file!("modules/shaders.js"),
    file!("modules/stage.js"),
    file!("modules/storage.js"),
    file!("modules/upload.js"),
    file!("modules/verdict.js"),
    file!("vendor/ogl/core/Camera.js"),
    file!("vendor/ogl/core/Geometry.js"),
    file!("vendor/ogl/core/Mesh.js"),
    file!("vendor/ogl/core/Program.js"),
    file!("vendor/ogl/core/Renderer.js"),
    file!("vendor/ogl/core/Transform.js"),
    file!("vendor/ogl/math/Euler.js"),
    file!("vendor/ogl/math/Mat3.js"),
    file!("vendor/ogl/math/Mat4.js"),
    file!("vendor/ogl/math/Quat.js"),
    file!("vendor/ogl/math/Vec3.js"),
    file!("vendor/ogl/math/functions/EulerFunc.js"),
    file!("vendor/ogl/math/functions/Mat3Func.js"),
    file!("vendor/ogl/math/functions/Mat4Func.js"),
    file!("vendor/ogl/math/functions/QuatFunc.js"),
    file!("vendor/ogl/math/functions/Vec3Func.js"),
    file!("vendor/ogl/math/functions/Vec4Func.js"),
    file!("examples", "quadruped.urdf" at "/characters/quadruped.urdf"),
    file!("examples", "biped.urdf" at "/characters/biped.urdf"),
    file!("examples", "runner.urdf" at "/characters/runner.urdf"),
    file!("examples", "hexapod.json" at "/characters/hexapod.json"),
    file!("examples", "spider.json" at "/characters/spider.json"),
    file!("examples", "snake.json" at "/characters/snake.json"),
    file!("examples", "pantograph.json" at "/characters/pantograph.json"),
    file!("static", "viewer.html" at "/viewer/"),
    file!("static", "viewer.js" at "/viewer/start.js"),
];

/// A file of the program, and a tag for it by its contents.
#[derive(Debug)]
struct Asset {
    address: &'static str,
    media_type: &'static str,
    contents: &'static [u8],
    tag: String,
}

static ASSETS: LazyLock<Vec<Asset>> = LazyLock::new(|| {
    let asset = |&(address, name, contents): &(&'static str, &str, &'static [u8])| {
        let media_type = match name.rsplit('.').next() {
            Some("html") => "text/html; charset=utf-8",
            Some("css") => "text/css; charset=utf-8",
            Some("js") => "text/javascript; charset=utf-8",
            Some("json") => "application/json",
            _ => "application/xml",
        };
        Asset { address, media_type, contents, tag: tag(&[contents]) }
    };
    FILES.iter().map(asset).collect()
});

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

/// The page at `/`, the bundled characters under `/characters/`, and the viewer at `/viewer/`.
pub(super) fn router() -> Router<App> {
    let viewer = Router::new()
        .route("/viewer/re_viewer.js", get(viewer_script))
        .route("/viewer/re_viewer_bg.wasm", get(viewer_program));
    ASSETS.iter().fold(viewer, |router, asset| {
        router.route(asset.address, get(move |headers: HeaderMap| async move { asset.answer(&headers) }))
    })
}

impl Asset {
    fn answer(&'static self, headers: &HeaderMap) -> Response {
        let answer = tagged(headers, self.media_type, &self.tag, self.contents);
        ([(CONTENT_SECURITY_POLICY, POLICY)], answer).into_response()
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
