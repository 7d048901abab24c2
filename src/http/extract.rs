//! What requests bring: paths, queries, and bodies by their media type.

use axum::body::Bytes;
use axum::extract::{FromRequest, FromRequestParts, Multipart, Request};
use axum::http::StatusCode;
use axum::http::request::Parts;
use serde::Deserialize;

use super::problem::{ProblemDetails, media_type};
use crate::jobs::JobTerms;
use gaitwright_physics::character::Source;
use gaitwright_physics::fault::{Fault, InputError};

/// [`axum::extract::Path`] with problem documents.
#[derive(Debug, FromRequestParts)]
#[from_request(via(axum::extract::Path), rejection(ProblemDetails))]
pub(super) struct UrlPath<T>(pub(super) T);

/// [`axum::extract::Query`] with problem documents.
#[derive(Debug, FromRequestParts)]
#[from_request(via(axum::extract::Query), rejection(ProblemDetails))]
pub(super) struct UrlQuery<T>(pub(super) T);

/// No query, or an empty one.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct NoParameters {}

/// The call takes no parameters in its query.
#[derive(Debug)]
pub(super) struct NoQuery;

impl<S: Send + Sync> FromRequestParts<S> for NoQuery {
    type Rejection = ProblemDetails;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, ProblemDetails> {
        UrlQuery::<NoParameters>::from_request_parts(parts, state).await.map(|_| Self)
    }
}

/// Things on a page unless the client asks for another number.
const PAGE: u32 = 20;

/// Most things on a page.
const LONGEST_PAGE: u32 = 200;

/// How many things a page of a list has.
///
/// # Errors
/// 400 for a number that a page cannot have.
pub(super) fn page_limit(wanted: Option<u32>) -> Result<u32, ProblemDetails> {
    let limit = wanted.unwrap_or(PAGE);
    if (1..=LONGEST_PAGE).contains(&limit) {
        return Ok(limit);
    }
    let detail = format!("limit: must lie between 1 and {LONGEST_PAGE}");
    Err(ProblemDetails::new(StatusCode::BAD_REQUEST, detail))
}

/// A body that brings a character, by its media type.
#[derive(Debug)]
pub(super) enum Upload {
    /// `application/json`.
    Json(Bytes),
    /// `application/xml` or `text/xml`: a URDF.
    Urdf(Bytes),
    /// `application/zip`: a URDF with its meshes.
    Zip(Bytes),
    /// `multipart/form-data`.
    Form(Form),
}

/// A form that brings a character.
#[derive(Debug)]
pub(super) struct Form {
    /// URDF, JSON or zip.
    pub(super) character: Bytes,
    /// A job document without a character.
    pub(super) job: Option<Bytes>,
}

impl<S: Send + Sync> FromRequest<S> for Upload {
    type Rejection = ProblemDetails;

    async fn from_request(request: Request, state: &S) -> Result<Self, ProblemDetails> {
        match media_type(request.headers()).as_deref() {
            Some("application/json") => Ok(Self::Json(Bytes::from_request(request, state).await?)),
            Some("application/xml" | "text/xml") => {
                Ok(Self::Urdf(declared(Bytes::from_request(request, state).await?, Source::Urdf)?))
            }
            Some("application/zip") => {
                Ok(Self::Zip(declared(Bytes::from_request(request, state).await?, Source::Zip)?))
            }
            Some("multipart/form-data") => {
                Ok(Self::Form(Form::read(Multipart::from_request(request, state).await?).await?))
            }
            other => Err(ProblemDetails::unsupported(format!(
                "the body is {}; application/json, application/xml, application/zip or \
                 multipart/form-data is expected",
                other.unwrap_or("of no given type")
            ))),
        }
    }
}

/// A body that was declared to be of a kind, unless it plainly is of another.
fn declared(body: Bytes, kind: Source) -> Result<Bytes, ProblemDetails> {
    let name = |kind| match kind {
        Source::Urdf => "XML",
        Source::Json => "JSON",
        Source::Zip => "a zip archive",
    };
    match Source::detect(&body) {
        Some(found) if found != kind => Err(ProblemDetails::unsupported(format!(
            "the body is {}, but the header Content-Type says that it is {}",
            name(found),
            name(kind)
        ))),
        _ => Ok(body),
    }
}

/// A JSON body.
#[derive(Debug)]
pub(super) struct JsonBody(pub(super) Bytes);

impl<S: Send + Sync> FromRequest<S> for JsonBody {
    type Rejection = ProblemDetails;

    async fn from_request(request: Request, state: &S) -> Result<Self, ProblemDetails> {
        match media_type(request.headers()).as_deref() {
            Some("application/json") => Ok(Self(Bytes::from_request(request, state).await?)),
            other => Err(ProblemDetails::unsupported(format!(
                "the body is {}; application/json is expected",
                other.unwrap_or("of no given type")
            ))),
        }
    }
}

impl Form {
    /// What the part `job` says. Its fields are named by their pointers, as in a job document; a place that is none
    /// would otherwise be one of either part.
    ///
    /// # Errors
    ///
    /// As [`JobTerms::parse`].
    pub(super) fn terms(&self) -> Result<JobTerms, InputError> {
        let Some(job) = &self.job else { return Ok(JobTerms::default()) };
        JobTerms::parse(job).map_err(|error| {
            let of_a_field = error.faults().iter().all(|fault| fault.pointer.starts_with('/'));
            if of_a_field { error } else { error.under("part \"job\"") }
        })
    }

    async fn read(mut parts: Multipart) -> Result<Self, ProblemDetails> {
        let (mut character, mut job) = (None, None);
        let mut faults = Vec::new();
        while let Some(part) = parts.next_field().await? {
            let name = part.name().unwrap_or_default().to_owned();
            let place = match name.as_str() {
                "character" => &mut character,
                "job" => &mut job,
                _ => {
                    faults.push(Fault::new(
                        format!("part \"{name}\""),
                        "unknown part of the form, expected one of character, job",
                    ));
                    continue;
                }
            };
            if place.is_some() {
                faults.push(Fault::new(format!("part \"{name}\""), "the part is given twice"));
            }
            *place = Some(part.bytes().await?);
        }
        match character {
            Some(character) if faults.is_empty() => Ok(Self { character, job }),
            found => {
                if found.is_none() {
                    faults.push(Fault::new("part \"character\"", "the part is missing"));
                }
                Err(InputError::Impossible(faults).into())
            }
        }
    }
}
