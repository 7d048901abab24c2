//! Jobs: posting, looking, cancelling, trying again, deleting.

use axum::extract::State;
use axum::http::header::LOCATION;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use axum::{Json, body::Bytes};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::app::App;
use super::caller::Caller;
use super::extract::{NoQuery, Upload, UrlPath, UrlQuery, page_limit};
use super::problem::ProblemDetails;
use super::responses::{JobId, NoSuchJob, NotCancelled, NotDeleted, NotQueued, NotRetried};
use crate::jobs::{
    IdempotencyKey, Job, JobRequest, JobState, JobTerms, Posting, ServiceError, StoredJob, Work,
};

/// A job as shown.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Job")]
pub(super) struct JobBody {
    #[serde(flatten)]
    job: Job,
    links: Links,
}

/// Where everything about a job is; what a job of its kind does not leave is left out.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, JsonSchema)]
struct Links {
    /// The job itself.
    #[serde(rename = "self")]
    job: String,
    /// Server-sent events.
    events: String,
    /// The character, as it was posted.
    #[serde(skip_serializing_if = "Option::is_none")]
    character: Option<String>,
    /// The recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    recording: Option<String>,
    /// The recording in a viewer.
    #[serde(skip_serializing_if = "Option::is_none")]
    viewer: Option<String>,
    /// The motion document.
    #[serde(skip_serializing_if = "Option::is_none")]
    motion: Option<String>,
    /// Every motion that was learned.
    #[serde(skip_serializing_if = "Option::is_none")]
    motions: Option<String>,
    /// The gait report.
    #[serde(skip_serializing_if = "Option::is_none")]
    gait: Option<String>,
    /// The gait diagram.
    #[serde(skip_serializing_if = "Option::is_none")]
    diagram: Option<String>,
    /// The learning curve.
    #[serde(skip_serializing_if = "Option::is_none")]
    curve: Option<String>,
    /// Everything about the job and what came of it.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<String>,
    /// What every setting of a study costs and how exact it is.
    #[serde(skip_serializing_if = "Option::is_none")]
    table: Option<String>,
    /// The work-precision diagram of a study.
    #[serde(skip_serializing_if = "Option::is_none")]
    front: Option<String>,
}

impl Links {
    fn of(job: &Job) -> Self {
        let place = format!("/v1/jobs/{}", job.id);
        let at = |what: &str| Some(format!("{place}/{what}"));
        let events = format!("{place}/events");
        match job.work {
            Work::Learning(_) => Self {
                character: at("character"),
                recording: at("recording.rrd"),
                viewer: Some(format!("/viewer/?url={place}/recording.rrd")),
                motion: at("motion"),
                motions: at("motions"),
                gait: at("gait"),
                diagram: at("gait.svg"),
                curve: at("curve"),
                report: at("report"),
                events,
                job: place,
                ..Self::default()
            },
            Work::Accuracy(_) => {
                Self { table: at("table"), front: at("front.svg"), events, job: place, ..Self::default() }
            }
        }
    }
}

impl JobBody {
    /// Where the job is.
    pub(super) fn place(&self) -> &str {
        &self.links.job
    }
}

impl From<Job> for JobBody {
    fn from(job: Job) -> Self {
        Self { links: Links::of(&job), job }
    }
}

/// A page of jobs.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Jobs")]
pub(super) struct JobsBody {
    /// `gaitwright/jobs@1`.
    format: &'static str,
    /// The newest first.
    jobs: Vec<JobBody>,
    /// Jobs of this page whose records are damaged, or of a newer version. They are left alone, and can be deleted.
    unreadable: Vec<UnreadableBody>,
    /// Where the next page is; `null` on the last.
    next: Option<String>,
}

/// A job whose record cannot be read.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "UnreadableJob")]
struct UnreadableBody {
    /// The job.
    #[schemars(with = "String")]
    id: Uuid,
    /// What is wrong with its record.
    reason: String,
}

/// Which jobs to list.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Selection {
    limit: Option<u32>,
    after: Option<Uuid>,
    state: Option<JobState>,
}

/// Queues a job.
#[utoipa::path(
    post, path = "/v1/jobs", operation_id = "submit_job", tag = "jobs",
    params(("Idempotency-Key" = Option<String>, Header,
        description = "1 to 255 visible characters. The same key and body again are the same job, as long as it is \
            kept; the same key and another body are refused")),
    request_body(description = "A job document; or a URDF, or a zip of one with its meshes, for a job with \
        defaults; or a form with the parts `character` (URDF, JSON or zip) and `job` (a job document without \
        a character)", content(
        (ref("#/components/schemas/JobRequest") = "application/json"),
        (String = "application/xml"), (String = "text/xml"), (Vec<u8> = "application/zip"),
        (ref("#/components/schemas/JobForm") = "multipart/form-data"))),
    responses(
        (status = 202, description = "Queued", body = ref("#/components/schemas/Job"),
            headers(("Location" = String, description = "Where the job is"))),
        NotQueued))]
pub(super) async fn submit(
    State(app): State<App>,
    caller: Caller,
    headers: HeaderMap,
    upload: Upload,
) -> Result<Response, ProblemDetails> {
    let key = idempotency_key(&headers, &upload)?.map(|key| key.of(caller.token()));
    let before = match &key {
        Some(key) => app.jobs.posted(key).await?,
        None => None,
    };
    let posting = Posting { caller: caller.to_string(), key };
    let job = match (before, upload) {
        (Some(job), _) => job,
        (None, Upload::Json(body)) => {
            let request = app.jobs.compute(move |_| Ok(JobRequest::parse(&body)?)).await?;
            app.jobs.submit(request.character, request.terms, posting).await?
        }
        (None, Upload::Urdf(body) | Upload::Zip(body)) => {
            submit_bytes(&app, body, "", JobTerms::default(), posting).await?
        }
        (None, Upload::Form(form)) => {
            let character = form.character.clone();
            let terms = app.jobs.compute(move |_| Ok(form.terms()?)).await?;
            // As in a job document, whose character stands there: the part `job` has no field of this name.
            submit_bytes(&app, character, "/character", terms, posting).await?
        }
    };
    Ok(accepted(job))
}

/// The key under which a request comes, where it has one.
fn idempotency_key(headers: &HeaderMap, upload: &Upload) -> Result<Option<IdempotencyKey>, ProblemDetails> {
    let Some(key) = headers.get("idempotency-key") else { return Ok(None) };
    let pieces: Vec<&[u8]> = match upload {
        Upload::Json(body) => vec![b"json", body],
        Upload::Urdf(body) => vec![b"urdf", body],
        Upload::Zip(body) => vec![b"zip", body],
        // The boundary between the parts differs from one sending to the next.
        Upload::Form(form) => {
            [Some(&b"form"[..]), Some(&form.character), form.job.as_deref()].into_iter().flatten().collect()
        }
    };
    let key = IdempotencyKey::new(key.as_bytes(), &pieces);
    let unusable = |error| ProblemDetails::new(StatusCode::BAD_REQUEST, format!("Idempotency-Key: {error}"));
    key.map(Some).map_err(unusable)
}

async fn submit_bytes(
    app: &App,
    body: Bytes,
    place: &'static str,
    terms: JobTerms,
    posting: Posting,
) -> Result<Job, ServiceError> {
    app.jobs.submit_bytes((body.into(), None, place), terms, posting).await
}

/// The answer to a request that changes the job in time.
fn accepted(job: Job) -> Response {
    let body = JobBody::from(job);
    (StatusCode::ACCEPTED, [(LOCATION, body.place().to_owned())], Json(body)).into_response()
}

/// Lists jobs, the newest first.
#[utoipa::path(
    get, path = "/v1/jobs", operation_id = "list_jobs", tag = "jobs",
    params(
        ("limit" = Option<u32>, Query, description = "Jobs of a page, 1 to 200; 20 if left out"),
        ("after" = Option<String>, Query, description = "Only jobs older than the one with this id"),
        ("state" = Option<String>, Query,
            description = "Only jobs in this state: queued, running, succeeded, failed, cancelled")),
    responses(
        (status = 200, description = "A page of jobs", body = ref("#/components/schemas/Jobs"))))]
pub(super) async fn list(
    State(app): State<App>,
    UrlQuery(selection): UrlQuery<Selection>,
) -> Result<Json<JobsBody>, ProblemDetails> {
    let limit = page_limit(selection.limit)?;
    // One more than asked for shows whether there is a next page.
    let mut jobs = app.jobs.list(selection.state, selection.after, limit + 1).await?;
    let more = jobs.len() > limit as usize;
    jobs.truncate(limit as usize);
    let next = jobs.last().filter(|_| more).map(|last| {
        let last = last.id();
        let state = selection.state.map(|state| format!("&state={}", state.name())).unwrap_or_default();
        format!("/v1/jobs?limit={limit}&after={last}{state}")
    });
    let mut page = JobsBody { format: "gaitwright/jobs@1", jobs: Vec::new(), unreadable: Vec::new(), next };
    for job in jobs {
        match job {
            StoredJob::Readable(job) => page.jobs.push(JobBody::from(*job)),
            StoredJob::Unreadable { id, reason } => page.unreadable.push(UnreadableBody { id, reason }),
        }
    }
    Ok(Json(page))
}

/// Shows a job.
#[utoipa::path(
    get, path = "/v1/jobs/{id}", operation_id = "show_job", tag = "jobs",
    params(JobId),
    responses(
        (status = 200, description = "The job", body = ref("#/components/schemas/Job")),
        NoSuchJob))]
pub(super) async fn show(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
) -> Result<Json<JobBody>, ProblemDetails> {
    Ok(Json(app.jobs.job(id).await?.into()))
}

/// Cancels a job that waits or runs; the same again changes nothing.
#[utoipa::path(
    post, path = "/v1/jobs/{id}/cancel", operation_id = "cancel_job", tag = "jobs",
    params(JobId),
    responses(
        (status = 202, description = "The job is cancelled, or will be within a second (two, where another machine works at it)",
            body = ref("#/components/schemas/Job"), headers(("Location" = String, description = "Where the job is"))),
        NotCancelled))]
pub(super) async fn cancel(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
) -> Result<Response, ProblemDetails> {
    Ok(accepted(app.jobs.cancel(id).await?))
}

/// Queues a failed or cancelled job again, from its last checkpoint.
#[utoipa::path(
    post, path = "/v1/jobs/{id}/retry", operation_id = "retry_job", tag = "jobs",
    params(JobId),
    responses(
        (status = 202, description = "Queued again",
            body = ref("#/components/schemas/Job"), headers(("Location" = String, description = "Where the job is"))),
        NotRetried))]
pub(super) async fn retry(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
) -> Result<Response, ProblemDetails> {
    Ok(accepted(app.jobs.retry(id).await?))
}

/// Deletes a job that has ended, with its files.
#[utoipa::path(
    delete, path = "/v1/jobs/{id}", operation_id = "delete_job", tag = "jobs",
    params(JobId),
    responses((status = 204, description = "The job and its files are deleted"), NotDeleted))]
pub(super) async fn delete(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
) -> Result<StatusCode, ProblemDetails> {
    app.jobs.delete(id).await?;
    Ok(StatusCode::NO_CONTENT)
}
