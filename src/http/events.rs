//! A job as it happens, as server-sent events.

use std::convert::Infallible;
use std::time::Duration;

use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::IntoResponse;
use axum::response::sse::{Event, KeepAlive, Sse};
use serde::Serialize;
use tokio::sync::mpsc;
use tokio::time::MissedTickBehavior;
use tokio_stream::wrappers::ReceiverStream;
use uuid::Uuid;

use super::app::App;
use super::caller::Caller;
use super::extract::{NoQuery, UrlPath};
use super::jobs::JobBody;
use super::limits::Place;
use super::problem::ProblemDetails;
use super::responses::{JobId, NotFollowed};
use crate::jobs::{Job, JobState, Jobs, Live, ServiceError};
use gaitwright_learning::learn::Generation;

/// Time after which a job that runs elsewhere is looked at again, if nothing has been heard of it, and any job when the
/// store has not answered.
const LOOK_EVERY: Duration = Duration::from_secs(1);

/// Every generation's figures from the first on, then the end.
///
/// Events are `state` (the job, when it is taken up or put back), `progress` (`evaluations`: how many candidates have been
/// tried, once a second while that grows), `generation` (its figures; the event's id is its number, so that
/// `Last-Event-ID` goes on after it) and `end` (the job), after which the stream ends.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/events", tag = "jobs",
    params(
        JobId,
        ("Last-Event-ID" = Option<u32>, Header, description = "Go on after this generation")),
    responses(
        (status = 200, description = "Events `state`, `progress`, `generation` and `end`",
            content_type = "text/event-stream", body = String),
        NotFollowed))]
pub(super) async fn events(
    State(app): State<App>,
    caller: Caller,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
    headers: HeaderMap,
) -> Result<impl IntoResponse, ProblemDetails> {
    app.jobs.job(id).await?;
    let last = last_event(&headers)?;
    let place = app.stream(caller)?;
    let (sender, receiver) = mpsc::channel(16);
    let events = EventSender {
        jobs: app.jobs,
        id,
        next: last.map_or(0, |last| last.saturating_add(1)),
        sent: None,
        tried: 0,
        sender,
        _place: place,
    };
    tokio::spawn(events.run());
    Ok(Sse::new(ReceiverStream::new(receiver)).keep_alive(KeepAlive::default()))
}

/// The generation that the client has had last, where it says so.
fn last_event(headers: &HeaderMap) -> Result<Option<u32>, ProblemDetails> {
    let Some(id) = headers.get("last-event-id") else { return Ok(None) };
    let number = id.to_str().ok().and_then(|id| id.parse().ok());
    let detail = "Last-Event-ID: must be the number of a generation";
    number.map(Some).ok_or_else(|| ProblemDetails::new(StatusCode::BAD_REQUEST, detail))
}

/// How often a reader is told how many candidates have been tried.
const PROGRESS_EVERY: Duration = Duration::from_secs(1);

/// How many candidates a running job has tried.
#[derive(Debug, Serialize)]
struct Tried {
    evaluations: u64,
}

/// The stream has ended: its reader has left, or the end of the job has been sent.
struct StreamEnded;

struct EventSender {
    jobs: Jobs,
    id: Uuid,
    /// The generation to be sent next.
    next: u32,
    /// The state sent last.
    sent: Option<JobState>,
    /// The number of candidates sent last.
    tried: u64,
    sender: mpsc::Sender<Result<Event, Infallible>>,
    _place: Place,
}

impl EventSender {
    async fn run(mut self) {
        // From before the job is looked at: a change after the look wakes the wait below.
        let mut changes = self.jobs.changes();
        loop {
            let sent = match self.jobs.live(self.id) {
                Some(live) => self.follow(&live).await,
                None => self.idle().await,
            };
            if sent.is_err() {
                return;
            }
            let look = async {
                if self.jobs.is_shared() {
                    tokio::time::sleep(LOOK_EVERY).await;
                } else {
                    std::future::pending().await
                }
            };
            tokio::select! {
                () = changes.of(self.id) => {}
                () = look => {}
                () = self.sender.closed() => return,
                () = self.jobs.shutdown().cancelled() => return,
            }
        }
    }

    /// What the store says, which is asked again for as long as it cannot be reached or is overburdened.
    async fn answered<T, A>(&self, ask: impl Fn() -> A) -> Result<T, StreamEnded>
    where
        A: Future<Output = Result<T, ServiceError>>,
    {
        loop {
            match ask().await {
                Ok(answer) => return Ok(answer),
                Err(ServiceError::Store(error)) if error.is_unavailable() => {}
                Err(_) => return Err(StreamEnded),
            }
            tokio::select! {
                () = tokio::time::sleep(LOOK_EVERY) => {}
                () = self.sender.closed() => return Err(StreamEnded),
                () = self.jobs.shutdown().cancelled() => return Err(StreamEnded),
            }
        }
    }

    /// Sends the state of a job that does not run here, its curve and how many candidates it has tried so far if it runs elsewhere, and
    /// if it has ended its curve and the end.
    async fn idle(&mut self) -> Result<(), StreamEnded> {
        let job = self.answered(|| self.jobs.job(self.id)).await?;
        let ended = job.state.is_final();
        if !ended {
            self.state(job.clone()).await?;
        }
        if job.state == JobState::Queued {
            return Ok(());
        }
        let curve = self.answered(|| self.jobs.curve(self.id, self.next)).await?;
        self.figures(&curve).await?;
        if !ended {
            return self.progress(job.progress.evaluations).await;
        }
        self.send("end", &JobBody::from(job), None).await?;
        Err(StreamEnded)
    }

    /// Sends what happens in a running job until it is over.
    async fn follow(&mut self, live: &Live) -> Result<(), StreamEnded> {
        let job = self.answered(|| self.jobs.job(self.id)).await?;
        self.state(job).await?;
        let mut moment = live.watch();
        let mut seconds = tokio::time::interval(PROGRESS_EVERY);
        seconds.set_missed_tick_behavior(MissedTickBehavior::Skip);
        loop {
            let over = moment.borrow_and_update().over;
            self.figures(&live.curve_from(self.next)).await?;
            if over {
                return self.idle().await;
            }
            tokio::select! {
                _ = moment.changed() => {}
                _ = seconds.tick() => self.progress(live.tried()).await?,
                () = self.sender.closed() => return Err(StreamEnded),
                () = self.jobs.shutdown().cancelled() => return Err(StreamEnded),
            }
        }
    }

    /// Sends a job's state when it is another than was sent last.
    async fn state(&mut self, job: Job) -> Result<(), StreamEnded> {
        if self.sent.replace(job.state) == Some(job.state) {
            return Ok(());
        }
        self.send("state", &JobBody::from(job), None).await
    }

    /// Sends how many candidates have been tried, where it is more than was sent last.
    async fn progress(&mut self, evaluations: u64) -> Result<(), StreamEnded> {
        if evaluations > self.tried {
            self.tried = evaluations;
            self.send("progress", &Tried { evaluations }, None).await?;
        }
        Ok(())
    }

    async fn figures(&mut self, curve: &[Generation]) -> Result<(), StreamEnded> {
        let next = self.next;
        for figures in curve.iter().filter(|figures| figures.generation >= next) {
            self.send("generation", figures, Some(figures.generation)).await?;
            self.next = figures.generation + 1;
        }
        Ok(())
    }

    async fn send<T: Serialize>(&self, kind: &str, data: &T, id: Option<u32>) -> Result<(), StreamEnded> {
        let mut event = Event::default().event(kind).json_data(data).map_err(|_| StreamEnded)?;
        if let Some(id) = id {
            event = event.id(id.to_string());
        }
        self.sender.send(Ok(event)).await.map_err(|_| StreamEnded)
    }
}
