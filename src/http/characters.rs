//! Characters: what was understood of them, kept for later jobs.

use axum::Json;
use axum::extract::State;
use axum::http::header::{CONTENT_TYPE, LOCATION};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use jiff::Timestamp;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use super::app::App;
use super::conditional::{tag, tagged};
use super::extract::{NoQuery, Upload, UrlPath, UrlQuery, page_limit};
use super::problem::ProblemDetails;
use super::responses::{CharacterNotDeleted, JobId, NoCharacter, NoSuchCharacter, NotKept};
use crate::export::ExportFormat;
use crate::jobs::{Expiry, Findings, StoredCharacter};
use gaitwright_physics::character::{Source, schema};
use gaitwright_physics::fault::{Fault, InputError};

/// A character as kept.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Character")]
pub(super) struct CharacterBody {
    /// Serves in jobs as `{"id": …}`.
    #[schemars(with = "String")]
    id: Uuid,
    #[serde(flatten)]
    findings: Findings,
}

/// Keeps a character and reports what was understood of it.
#[utoipa::path(
    post, path = "/v1/characters", operation_id = "add_character", tag = "characters",
    request_body(description = "A character document, a URDF, a zip of a URDF with its meshes, or a form with \
        one of these as its part `character`", content(
        (ref("#/components/schemas/CharacterDocument") = "application/json"),
        (String = "application/xml"), (String = "text/xml"), (Vec<u8> = "application/zip"),
        (ref("#/components/schemas/CharacterForm") = "multipart/form-data"))),
    responses(
        (status = 201, description = "Kept", body = ref("#/components/schemas/Character"),
            headers(("Location" = String, description = "Where the character is"))),
        NotKept))]
pub(super) async fn add(State(app): State<App>, upload: Upload) -> Result<Response, ProblemDetails> {
    let (bytes, source) = match upload {
        Upload::Json(body) => (body, Some(Source::Json)),
        Upload::Urdf(body) => (body, Some(Source::Urdf)),
        Upload::Zip(body) => (body, Some(Source::Zip)),
        Upload::Form(form) if form.job.is_some() => {
            let fault = Fault::new("part \"job\"", "a character is kept without a job");
            return Err(InputError::Impossible(vec![fault]).into());
        }
        Upload::Form(form) => (form.character, None),
    };
    let (id, findings) = app.jobs.add_character(bytes.into(), source).await?;
    let location = format!("/v1/characters/{id}");
    let body = CharacterBody { id, findings };
    Ok((StatusCode::CREATED, [(LOCATION, location)], Json(body)).into_response())
}

/// A character in a list.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "CharacterSummary")]
struct SummaryBody {
    /// Serves in jobs as `{"id": …}`.
    #[schemars(with = "String")]
    id: Uuid,
    /// Its name; `null` where what was found in it cannot be read by this version.
    name: Option<String>,
    /// `sha256:…` of its document.
    digest: String,
    /// Size of its document, bytes.
    bytes: u64,
    /// When it was posted, or a job with it, the last time.
    #[schemars(with = "String")]
    used: Timestamp,
    /// When it goes; `null` while it is kept without a limit.
    expires: Option<Expiry>,
}

impl From<StoredCharacter> for SummaryBody {
    fn from(character: StoredCharacter) -> Self {
        let StoredCharacter { id, digest, name, bytes, used, expires } = character;
        Self { id, name, digest, bytes, used, expires }
    }
}

/// A page of characters.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[schemars(rename = "Characters")]
pub(super) struct CharactersBody {
    /// `gaitwright/characters@1`.
    format: &'static str,
    /// The newest first.
    characters: Vec<SummaryBody>,
    /// Where the next page is; `null` on the last.
    next: Option<String>,
}

/// Which characters to list.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Selection {
    limit: Option<u32>,
    after: Option<Uuid>,
}

/// Lists characters, the newest first.
#[utoipa::path(
    get, path = "/v1/characters", operation_id = "list_characters", tag = "characters",
    params(
        ("limit" = Option<u32>, Query, description = "Characters of a page, 1 to 200; 20 if left out"),
        ("after" = Option<String>, Query, description = "Only characters older than the one with this id")),
    responses(
        (status = 200, description = "A page of characters", body = ref("#/components/schemas/Characters"))))]
pub(super) async fn list(
    State(app): State<App>,
    UrlQuery(selection): UrlQuery<Selection>,
) -> Result<Json<CharactersBody>, ProblemDetails> {
    let limit = page_limit(selection.limit)?;
    // One more than asked for shows whether there is a next page.
    let mut characters = app.jobs.characters(selection.after, limit + 1).await?;
    let more = characters.len() > limit as usize;
    characters.truncate(limit as usize);
    let next = characters.last().filter(|_| more);
    let next = next.map(|last| format!("/v1/characters?limit={limit}&after={}", last.id));
    let characters = characters.into_iter().map(SummaryBody::from).collect();
    Ok(Json(CharactersBody { format: "gaitwright/characters@1", characters, next }))
}

/// Deletes a character; jobs that have ended keep what they were posted with.
#[utoipa::path(
    delete, path = "/v1/characters/{id}", operation_id = "delete_character", tag = "characters",
    params(("id" = String, Path, description = "The character's id")),
    responses((status = 204, description = "The character is deleted"), CharacterNotDeleted))]
pub(super) async fn delete(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
) -> Result<StatusCode, ProblemDetails> {
    app.jobs.delete_character(id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// What was understood of a character.
#[utoipa::path(
    get, path = "/v1/characters/{id}", operation_id = "show_character", tag = "characters",
    params(("id" = String, Path, description = "The character's id")),
    responses(
        (status = 200, description = "The character", body = ref("#/components/schemas/Character")),
        NoSuchCharacter))]
pub(super) async fn show(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
) -> Result<Json<CharacterBody>, ProblemDetails> {
    Ok(Json(CharacterBody { id, findings: app.jobs.findings(id).await? }))
}

/// A character as it was posted.
#[utoipa::path(
    get, path = "/v1/characters/{id}/file", operation_id = "character_file", tag = "characters",
    params(("id" = String, Path, description = "The character's id")),
    responses(
        (status = 200, description = "The file, by what it holds", content(
            (ref("#/components/schemas/CharacterDocument") = "application/json"),
            (String = "application/xml"), (Vec<u8> = "application/zip"))),
        NoSuchCharacter))]
pub(super) async fn file(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    Ok(as_posted(&headers, app.jobs.character_file(id).await?))
}

/// A character in its standing pose, to be looked at.
///
/// The node of every link that a joint moves has `joint`, `kind`, `axis` and `angle` in its `extras`: with these it can be
/// put into any other pose.
#[utoipa::path(
    get, path = "/v1/characters/{id}/standing.glb", operation_id = "standing_glb", tag = "characters",
    params(("id" = String, Path, description = "The character's id")),
    responses(
        (status = 200, description = "Its links as a tree of nodes with their shapes",
            content_type = "model/gltf-binary", body = Vec<u8>),
        NoSuchCharacter))]
pub(super) async fn standing(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
) -> Result<Response, ProblemDetails> {
    let model = app.jobs.standing_character(id).await?;
    Ok(([(CONTENT_TYPE, ExportFormat::Glb.media_type())], model).into_response())
}

/// The character that a job works on, as it was posted.
#[utoipa::path(
    get, path = "/v1/jobs/{id}/character", operation_id = "job_character", tag = "jobs",
    params(JobId),
    responses(
        (status = 200, description = "The file, by what it holds", content(
            (ref("#/components/schemas/CharacterDocument") = "application/json"),
            (String = "application/xml"), (Vec<u8> = "application/zip"))),
        NoCharacter))]
pub(super) async fn of_job(
    State(app): State<App>,
    UrlPath(id): UrlPath<Uuid>,
    _: NoQuery,
    headers: HeaderMap,
) -> Result<Response, ProblemDetails> {
    let file = app.jobs.job_character(id).await?;
    let none = || ProblemDetails::not_found("the character of a study is part of its scenario");
    Ok(as_posted(&headers, file.ok_or_else(none)?))
}

/// A character's file with the media type of what it holds, and its tag.
fn as_posted(headers: &HeaderMap, file: Vec<u8>) -> Response {
    let media_type = match Source::detect(&file) {
        Some(Source::Json) => "application/json",
        Some(Source::Zip) => "application/zip",
        Some(Source::Urdf) | None => "application/xml",
    };
    tagged(headers, media_type, &tag(&[&file]), file)
}

/// The JSON Schema of character documents.
#[utoipa::path(
    get, path = "/v1/schemas/character", tag = "characters",
    responses((status = 200, description = "A JSON Schema (2020-12)", content_type = "application/schema+json",
        body = ref("#/components/schemas/AnyObject"))))]
pub(super) async fn character_schema() -> Response {
    let mut response = Json(schema()).into_response();
    let kind = axum::http::HeaderValue::from_static("application/schema+json");
    response.headers_mut().insert(CONTENT_TYPE, kind);
    response
}
