//! A file, or the part of it that a client asks for (RFC 9110, section 14).

use std::io;
use std::ops::Range;
use std::path::Path;
use std::time::SystemTime;

use axum::body::Body;
use axum::extract::Request;
use axum::http::header::{
    ACCEPT_RANGES, CONTENT_LENGTH, CONTENT_RANGE, CONTENT_TYPE, ETAG, HeaderName, IF_MATCH,
    IF_MODIFIED_SINCE, IF_NONE_MATCH, IF_RANGE, IF_UNMODIFIED_SINCE, LAST_MODIFIED, RANGE,
};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use httpdate::HttpDate;
use tower::ServiceExt;
use tower_http::services::ServeFile;

use super::conditional::is_known;
use crate::jobs::Joined;

/// A position beyond every file, with digits that every reader of ranges takes.
const BEYOND: u64 = 999_999_999_999_999_999;

/// Bytes of a file in an object store that are fetched at once.
pub(super) const CHUNK: u64 = 1 << 20;

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

/// Answers `request` with a file in an object store, in the same way.
pub(super) fn serve_joined(joined: Joined, request: &Request) -> Response {
    let length = joined.length();
    let mut headers = HeaderMap::new();
    headers.insert(CONTENT_TYPE, HeaderValue::from_static("application/octet-stream"));
    headers.insert(ACCEPT_RANGES, HeaderValue::from_static("bytes"));
    let tag = format!("\"{}\"", joined.tag());
    for (name, value) in [(ETAG, tag.clone()), (LAST_MODIFIED, HttpDate::from(joined.modified()).to_string())]
    {
        if let Ok(value) = HeaderValue::from_str(&value) {
            headers.insert(name, value);
        }
    }
    if let Some(status) = instead_of_sending(request.headers(), &tag, joined.modified()) {
        return (status, headers).into_response();
    }
    let asked = request.headers().get(RANGE).and_then(|range| single(range.to_str().ok()?));
    let applies = request.method() == Method::GET
        && request.headers().get(IF_RANGE).is_none_or(|validator| names(validator, &headers));
    let (status, range) = match asked.filter(|_| applies) {
        None => (StatusCode::OK, 0..length),
        Some(asked) => match within(&asked, length) {
            Some(range) => (StatusCode::PARTIAL_CONTENT, range),
            None => {
                headers.insert(CONTENT_RANGE, content_range(&format!("*/{length}")));
                return (StatusCode::RANGE_NOT_SATISFIABLE, headers).into_response();
            }
        },
    };
    if status == StatusCode::PARTIAL_CONTENT {
        let written = format!("{}-{}/{length}", range.start, range.end - 1);
        headers.insert(CONTENT_RANGE, content_range(&written));
    }
    headers.insert(CONTENT_LENGTH, HeaderValue::from(range.end - range.start));
    let body = match *request.method() {
        Method::HEAD => Body::empty(),
        _ => Body::from_stream(stream::try_unfold(range, move |left: Range<u64>| {
            let joined = joined.clone();
            async move {
                if left.is_empty() {
                    return Ok(None);
                }
                let chunk = joined.read(left.start..left.end.min(left.start + CHUNK)).await?;
                if chunk.is_empty() {
                    return Err(io::Error::from(io::ErrorKind::UnexpectedEof));
                }
                let left = left.start + chunk.len() as u64..left.end;
                Ok(Some((chunk, left)))
            }
        })),
    };
    (status, headers, body).into_response()
}

/// The status with which a file of this tag that was `modified` then is not sent, for the conditions of a request (RFC 9110, section
/// 13.2.2): it is another than the client has in mind, or the one that it has already.
fn instead_of_sending(headers: &HeaderMap, tag: &str, modified: SystemTime) -> Option<StatusCode> {
    let modified = HttpDate::from(modified);
    let date = |name: HeaderName| headers.get(name)?.to_str().ok()?.parse::<HttpDate>().ok();
    if headers.contains_key(IF_MATCH) {
        let values = headers.get_all(IF_MATCH).iter().filter_map(|value| value.to_str().ok());
        if !values.flat_map(|value| value.split(',')).any(|known| ["*", tag].contains(&known.trim())) {
            return Some(StatusCode::PRECONDITION_FAILED);
        }
    } else if date(IF_UNMODIFIED_SINCE).is_some_and(|limit| modified > limit) {
        return Some(StatusCode::PRECONDITION_FAILED);
    }
    let known = match headers.contains_key(IF_NONE_MATCH) {
        true => is_known(headers, tag),
        false => date(IF_MODIFIED_SINCE).is_some_and(|since| modified <= since),
    };
    known.then_some(StatusCode::NOT_MODIFIED)
}

fn content_range(range: &str) -> HeaderValue {
    HeaderValue::from_str(&format!("bytes {range}")).unwrap_or(HeaderValue::from_static("bytes */*"))
}

/// The positions in a file of `length` bytes that a range as [`single`] writes it means; `None` where there are none.
fn within(range: &HeaderValue, length: u64) -> Option<Range<u64>> {
    let (first, last) = range.to_str().ok()?.strip_prefix("bytes=")?.split_once('-')?;
    let range = match (position(first)?, position(last)?) {
        (Some(first), last) => first..last.map_or(length, |last| last.saturating_add(1).min(length)),
        (None, Some(suffix)) => length.saturating_sub(suffix)..length,
        (None, None) => return None,
    };
    (!range.is_empty()).then_some(range)
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
    digits
        .bytes()
        .all(|digit| digit.is_ascii_digit())
        .then(|| Some(digits.parse().map_or(BEYOND, |at: u64| at.min(BEYOND))))
}
