//! A file, or the part of it that a client asks for (RFC 9110, section 14).

use std::path::Path;

use axum::body::Body;
use axum::extract::Request;
use axum::http::header::{ETAG, IF_RANGE, LAST_MODIFIED, RANGE};
use axum::http::{HeaderMap, HeaderValue, Method};
use axum::response::{IntoResponse, Response};
use tower::ServiceExt;
use tower_http::services::ServeFile;

/// Answers `request` with the file at `path`, whole unless it asks for one range of bytes of the very file that is
/// there. What is no such range is passed over, as the standard has it.
pub(super) async fn serve(path: &Path, mut request: Request) -> Response {
    let method = request.method().clone();
    let condition = request.headers_mut().remove(IF_RANGE);
    if let Some(range) = request.headers_mut().remove(RANGE) {
        let range = range.to_str().ok().and_then(single);
        let applies = method == Method::GET
            && match condition {
                Some(validator) => names(&validator, answer(path, head()).await.headers()),
                None => true,
            };
        if let (Some(range), true) = (range, applies) {
            request.headers_mut().insert(RANGE, range);
        }
    }
    answer(path, request).await
}

async fn answer(path: &Path, request: Request) -> Response {
    match ServeFile::new(path).oneshot(request).await {
        Ok(response) => response.into_response(),
        Err(never) => match never {},
    }
}

/// Asks for nothing but the headers.
fn head() -> Request {
    let mut request = Request::new(Body::empty());
    *request.method_mut() = Method::HEAD;
    request
}

/// Whether the validator of `If-Range` is that of the file with the given headers: its tag, or the time of its last
/// change. A weak tag names no bytes.
fn names(validator: &HeaderValue, file: &HeaderMap) -> bool {
    let own = if validator.as_bytes().starts_with(b"\"") { ETAG } else { LAST_MODIFIED };
    file.get(own) == Some(validator)
}

/// The one range of bytes in a header, written without anything optional; `None` for other units, several ranges and
/// what is no range.
fn single(header: &str) -> Option<HeaderValue> {
    let (unit, range) = header.split_once('=')?;
    let (first, last) = range.trim().split_once('-')?;
    if !unit.trim().eq_ignore_ascii_case("bytes") || (first.is_empty() && last.is_empty()) {
        return None;
    }
    let (first, last) = (position(first)?, position(last)?);
    if matches!((first, last), (Some(first), Some(last)) if first > last) {
        return None;
    }
    let written = |position: Option<u64>| position.map(|position| position.to_string()).unwrap_or_default();
    HeaderValue::from_str(&format!("bytes={}-{}", written(first), written(last))).ok()
}

/// A position in a file, or none where nothing is written; `None` for what is no number. One that is beyond every file
/// stays beyond.
fn position(digits: &str) -> Option<Option<u64>> {
    if digits.is_empty() {
        return Some(None);
    }
    digits.bytes().all(|digit| digit.is_ascii_digit()).then(|| Some(digits.parse().unwrap_or(u64::MAX)))
}
