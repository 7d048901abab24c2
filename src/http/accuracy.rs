//! Studies of what accuracy costs.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::http::header::LOCATION;
use axum::response::{IntoResponse, Response};

use super::app::App;
use super::caller::Caller;
use super::extract::JsonBody;
use super::jobs::JobBody;
use super::problem::ProblemDetails;
use super::responses::StudyNotQueued;
use crate::jobs::Posting;

/// Queues a study of what accuracy costs for a scenario.
///
/// The job's record holds the recommendations in the end; the table and the diagram are among its results.
#[utoipa::path(
    post, path = "/v1/accuracy", operation_id = "submit_study", tag = "jobs",
    request_body(description = "A scenario of at most 60 s whose motion is inline, and whose character is inline or has been posted before, and the \
        tolerances for which a setting is to be recommended",
        content = ref("#/components/schemas/StudyRequest")),
    responses(
        (status = 202, description = "Queued", body = ref("#/components/schemas/Job"),
            headers(("Location" = String, description = "Where the job is"))),
        StudyNotQueued))]
pub(super) async fn submit(
    State(app): State<App>,
    caller: Caller,
    JsonBody(body): JsonBody,
) -> Result<Response, ProblemDetails> {
    let posting = Posting { caller: caller.to_string(), key: None };
    let body = app.jobs.with_character(body.into(), "/scenario/character").await?;
    let body = JobBody::from(app.jobs.submit_study(body, posting).await?);
    Ok((StatusCode::ACCEPTED, [(LOCATION, body.place().to_owned())], Json(body)).into_response())
}
