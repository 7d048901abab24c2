//! Errors as problem documents (RFC 9457): the one place where anything that went wrong becomes an
//! answer.

use std::error::Error;

use axum::body::Body;
use axum::extract::Request;
use axum::extract::multipart::{MultipartError, MultipartRejection};
use axum::extract::rejection::{BytesRejection, PathRejection, QueryRejection};
use axum::http::header::{
    ACCEPT_ENCODING, CONTENT_ENCODING, CONTENT_RANGE, CONTENT_TYPE, HeaderName, HeaderValue, IF_MATCH,
    IF_UNMODIFIED_SINCE, RANGE, RETRY_AFTER,
};
use axum::http::{HeaderMap, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use schemars::JsonSchema;
use serde::Serialize;
use tower_http::timeout::TimeoutError;

use super::bounds::{BODY_TIMEOUT, MAX_BODY, TIMEOUT};
use crate::jobs::{ServiceError, StoreError};
use gaitwright_physics::fault::{Fault, InputError};

/// The media type of problem documents.
pub(super) const PROBLEM_JSON: &str = "application/problem+json";

/// Retry-After of an answer from a full queue, s.
const FULL_QUEUE_RETRY: u32 = 10;

/// Retry-After of an answer from a service that has no place for another stream, s.
const CROWDED_RETRY: u32 = 5;

/// Most faults that an answer lists.
const MOST_FAULTS: usize = 100;

/// Longest place and longest reason of a fault in an answer, characters: both may quote the input.
const LONGEST_TEXT: usize = 500;

/// Retry-After of an answer from a service that cannot write at present, s.
const STORE_RETRY: u32 = 5;

/// Retry-After of an answer from a service that shuts down, s.
const SHUTDOWN_RETRY: u32 = 5;

/// What parsers of queries say, and what it means.
const PLAIN: [(&str, &str); 8] = [
    ("unknown field", "unknown parameter"),
    ("there are no fields", "none is taken here"),
    ("duplicate field", "given twice:"),
    ("invalid digit found in string", "must be a whole number"),
    ("cannot parse integer from empty string", "must be a whole number"),
    ("invalid float literal", "must be a number"),
    ("cannot parse float from empty string", "must be a number"),
    ("provided string was not `true` or `false`", "must be true or false"),
];

/// A problem document.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Problem")]
pub struct ProblemDetails {
    /// Kind of the problem: `urn:gaitwright:input` for a faulty input, `about:blank` when the status
    /// is all there is to it.
    #[serde(rename = "type")]
    kind: &'static str,
    /// The kind in words.
    title: &'static str,
    /// The HTTP status.
    status: u16,
    /// What went wrong this time.
    detail: String,
    /// Where the first fault of an input is: a JSON pointer, or line and element of a URDF.
    #[serde(skip_serializing_if = "Option::is_none")]
    pointer: Option<String>,
    /// The faults of an input, at most 100.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schemars(default)]
    errors: Vec<FaultBody>,
    /// Number of further faults that are not listed.
    #[serde(skip_serializing_if = "is_zero")]
    #[schemars(default)]
    errors_left_out: u32,
    /// s.
    #[serde(skip)]
    retry_after: Option<u32>,
}

/// A fault of an input.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
struct FaultBody {
    /// Where: a JSON pointer, or line and element of a URDF; empty for the whole input.
    pointer: String,
    /// What is wrong there.
    detail: String,
}

fn is_zero(number: &u32) -> bool {
    *number == 0
}

impl ProblemDetails {
    /// A problem whose kind is its status.
    pub(super) fn new(status: StatusCode, detail: impl Into<String>) -> Self {
        Self {
            kind: "about:blank",
            title: status.canonical_reason().unwrap_or("error"),
            status: status.as_u16(),
            detail: detail.into(),
            pointer: None,
            errors: Vec::new(),
            errors_left_out: 0,
            retry_after: None,
        }
    }

    /// There is no such thing.
    pub(super) fn not_found(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, detail)
    }

    /// The thing is not in the state that the request needs.
    pub(super) fn conflict(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, detail)
    }

    /// The body is of a kind that cannot be read.
    pub(super) fn unsupported(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, detail)
    }

    /// The limit on simultaneous work is reached.
    pub(super) fn busy(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::TOO_MANY_REQUESTS, detail).retry_after(FULL_QUEUE_RETRY)
    }

    /// There is no place for another stream.
    pub(super) fn crowded(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, detail).retry_after(CROWDED_RETRY)
    }

    /// A body that could not be read: too late when it stopped coming, with the limit when it is too large, otherwise
    /// with the given status and reason.
    fn unread(error: &(dyn Error + 'static), status: StatusCode, detail: String) -> Self {
        let mut causes =
            std::iter::successors(Some(error), |error: &&(dyn Error + 'static)| (*error).source());
        if causes.any(|cause| cause.is::<TimeoutError>()) {
            let detail =
                format!("the body has stopped coming: nothing came for {} s", BODY_TIMEOUT.as_secs());
            return Self::new(StatusCode::REQUEST_TIMEOUT, detail);
        }
        if status == StatusCode::PAYLOAD_TOO_LARGE {
            return Self::new(status, format!("the body is larger than the {MAX_BODY} bytes that are read"));
        }
        Self::new(status, detail)
    }

    /// A failure of the service itself; what failed goes to the log and not to the client.
    fn internal(error: &dyn std::fmt::Display) -> Self {
        tracing::error!(%error, "a request could not be answered");
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, "the request could not be answered; the log says why")
    }

    pub(super) fn retry_after(mut self, pause: u32) -> Self {
        self.retry_after = Some(pause);
        self
    }

    fn status(&self) -> StatusCode {
        StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR)
    }
}

impl IntoResponse for ProblemDetails {
    fn into_response(self) -> Response {
        let body = serde_json::to_vec(&self).unwrap_or_default();
        let mut response = (self.status(), [(CONTENT_TYPE, PROBLEM_JSON)], body).into_response();
        if let Some(pause) = self.retry_after {
            response.headers_mut().insert(RETRY_AFTER, HeaderValue::from(pause));
        }
        response
    }
}

impl From<InputError> for ProblemDetails {
    fn from(error: InputError) -> Self {
        let (status, title) = match &error {
            InputError::Malformed(_) => (StatusCode::BAD_REQUEST, "The input cannot be parsed"),
            InputError::TooLarge(_) => (StatusCode::PAYLOAD_TOO_LARGE, "The input is too large"),
            InputError::Impossible(_) => (StatusCode::UNPROCESSABLE_ENTITY, "The input is impossible"),
        };
        let all = error.faults();
        let short = |fault: &Fault| Fault::new(shortened(&fault.pointer), shortened(&fault.reason));
        let faults: Vec<Fault> = all.iter().take(MOST_FAULTS).map(short).collect();
        let more = all.len() - faults.len();
        let listed = match error {
            InputError::Malformed(_) => faults.first().cloned().map(InputError::Malformed),
            InputError::TooLarge(_) => faults.first().cloned().map(InputError::TooLarge),
            InputError::Impossible(_) => None,
        };
        let listed = listed.unwrap_or_else(|| InputError::Impossible(faults.clone()));
        let detail = if more == 0 { listed.to_string() } else { format!("{listed}; and {more} more") };
        let body = |fault: &Fault| FaultBody { pointer: fault.pointer.clone(), detail: fault.reason.clone() };
        Self {
            kind: "urn:gaitwright:input",
            title,
            status: status.as_u16(),
            detail,
            pointer: faults.first().map(|fault| fault.pointer.clone()),
            errors: faults.iter().map(body).collect(),
            errors_left_out: more.try_into().unwrap_or(u32::MAX),
            retry_after: None,
        }
    }
}

/// The beginning of a text that is longer than an answer may quote.
fn shortened(text: &str) -> String {
    match text.char_indices().nth(LONGEST_TEXT) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}

impl From<ServiceError> for ProblemDetails {
    fn from(error: ServiceError) -> Self {
        match error {
            ServiceError::Input(error) => error.into(),
            ServiceError::UnknownJob(_) | ServiceError::UnknownCharacter(_) => {
                Self::not_found(error.to_string())
            }
            ServiceError::Full(_) | ServiceError::FullForCaller(_) | ServiceError::Busy => {
                Self::busy(error.to_string())
            }
            ServiceError::WrongState { .. } | ServiceError::CharacterNeeded { .. } => {
                Self::conflict(error.to_string())
            }
            ServiceError::KeyReused => Self::new(StatusCode::UNPROCESSABLE_ENTITY, error.to_string()),
            ServiceError::GivenUp => Self::new(StatusCode::REQUEST_TIMEOUT, error.to_string()),
            ServiceError::ShuttingDown => {
                Self::new(StatusCode::SERVICE_UNAVAILABLE, error.to_string()).retry_after(SHUTDOWN_RETRY)
            }
            ServiceError::Store(error) if error.is_unavailable() => {
                tracing::error!(%error, "the store is not available");
                let detail = "what is known of the jobs cannot be read or written at present; see /readyz";
                Self::new(StatusCode::SERVICE_UNAVAILABLE, detail).retry_after(STORE_RETRY)
            }
            ServiceError::Store(error @ StoreError::Unreadable { .. }) => Self::conflict(error.to_string()),
            ServiceError::File(error) => {
                tracing::error!(%error, "a file is not available");
                let detail = "the files cannot be read or written at present; see /readyz";
                Self::new(StatusCode::SERVICE_UNAVAILABLE, detail).retry_after(STORE_RETRY)
            }
            ServiceError::Unmanned { .. } | ServiceError::Silent(_) => {
                Self::new(StatusCode::SERVICE_UNAVAILABLE, error.to_string()).retry_after(STORE_RETRY)
            }
            ServiceError::Store(_) | ServiceError::Broken(_) => Self::internal(&error),
        }
    }
}

impl From<PathRejection> for ProblemDetails {
    fn from(rejection: PathRejection) -> Self {
        // A path that does not parse names nothing.
        Self::not_found(rejection.body_text())
    }
}

impl From<QueryRejection> for ProblemDetails {
    fn from(rejection: QueryRejection) -> Self {
        // The cause alone: it begins with the parameter.
        let cause = rejection.source().map_or_else(|| rejection.body_text(), ToString::to_string);
        let plain = PLAIN.iter().fold(cause, |text, (parser, plain)| text.replace(parser, plain));
        Self::new(rejection.status(), plain)
    }
}

impl From<BytesRejection> for ProblemDetails {
    fn from(rejection: BytesRejection) -> Self {
        let cause = rejection.source().map(|cause| format!(": {cause}")).unwrap_or_default();
        let (status, detail) = (rejection.status(), format!("the body cannot be read{cause}"));
        Self::unread(&rejection, status, detail)
    }
}

impl From<MultipartRejection> for ProblemDetails {
    fn from(rejection: MultipartRejection) -> Self {
        Self::new(rejection.status(), rejection.body_text())
    }
}

impl From<MultipartError> for ProblemDetails {
    fn from(error: MultipartError) -> Self {
        let (status, detail) = (error.status(), error.body_text());
        Self::unread(&error, status, detail)
    }
}

/// Turns errors that are no problem documents yet (unknown routes and methods, requests that took too
/// long, codings, conditions and ranges that cannot be met) into such.
pub(super) async fn describe_errors(request: Request, next: Next) -> Response {
    let place = format!("{} {}", request.method(), request.uri().path());
    let asked = request.headers().clone();
    let response = next.run(request).await;
    let status = response.status();
    let is_error = status.is_client_error() || status.is_server_error();
    if !is_error || media_type(response.headers()).as_deref() == Some(PROBLEM_JSON) {
        return response;
    }
    let (old, _) = response.into_parts();
    let detail = without_words(status, &place, &asked, &old.headers);
    let mut problem = ProblemDetails::new(status, detail).into_response();
    for (name, value) in &old.headers {
        if name != CONTENT_TYPE && name != axum::http::header::CONTENT_LENGTH {
            problem.headers_mut().insert(name, value.clone());
        }
    }
    problem
}

/// What is wrong where an answer says no more than its status: `asked` are the headers of the request, `answered` those
/// of the answer.
fn without_words(status: StatusCode, place: &str, asked: &HeaderMap, answered: &HeaderMap) -> String {
    let value = |headers: &HeaderMap, name: HeaderName| {
        let value = headers.get(name).map(HeaderValue::as_bytes).unwrap_or_default();
        shortened(&String::from_utf8_lossy(value))
    };
    match status {
        StatusCode::NOT_FOUND => format!("there is nothing at {place}"),
        StatusCode::METHOD_NOT_ALLOWED => format!("{place} is not offered; see the header Allow"),
        StatusCode::FORBIDDEN => "the request comes from another site".to_owned(),
        StatusCode::REQUEST_TIMEOUT => {
            format!("{place} could not be answered within {} s", TIMEOUT.as_secs())
        }
        StatusCode::UNSUPPORTED_MEDIA_TYPE => format!(
            "Content-Encoding: a body is not read in the coding {}; {} is",
            value(asked, CONTENT_ENCODING),
            value(answered, ACCEPT_ENCODING)
        ),
        // RFC 9110, section 13.2.2: the second is not looked at where there is the first.
        StatusCode::PRECONDITION_FAILED if asked.contains_key(IF_MATCH) => {
            format!("If-Match: {place} has another tag by now than {}", value(asked, IF_MATCH))
        }
        StatusCode::PRECONDITION_FAILED => {
            let since = value(asked, IF_UNMODIFIED_SINCE);
            format!("If-Unmodified-Since: {place} has changed since {since}")
        }
        StatusCode::RANGE_NOT_SATISFIABLE => {
            let there = value(answered, CONTENT_RANGE);
            let length = there.rsplit('/').next().unwrap_or_default();
            format!("Range: {} lies beyond the end; {place} has {length} bytes", value(asked, RANGE))
        }
        _ => format!("{place} could not be answered"),
    }
}

/// The answer to a request whose handler panicked.
pub(super) fn of_panic(panic: Box<dyn std::any::Any + Send>) -> Response<Body> {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given");
    ProblemDetails::internal(&text).into_response()
}

/// The media type of a message in lower case, without its parameters.
pub(super) fn media_type(headers: &HeaderMap) -> Option<String> {
    Some(headers.get(CONTENT_TYPE)?.to_str().ok()?.split(';').next()?.trim().to_ascii_lowercase())
}
