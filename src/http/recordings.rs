//! The recording of a job: whole, in ranges, and while it grows.

use std::io::{self, SeekFrom};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::extract::{Request, State};
use axum::http::header::{ACCEPT_RANGES, CACHE_CONTROL, CONTENT_TYPE};
use axum::http::{HeaderValue, Method, StatusCode};
use axum::response::{IntoResponse, Response};
use tokio::fs::File;
use tokio::io::{AsyncReadExt, AsyncSeekExt};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use uuid::Uuid;

use super::app::App;
use super::caller::Caller;
use super::extract::{NoQuery, UrlPath};
use super::limits::Place;
use super::problem::ProblemDetails;
use super::ranges;
use super::responses::{JobId, NoRecording};
use super::results::{check_left, not_ready};
use crate::jobs::{Artefact, Job, JobState, Jobs, Joined, Live, Recorded, ServiceError, Stage};

/// How often a growing recording is looked at for more.
const POLL_EVERY: Duration = Duration::from_millis(200);

/// How often one that grows in an object store is.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Bytes of a growing recording sent at once.
const CHUNK: usize = 64 << 10;

/// The recording; while the job runs, a stream that follows it.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/recording.rrd", tag = "results",
    params(JobId),
    responses(
        (status = 200, description = "The recording, for the Rerun viewer; while the job runs, everything \
            recorded so far and then what is added, until the job ends; broken off where the service ends before, or \
            where the job goes on in another recording",
            content_type = "application/octet-stream", body = Vec<u8>),
        (status = 206, description = "A range of a finished recording",
            content_type = "application/octet-stream", body = Vec<u8>),
        NoRecording))]
pub(super) async fn recording(
    State(app): State<App>,
    caller: Caller,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
    request: Request,
) -> Result<Response, ProblemDetails> {
    let job = app.jobs.job(id).await?;
    check_left(&job, Artefact::Recording)?;
    if job.state == JobState::Running
        && let Some(growing) = Growing::of(&app.jobs, id)
    {
        let place = app.stream(caller)?;
        return Ok(followed(&request, growing, place));
    }
    if let Some(removed) = job.storage.recording_removed {
        let detail =
            format!("the recording was removed at {removed}, by the service's limits on what it keeps");
        return Err(ProblemDetails::new(StatusCode::GONE, detail));
    }
    let mut response = match app.jobs.recording(app.jobs.run(id).await?).await? {
        None => return Err(not_ready(&job, "recording")),
        Some(Recorded::File(path)) => ranges::serve(&path, request).await,
        Some(Recorded::Joined(joined)) => ranges::serve_joined(joined, &request),
    };
    response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    Ok(response)
}

/// A recording that grows until its job is over.
struct Growing {
    jobs: Jobs,
    id: Uuid,
    place: GrowingPlace,
}

/// Where it grows.
enum GrowingPlace {
    /// In a file, written by this process.
    File(PathBuf, Arc<Live>),
    /// In an object store, written by whichever process.
    Objects,
}

impl Growing {
    /// That of a job that runs; `None` where it has just ended.
    fn of(jobs: &Jobs, id: Uuid) -> Option<Self> {
        let place = match jobs.recording_file(id) {
            Some(path) => GrowingPlace::File(path, jobs.live(id)?),
            None => GrowingPlace::Objects,
        };
        Some(Self { jobs: jobs.clone(), id, place })
    }

    async fn follow(self, sender: &Sender) -> Result<(), ServiceError> {
        match self.place {
            GrowingPlace::File(path, live) => follow_file((&self.jobs, self.id), path, live, sender).await,
            GrowingPlace::Objects => follow_objects(&self.jobs, self.id, sender).await,
        }
    }
}

type Sender = mpsc::Sender<io::Result<Bytes>>;

/// Answers with a recording that grows.
fn followed(request: &Request, growing: Growing, place: Place) -> Response {
    let body = if request.method() == Method::HEAD {
        // A body of length 0 would be wrong: the length of what there will be is not known.
        Body::from_stream(tokio_stream::empty::<io::Result<Bytes>>())
    } else {
        let (sender, receiver) = mpsc::channel(4);
        tokio::spawn(async move {
            let _place = place;
            // The status has been sent: breaking the stream off is all that can still be done.
            if let Err(error) = growing.follow(&sender).await {
                let _ = sender.send(Err(io::Error::other(error))).await;
            }
        });
        Body::from_stream(ReceiverStream::new(receiver))
    };
    ([(CONTENT_TYPE, "application/octet-stream"), (ACCEPT_RANGES, "none")], body).into_response()
}

async fn follow_file(
    (jobs, id): (&Jobs, Uuid),
    path: PathBuf,
    live: Arc<Live>,
    sender: &Sender,
) -> Result<(), ServiceError> {
    let mut moment = live.watch();
    let (mut file, mut at) = (None, 0);
    loop {
        // Looked at before the file is: whatever was written before the end is read after it.
        let over = moment.borrow_and_update().over;
        if file.is_none() && (over || records(&jobs.job(id).await?)) {
            file = match File::open(&path).await {
                Ok(file) => Some(file),
                Err(error) if error.kind() == io::ErrorKind::NotFound => None,
                Err(error) => return Err(error.into()),
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
            return whole(&jobs.job(id).await?);
        }
        // A run that goes on from a checkpoint writes a recording of its own. The one before it grows no more.
        if replaced(file.as_ref(), &path).await? || !pause(jobs, sender, POLL_EVERY).await {
            return Err(broken_off());
        }
    }
}

/// Whether a recording that grows no more is whole: that of a job that has ended.
fn whole(job: &Job) -> Result<(), ServiceError> {
    if job.state.is_final() { Ok(()) } else { Err(broken_off()) }
}

/// Why a stream is broken off that would otherwise look as if it were whole (RFC 9112, section 8).
fn broken_off() -> ServiceError {
    io::Error::other("the recording goes on in another run of the job").into()
}

/// Whether a running job has come to where it makes a recording: what there is before is of a run that broke off.
fn records(job: &Job) -> bool {
    !matches!(job.stage, None | Some(Stage::Standing))
}

/// Whether another file, or none, is at the path of an open one by now.
async fn replaced(open: Option<&File>, path: &Path) -> io::Result<bool> {
    let Some(open) = open else { return Ok(false) };
    let open = open.metadata().await?;
    match tokio::fs::metadata(path).await {
        Ok(there) => Ok((open.dev(), open.ino()) != (there.dev(), there.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(true),
        Err(error) => Err(error),
    }
}

async fn follow_objects(jobs: &Jobs, id: Uuid, sender: &Sender) -> Result<(), ServiceError> {
    let (mut run, mut at) = (None, 0);
    loop {
        // Looked at before the recording is: whatever was written before the end is read after it.
        let job = jobs.job(id).await?;
        let running = job.state == JobState::Running;
        if at == 0 && running && !records(&job) {
            if !pause(jobs, sender, LOOK_EVERY).await {
                return Err(broken_off());
            }
            continue;
        }
        let present = jobs.run(id).await?;
        // A worker that takes the job up anew writes a recording of its own.
        let followed = run.filter(|_| at > 0).unwrap_or(present);
        run = Some(followed);
        let over = !running || followed != present;
        let sent = match jobs.recording(followed).await? {
            Some(Recorded::Joined(joined)) => send_from(&joined, &mut at, sender).await,
            // What was there has been removed.
            _ if at > 0 => return Err(broken_off()),
            _ => Ok(true),
        };
        match sent {
            Ok(true) => {}
            Ok(false) => return Ok(()),
            // Its parts have just been put together.
            Err(error) if error.kind() == io::ErrorKind::NotFound => continue,
            Err(error) => return Err(error.into()),
        }
        if over {
            return if followed == present { whole(&job) } else { Err(broken_off()) };
        }
        if !pause(jobs, sender, LOOK_EVERY).await {
            return Err(broken_off());
        }
    }
}

/// Waits before a recording is looked at again; whether anybody still wants it.
async fn pause(jobs: &Jobs, sender: &Sender, length: Duration) -> bool {
    tokio::select! {
        () = tokio::time::sleep(length) => true,
        () = sender.closed() => false,
        () = jobs.shutdown().cancelled() => false,
    }
}

/// Sends what there is from `at` on; whether anybody still wants it.
async fn send_from(joined: &Joined, at: &mut u64, sender: &Sender) -> io::Result<bool> {
    while *at < joined.length() {
        let chunk = joined.read(*at..*at + ranges::CHUNK).await?;
        *at += chunk.len() as u64;
        if sender.send(Ok(chunk)).await.is_err() {
            return Ok(false);
        }
    }
    Ok(true)
}
