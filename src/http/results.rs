//! What a job leaves behind: recording, motion, gait, curve, report; of a study, table and diagram.

use std::io::SeekFrom;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::http::header::{ACCEPT_RANGES, CACHE_CONTROL, CONTENT_TYPE};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Map, Value};
use tokio::fs::File;
use tokio::io::{AsyncReadExt, AsyncSeekExt};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::accept::prefers_csv;
use super::app::App;
use super::caller::Caller;
use super::conditional::{tag, tagged};
use super::extract::{UrlPath, UrlQuery};
use super::limits::Place;
use super::problem::ProblemDetails;
use super::ranges;
use super::responses::{
    JobId, NoDiagram, NoMotion, NoRecording, NoReport, NoSuchJob, NoTable, PreliminaryQuery,
};
use crate::export::Curve;
use crate::jobs::{Artefact, Job, JobState, Live};

/// How often a growing recording is looked at for more.
const POLL_EVERY: Duration = Duration::from_millis(200);

/// Bytes of a growing recording sent at once.
const CHUNK: usize = 64 << 10;

/// The recording; while the job runs, a stream that follows it.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/recording.rrd", tag = "results",
    params(JobId),
    responses(
        (status = 200, description = "The recording, for the Rerun viewer; while the job runs, everything \
            recorded so far and then what is added, until the job ends",
            content_type = "application/octet-stream", body = Vec<u8>),
        (status = 206, description = "A range of a finished recording",
            content_type = "application/octet-stream", body = Vec<u8>),
        NoRecording))]
pub(super) async fn recording(
    State(app): State<App>,
    caller: Caller,
    UrlPath(id): UrlPath<Uuid>,
    request: Request,
) -> Result<Response, ProblemDetails> {
    let job = app.jobs.job(id).await?;
    let path = app.jobs.artefact(id, Artefact::Recording);
    if job.state == JobState::Running
        && let Some(live) = app.jobs.live(id)
    {
        let place = app.stream(caller)?;
        return Ok(growing(&request, path, live, app.jobs.shutdown().clone(), place));
    }
    if let Some(removed) = job.storage.recording_removed {
        let detail =
            format!("the recording was removed at {removed}, by the service's limits on what it keeps");
        return Err(ProblemDetails::new(StatusCode::GONE, detail));
    }
    if !tokio::fs::try_exists(&path).await.unwrap_or(false) {
        return Err(not_ready(&job, "recording"));
    }
    let mut response = ranges::serve(&path, request).await;
    response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    Ok(response)
}

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
        NoSuchJob))]
pub(super) async fn curve(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    app.jobs.job(id).await?;
    let curve = Curve::new(&app.jobs.curve(id).await?);
    Ok(if prefers_csv(&headers) {
        ([(CONTENT_TYPE, "text/csv; charset=utf-8")], curve.to_csv()).into_response()
    } else {
        Json(curve).into_response()
    })
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
    if prefers_csv(&headers) {
        published(&app, id, (&choice, &headers), Artefact::TableCsv, "text/csv; charset=utf-8").await
    } else {
        published(&app, id, (&choice, &headers), Artefact::Table, "application/json").await
    }
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
    let job = app.jobs.job(id).await?;
    served(&job, asked, app.jobs.artefact(id, artefact), (artefact.file_name(), media_type)).await
}

/// Whether the results of `job` are to be given: once it has ended, or where preliminary ones will do.
///
/// # Errors
/// 409 where they are not; `name` is what was asked for.
pub(super) fn check_ended(job: &Job, choice: &Choice, name: &str) -> Result<(), ProblemDetails> {
    if job.state.is_final() || choice.preliminary { Ok(()) } else { Err(not_ready(job, name)) }
}

/// The file at `path`, as [`published`] gives it.
pub(super) async fn served(
    job: &Job,
    (choice, headers): (&Choice, &HeaderMap),
    path: PathBuf,
    (name, media_type): (&str, &'static str),
) -> Result<Response, ProblemDetails> {
    check_ended(job, choice, name)?;
    let ended = job.state.is_final();
    let contents = match tokio::fs::read(path).await {
        Ok(contents) => contents,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(not_ready(job, name));
        }
        Err(error) => return Err(crate::jobs::ServiceError::from(error).into()),
    };
    if ended {
        return Ok(tagged(headers, media_type, &tag(&[&contents]), contents));
    }
    let contents = if media_type == "application/json" { marked(contents) } else { contents };
    Ok(([(CONTENT_TYPE, media_type), (CACHE_CONTROL, "no-store")], contents).into_response())
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

/// Answers with a file that grows until its job is over.
fn growing(
    request: &Request,
    path: PathBuf,
    live: Arc<Live>,
    shutdown: CancellationToken,
    place: Place,
) -> Response {
    let body = if request.method() == Method::HEAD {
        // A body of length 0 would be wrong: the length of what there will be is not known.
        Body::from_stream(tokio_stream::empty::<std::io::Result<Bytes>>())
    } else {
        let (sender, receiver) = mpsc::channel(4);
        tokio::spawn(async move {
            let _place = place;
            // The status has been sent: breaking the stream off is all that can still be done.
            if let Err(error) = follow(path, live, shutdown, &sender).await {
                let _ = sender.send(Err(error)).await;
            }
        });
        Body::from_stream(ReceiverStream::new(receiver))
    };
    ([(CONTENT_TYPE, "application/octet-stream"), (ACCEPT_RANGES, "none")], body).into_response()
}

async fn follow(
    path: PathBuf,
    live: Arc<Live>,
    shutdown: CancellationToken,
    sender: &mpsc::Sender<std::io::Result<Bytes>>,
) -> std::io::Result<()> {
    let mut moment = live.watch();
    let (mut file, mut at) = (None, 0);
    loop {
        // Looked at before the file is: whatever was written before the end is read after it.
        let over = moment.borrow_and_update().over;
        if file.is_none() {
            file = match File::open(&path).await {
                Ok(file) => Some(file),
                Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
                Err(error) => return Err(error),
            };
        }
        if let Some(file) = &mut file {
            file.seek(SeekFrom::Start(at)).await?;
            loop {
                let mut chunk = Vec::with_capacity(CHUNK);
                let read = file.take(CHUNK as u64).read_to_end(&mut chunk).await?;
                if read == 0 {
                    break;
                }
                at += read as u64;
                if sender.send(Ok(chunk.into())).await.is_err() {
                    return Ok(());
                }
            }
        }
        if over {
            return Ok(());
        }
        tokio::select! {
            () = tokio::time::sleep(POLL_EVERY) => {}
            () = sender.closed() => return Ok(()),
            () = shutdown.cancelled() => return Ok(()),
        }
    }
}
