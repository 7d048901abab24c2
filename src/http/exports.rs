//! A job's motion in the forms that other programs open.

use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use serde::Deserialize;
use uuid::Uuid;

use super::app::App;
use super::extract::{UrlPath, UrlQuery};
use super::problem::ProblemDetails;
use super::responses::{JobId, NotExported, PreliminaryQuery};
use super::results::{Choice, check_ended, check_left, given, not_ready};
use crate::export::{DEFAULT_FPS, ExportFormat, ExportOptions};
use crate::jobs::{Artefact, Job, JobFile};

/// How a motion is wanted.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Wanted {
    #[serde(default)]
    preliminary: bool,
    fps: Option<f64>,
    #[serde(default)]
    in_place: bool,
}

impl Wanted {
    pub(super) fn choice(&self) -> Choice {
        Choice { preliminary: self.preliminary }
    }

    /// Whether anything is said that only exports have.
    pub(super) fn is_of_exports(&self) -> bool {
        self.fps.is_some() || self.in_place
    }

    fn options(&self) -> ExportOptions {
        ExportOptions { fps: self.fps.unwrap_or(DEFAULT_FPS), in_place: self.in_place }
    }
}

/// The character and its motion as glTF binary.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motion.glb", operation_id = "motion_glb", tag = "results",
    params(JobId, PreliminaryQuery,
        ("fps" = Option<f64>, Query, description = "Frames per second, 1 to 1000; 60 if left out"),
        ("in_place" = Option<bool>, Query, description = "Only the animation without root motion, and the entry")),
    responses(
        (status = 200, description = "Animations of the loop, with root motion and in place, and of the entry",
            content_type = "model/gltf-binary", body = Vec<u8>),
        NotExported))]
pub(super) async fn glb(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(wanted): UrlQuery<Wanted>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    exported(&app, id, ExportFormat::Glb, (&wanted, &headers)).await
}

/// One cycle of the motion as BVH.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motion.bvh", operation_id = "motion_bvh", tag = "results",
    params(JobId, PreliminaryQuery,
        ("fps" = Option<f64>, Query, description = "Frames per second, 1 to 1000; 60 if left out"),
        ("in_place" = Option<bool>, Query, description = "Whether the root stays where it is")),
    responses(
        (status = 200, description = "Skeleton and frames", content_type = "text/plain", body = String),
        NotExported))]
pub(super) async fn bvh(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(wanted): UrlQuery<Wanted>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    exported(&app, id, ExportFormat::Bvh, (&wanted, &headers)).await
}

/// The motion as comma-separated values, a row a frame.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motion.csv", operation_id = "motion_csv", tag = "results",
    params(JobId, PreliminaryQuery,
        ("fps" = Option<f64>, Query, description = "Frames per second, 1 to 1000; 60 if left out"),
        ("in_place" = Option<bool>, Query, description = "Whether the root stays where it is")),
    responses(
        (status = 200, description = "Root, angles and targets", content_type = "text/csv", body = String),
        NotExported))]
pub(super) async fn csv(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(wanted): UrlQuery<Wanted>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    exported(&app, id, ExportFormat::Csv, (&wanted, &headers)).await
}

/// The motion as a trajectory for ROS 2.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motion.yaml", operation_id = "motion_ros", tag = "results",
    params(JobId, PreliminaryQuery,
        ("fps" = Option<f64>, Query, description = "Points per second, 1 to 1000; 60 if left out")),
    responses(
        (status = 200, description = "A trajectory_msgs/JointTrajectory", content_type = "application/yaml", body = String),
        NotExported))]
pub(super) async fn ros(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(wanted): UrlQuery<Wanted>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    exported(&app, id, ExportFormat::Ros, (&wanted, &headers)).await
}

/// The motion as a MuJoCo model with keyframes of poses and controls.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motion.xml", operation_id = "motion_mujoco", tag = "results",
    params(JobId, PreliminaryQuery,
        ("fps" = Option<f64>, Query, description = "Keyframes per second, 1 to 1000; 60 if left out")),
    responses(
        (status = 200, description = "An MJCF document", content_type = "application/xml", body = String),
        NotExported))]
pub(super) async fn mujoco(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(wanted): UrlQuery<Wanted>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    exported(&app, id, ExportFormat::Mujoco, (&wanted, &headers)).await
}

/// All motions of the repertoire in one glTF binary, with the animations of each called after it.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/motions.glb", operation_id = "motions_glb", tag = "results",
    params(JobId, PreliminaryQuery,
        ("fps" = Option<f64>, Query, description = "Frames per second, 1 to 1000; 60 if left out"),
        ("in_place" = Option<bool>, Query, description = "Only the animations without root motion, and the entries")),
    responses(
        (status = 200, description = "Of each motion the animations that `motion.glb` has of one",
            content_type = "model/gltf-binary", body = Vec<u8>),
        NotExported))]
pub(super) async fn repertoire(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    UrlQuery(wanted): UrlQuery<Wanted>,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    let job = app.jobs.job(id).await?;
    check_left(&job, Artefact::Motions)?;
    check_ended(&job, &wanted.choice(), "motions.glb")?;
    match app.jobs.exported_repertoire(id, wanted.options()).await? {
        Some(file) => Ok(given(&job, &headers, ExportFormat::Glb.media_type(), file)),
        None => Err(not_ready(&job, "motions.glb")),
    }
}

async fn exported(
    app: &App,
    id: Uuid,
    format: ExportFormat,
    asked: (&Wanted, &HeaderMap),
) -> Result<Response, ProblemDetails> {
    let job = app.jobs.job(id).await?;
    check_left(&job, Artefact::Motion)?;
    converted(app, &job, &JobFile::artefact(id, Artefact::Motion), format, asked).await
}

/// The motion document `file`, in another format.
pub(super) async fn converted(
    app: &App,
    job: &Job,
    file: &JobFile,
    format: ExportFormat,
    (wanted, headers): (&Wanted, &HeaderMap),
) -> Result<Response, ProblemDetails> {
    let name = file.name().replace(".json", &format!(".{}", format.extension()));
    check_ended(job, &wanted.choice(), &name)?;
    match app.jobs.exported(file, format, wanted.options()).await? {
        Some(exported) => Ok(given(job, headers, format.media_type(), exported)),
        None => Err(not_ready(job, &name)),
    }
}
