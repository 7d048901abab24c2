//! The description of the REST interface (OpenAPI 3.1).
//!
//! The calls are described at their handlers and gathered by the router; schemas come from the types of the documents.
//! `refinements.json` adds what types do not say: bounds, formats and constants of documents, as a JSON Merge Patch
//! (RFC 7396) of their schemas, and the schemas of parameters by their names. That the service keeps to the bounds is tested.

mod operations;

use schemars::generate::SchemaSettings;
use schemars::{JsonSchema, SchemaGenerator};
use serde::Deserialize;
use serde_json::{Map, Value, json};
use utoipa::OpenApi;

use super::access::OPEN;
use super::{characters, jobs, problem};
use crate::export::Curve;
use crate::jobs::{JobRequest, Repertoire, StudyRequest, TrainingReport};
use gaitwright_learning::accuracy::Table;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::scenario::{Line, Scenario};
use gaitwright_physics::motion::Motion;

#[derive(OpenApi)]
#[openapi(
    info(
        title = "gaitwright",
        description = "Learns physically valid motion for any articulated character. JSON everywhere: SI units, \
            radians, seconds, quaternions [w, x, y, z], right-handed, z up. Errors are problem documents (RFC 9457)."
    ),
    tags(
        (name = "jobs", description = "Learning, and the price of accuracy, as jobs"),
        (name = "results", description = "What a job leaves behind"),
        (name = "characters", description = "What was understood of a character"),
        (name = "simulations", description = "One simulation"),
        (name = "service", description = "How the service itself is"),
    ))]
struct Introduction;

/// The description without its calls.
pub(super) fn introduction() -> utoipa::openapi::OpenApi {
    Introduction::openapi()
}

/// What types do not say of their documents, and of parameters.
#[derive(Deserialize)]
struct Refinements {
    schemas: Value,
    parameters: Map<String, Value>,
}

/// The description as it is served: `description` with the schema of every document in it. `token` is whether requests
/// have to bring one.
///
/// # Errors
///
/// When it cannot be put as JSON.
pub(super) fn complete(
    description: utoipa::openapi::OpenApi,
    token: bool,
) -> Result<Value, serde_json::Error> {
    let refinements: Refinements = serde_json::from_str(include_str!("refinements.json"))?;
    let mut description = serde_json::to_value(description)?;
    description["jsonSchemaDialect"] = json!("https://json-schema.org/draft/2020-12/schema");
    let mut components = json!({ "schemas": schemas() });
    patch(&mut components["schemas"], &refinements.schemas);
    if token {
        components["securitySchemes"] = json!({
            "bearer": { "type": "http", "scheme": "bearer" },
            "basic": { "type": "http", "scheme": "basic", "description": "The token is the password of any user" },
        });
        description["security"] = json!([{ "bearer": [] }, { "basic": [] }]);
        for probe in OPEN {
            description["paths"][probe]["get"]["security"] = json!([]);
        }
    }
    description["components"] = components;
    if let Some(paths) = description["paths"].as_object_mut() {
        operations::complete(paths, &refinements.parameters, token);
    }
    Ok(description)
}

/// Changes `target` as `change` says (RFC 7396, section 2).
fn patch(target: &mut Value, change: &Value) {
    let Value::Object(members) = change else {
        *target = change.clone();
        return;
    };
    if !target.is_object() {
        *target = json!({});
    }
    for (name, change) in members {
        if change.is_null() {
            target.as_object_mut().map(|target| target.remove(name));
        } else {
            patch(&mut target[name], change);
        }
    }
}

fn schemas() -> Map<String, Value> {
    // A document that goes both ways is described as a request may bring it.
    let settings = SchemaSettings::draft2020_12().for_deserialize().with(|settings| {
        settings.definitions_path = "/components/schemas".into();
        settings.meta_schema = None;
    });
    let mut generator = settings.into_generator();
    add::<JobRequest>(&mut generator);
    add::<jobs::JobBody>(&mut generator);
    add::<jobs::JobsBody>(&mut generator);
    add::<StudyRequest>(&mut generator);
    add::<Table>(&mut generator);
    add::<Curve>(&mut generator);
    add::<GaitReport>(&mut generator);
    add::<Motion>(&mut generator);
    add::<Repertoire>(&mut generator);
    add::<TrainingReport>(&mut generator);
    add::<characters::CharacterBody>(&mut generator);
    add::<characters::CharactersBody>(&mut generator);
    add::<Scenario>(&mut generator);
    add::<Line>(&mut generator);
    add::<problem::ProblemDetails>(&mut generator);
    let mut schemas = generator.take_definitions(true);
    let file = json!({ "type": "string", "contentMediaType": "application/octet-stream",
        "description": "A URDF, a character document, or a zip of a URDF with its meshes" });
    let forms = json!({
        "AnyObject": { "type": "object" },
        "CharacterDocument": { "type": "object", "description": "See /v1/schemas/character" },
        "Event": { "type": "object", "required": ["event", "data"], "description": "One event of a stream", "properties": {
            "event": { "enum": ["state", "progress", "generation", "end"] },
            "data": { "type": "string", "contentMediaType": "application/json",
                "description": "The job, how many candidates it has tried, or the figures of a generation" },
            "id": { "type": "string", "description": "The number of the generation" } } },
        "CharacterForm": { "type": "object", "required": ["character"], "properties": { "character": file } },
        "JobForm": { "type": "object", "required": ["character"], "properties": {
            "character": file,
            "job": { "type": "string", "contentMediaType": "application/json",
                "description": "A job document without its character" } } },
    });
    if let Value::Object(forms) = forms {
        schemas.extend(forms);
    }
    schemas
}

fn add<T: JsonSchema>(generator: &mut SchemaGenerator) {
    generator.subschema_for::<T>();
}
