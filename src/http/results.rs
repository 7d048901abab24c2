//! What a job leaves behind: motion, gait, curve, report; of a study, table and diagram.

use axum::extract::State;
use axum::http::HeaderMap;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Map, Value};
use uuid::Uuid;

use super::accept::{chosen, prefers_csv};
use super::app::App;
use super::conditional::{tag, tagged};
use super::extract::{NoQuery, UrlPath, UrlQuery};
use super::problem::ProblemDetails;
use super::responses::{JobId, NoCurve, NoDiagram, NoMotion, NoReport, NoTable, PreliminaryQuery};
use crate::export::Curve;
use crate::jobs::{Artefact, Job, JobFile, ServiceError, Work};

/// The motion document.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motion", tag = "results",
    params(JobId, PreliminaryQuery),
    responses(
        (status = 200, description = "The motion", body = ref("#/components/schemas/Motion")),
        NoMotion))]
pub(super) async fn motion(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(choice): UrlQuery<Choice>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    published(&app, id, (&choice, &headers), Artefact::Motion, "application/json").await
}

/// Every motion that was learned, in figures.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motions", tag = "results",
    params(JobId, PreliminaryQuery),
    responses(
        (status = 200, description = "The repertoire", body = ref("#/components/schemas/Repertoire")),
        NoMotion))]
pub(super) async fn motions(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(choice): UrlQuery<Choice>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    published(&app, id, (&choice, &headers), Artefact::Motions, "application/json").await
}

/// The gait report.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/gait", tag = "results",
    params(JobId, PreliminaryQuery),
    responses(
        (status = 200, description = "The gait report", body = ref("#/components/schemas/GaitReport")),
        NoMotion))]
pub(super) async fn gait(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(choice): UrlQuery<Choice>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    published(&app, id, (&choice, &headers), Artefact::Gait, "application/json").await
}

/// The gait diagram.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/gait.svg", tag = "results",
    params(JobId, PreliminaryQuery),
    responses(
        (status = 200, description = "The gait diagram", content_type = "image/svg+xml", body = String),
        NoMotion))]
pub(super) async fn diagram(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(choice): UrlQuery<Choice>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    published(&app, id, (&choice, &headers), Artefact::Diagram, "image/svg+xml").await
}

/// Everything about a job and what came of it.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/report", tag = "results",
    params(JobId, PreliminaryQuery),
    responses(
        (status = 200, description = "The report", body = ref("#/components/schemas/Report")),
        NoReport))]
pub(super) async fn report(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(choice): UrlQuery<Choice>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    published(&app, id, (&choice, &headers), Artefact::Report, "application/json").await
}

/// The learning curve so far.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/curve", tag = "results",
    params(JobId),
    responses(
        (status = 200, description = "The curve, as JSON or CSV by the header Accept", content(
            (ref("#/components/schemas/Curve") = "application/json"), (String = "text/csv"))),
        NoCurve))]
pub(super) async fn curve(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    // The state first: the curve of a job that has ended grows no more.
    let job = app.jobs.job(id).await?;
    check_left(&job, Artefact::Curve)?;
    let curve = Curve::new(&app.jobs.curve(id, 0).await?);
    Ok(chosen(if prefers_csv(&headers) {
        given(&job, &headers, "text/csv; charset=utf-8", curve.to_csv().into_bytes())
    } else {
        let text = serde_json::to_vec(&curve).map_err(|error| ServiceError::Store(error.into()))?;
        given(&job, &headers, "application/json", text)
    }))
}

/// What every setting of a study costs and how exact it is.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/table", tag = "results",
    params(JobId, PreliminaryQuery),
    responses(
        (status = 200, description = "The table, as JSON or CSV by the header Accept", content(
            (ref("#/components/schemas/Table") = "application/json"), (String = "text/csv"))),
        NoTable))]
pub(super) async fn table(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(choice): UrlQuery<Choice>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    let (artefact, media_type) = if prefers_csv(&headers) {
        (Artefact::TableCsv, "text/csv; charset=utf-8")
    } else {
        (Artefact::Table, "application/json")
    };
    Ok(chosen(published(&app, id, (&choice, &headers), artefact, media_type).await?))
}

/// The work-precision diagram of a study.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/front.svg", tag = "results",
    params(JobId, PreliminaryQuery),
    responses(
        (status = 200, description = "The diagram", content_type = "image/svg+xml", body = String),
        NoDiagram))]
pub(super) async fn front(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(choice): UrlQuery<Choice>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    published(&app, id, (&choice, &headers), Artefact::Front, "image/svg+xml").await
}

/// Whether results are wanted before their job has ended.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Choice {
    #[serde(default)]
    pub(super) preliminary: bool,
}

/// A file that is the job's once it has ended. Before that it is what an earlier run has left, or what is just being
/// written, and is given to those only who ask for it.
async fn published(
    app: &App,
    id: Uuid,
    asked: (&Choice, &HeaderMap),
    artefact: Artefact,
    media_type: &'static str,
) -> Result<Response, ProblemDetails> {
    let (job, file) = (app.jobs.job(id).await?, JobFile::artefact(id, artefact));
    check_left(&job, artefact)?;
    served(app, &job, asked, (&file, artefact.file_name(), media_type)).await
}

/// Whether jobs like this one leave such a thing at all.
///
/// # Errors
/// 404 where there will never be one.
pub(super) fn check_left(job: &Job, artefact: Artefact) -> Result<(), ProblemDetails> {
    let of_study = matches!(artefact, Artefact::Table | Artefact::TableCsv | Artefact::Front);
    let kind = match (&job.work, of_study) {
        (Work::Learning(_), true) => "a job that learns",
        (Work::Accuracy(_), false) => "a study",
        _ => return Ok(()),
    };
    Err(ProblemDetails::not_found(format!("{kind} leaves no {}", artefact.file_name())))
}

/// Whether the results of `job` are to be given: once it has ended, or where preliminary ones will do.
///
/// # Errors
/// 409 where they are not; `name` is what was asked for.
pub(super) fn check_ended(job: &Job, choice: &Choice, name: &str) -> Result<(), ProblemDetails> {
    if job.state.is_final() || choice.preliminary { Ok(()) } else { Err(not_ready(job, name)) }
}

/// A file of `job`, as [`published`] gives it.
pub(super) async fn served(
    app: &App,
    job: &Job,
    (choice, headers): (&Choice, &HeaderMap),
    (file, name, media_type): (&JobFile, &str, &'static str),
) -> Result<Response, ProblemDetails> {
    check_ended(job, choice, name)?;
    let Some(contents) = app.jobs.read(file).await? else { return Err(not_ready(job, name)) };
    let preliminary = !job.state.is_final() && media_type == "application/json";
    Ok(given(job, headers, media_type, if preliminary { marked(contents) } else { contents }))
}

/// A result of `job`, with its tag; not to be kept while the job has not ended.
pub(super) fn given(job: &Job, headers: &HeaderMap, media_type: &'static str, contents: Vec<u8>) -> Response {
    if job.state.is_final() {
        return tagged(headers, media_type, &tag(&[&contents]), contents);
    }
    ([(CONTENT_TYPE, media_type), (CACHE_CONTROL, "no-store")], contents).into_response()
}

/// A JSON document with the mark of what is not final.
fn marked(contents: Vec<u8>) -> Vec<u8> {
    let document = serde_json::from_slice::<Map<String, Value>>(&contents).map(|mut document| {
        document.insert("preliminary".to_owned(), Value::Bool(true));
        document
    });
    document.and_then(|document| serde_json::to_vec(&document)).unwrap_or(contents)
}

pub(super) fn not_ready(job: &Job, what: &str) -> ProblemDetails {
    let why = match &job.error {
        Some(error) => format!(": {error}"),
        None => String::new(),
    };
    ProblemDetails::conflict(format!("the job is {}{why}; there is no {what}", job.state.name()))
}
