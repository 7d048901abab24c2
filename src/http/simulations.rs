//! One simulation, as JSON lines.

use std::io;
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::extract::State;
use axum::http::header::CONTENT_TYPE;
use axum::response::{IntoResponse, Response};
use tokio::runtime::Handle;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;

use super::app::App;
use super::caller::Caller;
use super::extract::JsonBody;
use super::problem::ProblemDetails;
use super::responses::NotSimulated;
use crate::jobs::Jobs;
use gaitwright_learning::accuracy::{self, StudyError};
use gaitwright_learning::scenario::{Line, NoFiles, PreparedScenario, Scenario, ScenarioEnd};
use gaitwright_physics::fault::InputError;

/// Most steps of a simulation over HTTP; longer ones are for the command line.
const MOST_STEPS: u64 = 1_000_000;

/// How long a simulation may take: what takes longer keeps others from their turns.
const LONGEST: Duration = Duration::from_mins(10);

/// Lines that may wait for their reader.
const BUFFERED_LINES: usize = 64;

/// How long a reader may leave the buffer full before the simulation is stopped.
const READER_TIMEOUT: Duration = Duration::from_secs(30);

/// Runs one simulation.
///
/// Answers with JSON lines, one a sample, the last a summary of how it ended.
#[utoipa::path(
    post, path = "/v1/simulations", tag = "simulations",
    request_body(description = "A scenario whose motion is inline, and whose character is inline or has been posted before",
        content = ref("#/components/schemas/Scenario")),
    responses(
        (status = 200, description = "One line a sample, then a summary; broken off without one after ten minutes",
            content_type = "application/jsonl",
            body = ref("#/components/schemas/Line")),
        NotSimulated))]
pub(super) async fn simulate(
    State(app): State<App>,
    caller: Caller,
    JsonBody(body): JsonBody,
) -> Result<Response, ProblemDetails> {
    let place = app.simulation(caller)?;
    let body = app.jobs.with_character(body.into(), "/character").await?;
    let jobs = app.jobs.clone();
    let prepared = app.jobs.compute(move |given_up| Ok(prepare(&jobs, &body, given_up)?)).await?;
    let (sender, receiver) = mpsc::channel(BUFFERED_LINES);
    let (shutdown, runtime) = (app.jobs.shutdown().clone(), Handle::current());
    tokio::task::spawn_blocking(move || {
        // Between two samples nothing is sent, so that only asking shows whether the reader has left.
        let until = Instant::now() + LONGEST;
        let wanted = || !sender.is_closed() && !shutdown.is_cancelled() && Instant::now() < until;
        let end = prepared.run_while(wanted, |line| send(&runtime, &sender, &line));
        drop(place);
        if end == ScenarioEnd::Stopped {
            // A body that just ended would look as if it were whole.
            let broken_off = Err(io::Error::other("the simulation was stopped"));
            let _ = runtime.block_on(sender.send_timeout(broken_off, READER_TIMEOUT));
        }
    });
    let lines = Body::from_stream(ReceiverStream::new(receiver));
    Ok(([(CONTENT_TYPE, "application/jsonl")], lines).into_response())
}

fn prepare(jobs: &Jobs, body: &[u8], given_up: &dyn Fn() -> bool) -> Result<PreparedScenario, InputError> {
    let scenario = Scenario::parse(body)?;
    jobs.check_memory(&scenario)?;
    let prepared = accuracy::prepare_until(&scenario, &NoFiles, given_up).map_err(|error| match error {
        StudyError::Input(error) => error,
        error => InputError::impossible("/accuracy/tolerance", error.to_string()),
    })?;
    if prepared.steps() > MOST_STEPS {
        let reason =
            format!("{} steps are more than the {MOST_STEPS} that are simulated here", prepared.steps());
        return Err(InputError::impossible("/duration", reason));
    }
    Ok(prepared)
}

/// Sends a line to the reader; whether there still is one.
fn send(runtime: &Handle, sender: &mpsc::Sender<io::Result<Bytes>>, line: &Line) -> bool {
    let Ok(mut text) = serde_json::to_vec(line) else { return false };
    text.push(b'\n');
    let text = Ok(Bytes::from(text));
    match sender.try_send(text) {
        Ok(()) => true,
        Err(mpsc::error::TrySendError::Full(text)) => {
            runtime.block_on(sender.send_timeout(text, READER_TIMEOUT)).is_ok()
        }
        Err(mpsc::error::TrySendError::Closed(_)) => false,
    }
}
