//! Answers that clients may keep and ask about (RFC 9110, section 13), and which of them are compressed on the way.

use axum::body::Body;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, HeaderMap, IF_NONE_MATCH, VARY};
use axum::http::{Extensions, HeaderValue, StatusCode, Version};
use axum::response::{IntoResponse, Response};
use sha2::{Digest, Sha256};

use super::problem::media_type;

/// A tag of what consists of `pieces`. It is a weak one: the same document may be sent compressed or not.
pub(super) fn tag(pieces: &[&[u8]]) -> String {
    let mut digest = Sha256::new();
    for piece in pieces {
        // With its length, so that two divisions of the same bytes differ.
        digest.update((piece.len() as u64).to_le_bytes());
        digest.update(piece);
    }
    let digits: String = digest.finalize().iter().take(16).map(|byte| format!("{byte:02x}")).collect();
    format!("W/\"{digits}\"")
}

/// Whether the client has the document with this tag already.
pub(super) fn is_known(headers: &HeaderMap, tag: &str) -> bool {
    let opaque = |tag: &str| tag.trim().trim_start_matches("W/").to_owned();
    let values = headers.get_all(IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok());
    values.flat_map(|value| value.split(',')).any(|known| known.trim() == "*" || opaque(known) == opaque(tag))
}

/// A document that a client may keep, and asks about before it uses it again; nothing but that for one who has it.
pub(super) fn tagged(
    headers: &HeaderMap,
    media_type: &'static str,
    tag: &str,
    contents: impl Into<Body>,
) -> Response {
    let mut response = if is_known(headers, tag) {
        let mut response = StatusCode::NOT_MODIFIED.into_response();
        // Which the document is given when it is sent.
        if is_text_type(media_type) {
            response.headers_mut().insert(VARY, HeaderValue::from_static("accept-encoding"));
        }
        response
    } else {
        ([(CONTENT_TYPE, media_type)], contents.into()).into_response()
    };
    let kept = response.headers_mut();
    if let Ok(tag) = HeaderValue::from_str(tag) {
        kept.insert(ETAG, tag);
    }
    kept.insert(CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    response
}

/// Whether an answer is worth compressing: text that is there as a whole. Streams have to arrive at once.
pub(super) fn is_text(_: StatusCode, _: Version, headers: &HeaderMap, _: &Extensions) -> bool {
    const STREAMS: [&str; 2] = ["text/event-stream", "application/jsonl"];
    media_type(headers).is_some_and(|kind| is_text_type(&kind) && !STREAMS.contains(&kind.as_str()))
}

fn is_text_type(kind: &str) -> bool {
    kind.starts_with("text/") || ["json", "xml", "yaml"].iter().any(|end| kind.ends_with(end))
}
