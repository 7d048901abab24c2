//! The motions of a job's repertoire, one by one.

use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use uuid::Uuid;

use super::app::App;
use super::exports::{Wanted, converted};
use super::extract::{UrlPath, UrlQuery};
use super::problem::ProblemDetails;
use super::responses::{JobId, NotExported, PreliminaryQuery};
use super::results::{Choice, check_ended, check_left, not_ready, served};
use crate::export::ExportFormat;
use crate::jobs::{Artefact, Job, JobFile, Shelf};

/// One motion of the repertoire, as a document or in a form that other programs open.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motions/{motion}", operation_id = "numbered_motion", tag = "results",
    params(JobId, PreliminaryQuery,
        ("motion" = String, Path, description = "The motion's number, from 1: `2` is its document, `2.glb`, `2.bvh`, \
            `2.csv`, `2.yaml` (ROS 2) and `2.xml` (MuJoCo) are its exports"),
        ("fps" = Option<f64>, Query, description = "Of exports: frames per second, 1 to 1000; 60 if left out"),
        ("in_place" = Option<bool>, Query, description = "Of exports: whether the root stays where it is")),
    responses(
        (status = 200, description = "The motion", content(
            (ref("#/components/schemas/Motion") = "application/json"),
            (Vec<u8> = "model/gltf-binary"), (String = "text/plain"), (String = "text/csv"),
            (String = "application/yaml"), (String = "application/xml"))),
        NotExported))]
pub(super) async fn motion(
    State(app): State<App>,
    UrlPath((id, name)): UrlPath<(Uuid, String)>,
    UrlQuery(wanted): UrlQuery<Wanted>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    let job = app.jobs.job(id).await?;
    check_left(&job, Artefact::Motions)?;
    let choice = wanted.choice();
    let (number, format) = match name.split_once('.') {
        None => (name.as_str(), None),
        Some((number, format)) => (number, Some(export_format(format)?)),
    };
    if format.is_none() && wanted.is_of_exports() {
        let detail = "fps, in_place: a motion document has neither, exports such as 1.glb have both";
        return Err(ProblemDetails::new(StatusCode::BAD_REQUEST, detail));
    }
    check_ended(&job, &choice, &format!("motion {name}"))?;
    let file = file(&app, &job, number).await?;
    let document = JobFile::shelved(id, Shelf::Motions, &file);
    match format {
        None => served(&app, &job, (&choice, &headers), (&document, &file, "application/json")).await,
        Some(format) => converted(&app, &job, &document, format, (&wanted, &headers)).await,
    }
}

/// The gait report of one motion of the repertoire.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motions/{motion}/gait", operation_id = "numbered_gait", tag = "results",
    params(JobId, PreliminaryQuery, ("motion" = u32, Path, description = "The motion's number, from 1")),
    responses(
        (status = 200, description = "The gait report", body = ref("#/components/schemas/GaitReport")),
        NotExported))]
pub(super) async fn gait(
    State(app): State<App>,
    UrlPath((id, number)): UrlPath<(Uuid, String)>,
    UrlQuery(choice): UrlQuery<Choice>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    let job = app.jobs.job(id).await?;
    check_left(&job, Artefact::Motions)?;
    check_ended(&job, &choice, &format!("gait of motion {number}"))?;
    let file = file(&app, &job, &number).await?;
    let report = JobFile::shelved(id, Shelf::Gaits, &file);
    served(&app, &job, (&choice, &headers), (&report, &file, "application/json")).await
}

/// The form whose files have this extension.
fn export_format(extension: &str) -> Result<ExportFormat, ProblemDetails> {
    let found = ExportFormat::ALL.into_iter().find(|format| format.extension() == extension);
    found.ok_or_else(|| {
        let served = ExportFormat::ALL.map(ExportFormat::extension).join(", ");
        ProblemDetails::not_found(format!("motions are not served as `{extension}`: {served} are"))
    })
}

/// Name of the file of the motion with this number.
async fn file(app: &App, job: &Job, number: &str) -> Result<String, ProblemDetails> {
    // Written as it is served, so that there is one address of each.
    let read = number.parse::<u32>().ok().filter(|read| *read > 0 && read.to_string() == number);
    let Some(read) = read else {
        let detail = format!("motions are numbered from 1; there is no motion {number}");
        return Err(ProblemDetails::not_found(detail));
    };
    let repertoire = app.jobs.repertoire(job.id).await?.filter(|repertoire| !repertoire.motions.is_empty());
    let Some(repertoire) = repertoire else {
        return Err(not_ready(job, &format!("motion {number}")));
    };
    let entry = repertoire.entry(read);
    entry.map(|entry| entry.file.clone()).ok_or_else(|| {
        let count = repertoire.motions.len();
        ProblemDetails::not_found(format!(
            "the job has {count} motions, numbered from 1; there is no motion {number}"
        ))
    })
}
