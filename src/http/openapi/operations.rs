//! What holds of many calls at once: answers that each of them may get, parameters, examples, and what leads from one
//! to another.

use serde_json::{Map, Value, json};

use crate::http::access::OPEN;

/// A URDF that every example is about.
const ARM: &str = include_str!("arm.urdf");

/// Adds to every call in `paths` what it shares with others. `parameters` are schemas by the name of a parameter; `token`
/// is whether requests have to bring one.
pub(super) fn complete(paths: &mut Map<String, Value>, parameters: &Map<String, Value>, token: bool) {
    for (path, operations) in paths.iter_mut() {
        for (method, operation) in operations.as_object_mut().into_iter().flatten() {
            let Some(operation) = operation.as_object_mut() else { continue };
            refine_parameters(operation, parameters);
            complete_bodies(operation, path);
            complete_answers(operation, (method, path), token);
        }
    }
    link(paths);
}

/// Gives parameters the schemas that they have wherever they occur.
fn refine_parameters(operation: &mut Map<String, Value>, schemas: &Map<String, Value>) {
    for parameter in operation.get_mut("parameters").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(schema) = parameter["name"].as_str().and_then(|name| schemas.get(name)) {
            parameter["schema"] = schema.clone();
        }
    }
}

/// Describes bytes as such, and gives an example of every body that is sent.
fn complete_bodies(operation: &mut Map<String, Value>, path: &str) {
    let sent = operation.get_mut("requestBody").map(|body| {
        body["required"] = json!(true);
        &mut body["content"]
    });
    for (kind, content) in sent.and_then(Value::as_object_mut).into_iter().flatten() {
        describe_bytes(kind, content);
        if let Some(example) = example(path, kind) {
            content["example"] = example;
        }
    }
    for (_, answer) in operation.get_mut("responses").and_then(Value::as_object_mut).into_iter().flatten() {
        for (kind, content) in answer.get_mut("content").and_then(Value::as_object_mut).into_iter().flatten()
        {
            describe_bytes(kind, content);
        }
    }
}

fn describe_bytes(kind: &str, content: &mut Value) {
    if kind == "text/event-stream" {
        content["schema"] = json!({ "$ref": "#/components/schemas/Event" });
    }
    if content["schema"]["type"] == "array" {
        content["schema"] = json!({ "type": "string", "format": "binary", "contentMediaType": kind });
    }
}

/// A body that is accepted at `path`.
fn example(path: &str, kind: &str) -> Option<Value> {
    let character = json!({ "urdf": ARM });
    match (path, kind) {
        (_, "application/xml" | "text/xml") => Some(json!(ARM)),
        ("/v1/jobs", "application/json") => Some(json!({
            "format": "gaitwright/job@1", "character": character, "task": { "direction": [1, 0, 0] },
            "learning": { "generations": 2 }, "seed": 1 })),
        ("/v1/jobs", "multipart/form-data") => {
            Some(json!({ "character": ARM, "job": "{\"learning\": {\"generations\": 2}}" }))
        }
        ("/v1/characters", "application/json") => Some(json!({
            "format": "gaitwright/character@1", "name": "arm",
            "links": [{ "name": "base", "density": 900, "shapes": [{ "kind": "sphere", "radius": 0.1 }] },
                { "name": "tip", "density": 900, "shapes": [{ "kind": "sphere", "radius": 0.05 }] }],
            "joints": [{ "name": "hinge", "kind": "revolute", "parent": "base", "child": "tip", "axis": [0, 1, 0],
                "limits": { "lower": -1, "upper": 1 }, "origin": { "position": [0.3, 0, 0] } }] })),
        ("/v1/characters", "multipart/form-data") => Some(json!({ "character": ARM })),
        ("/v1/simulations", _) => Some(json!({ "character": character, "duration": 0.1 })),
        ("/v1/accuracy", _) => {
            Some(json!({ "scenario": { "character": character, "duration": 0.1 }, "tolerances": [0.01] }))
        }
        _ => None,
    }
}

/// Adds the answers that come from what every request goes through, and the headers of those that ask to wait.
fn complete_answers(operation: &mut Map<String, Value>, (method, path): (&str, &str), token: bool) {
    let probe = OPEN.contains(&path);
    let body = operation.contains_key("requestBody");
    let mut parameters = operation.get("parameters").and_then(Value::as_array).into_iter().flatten();
    // A path that cannot be read leads nowhere, which is 404. Calls about one thing refuse parameters that they do not take.
    let read = parameters.any(|parameter| parameter["in"] != "path") || path.contains('{');
    let answers = [
        ("400", body || read, "The request cannot be read"),
        ("401", token && !probe, "The request brings no token, or a wrong one"),
        ("403", matches!(method, "post" | "delete"), "The request comes from a page of another site"),
        ("408", true, "The request, or the answer, took too long"),
        ("413", body, "The body is too large"),
        ("415", body, "The body is of a type that is not read here"),
        ("421", true, "The service is not called so"),
        ("429", !probe, "Too many requests of this caller"),
        ("500", true, "The request could not be answered; the log says why"),
        (
            "503",
            path.starts_with("/v1/") || path == "/metrics",
            "The data folder cannot be read or written at present",
        ),
    ];
    let of_job = path.starts_with("/v1/jobs/{id}/") && !path.ends_with("/events");
    let kept = method == "get" && (of_job || path == "/v1/characters/{id}/file");
    let Some(responses) = operation.get_mut("responses").and_then(Value::as_object_mut) else { return };
    if kept {
        responses.insert(
            "304".to_owned(),
            json!({ "description": "The client has it already, as its headers say" }),
        );
    }
    for (status, possible, when) in answers {
        if possible && !responses.contains_key(status) {
            let schema = json!({ "$ref": "#/components/schemas/Problem" });
            let content = json!({ "application/problem+json": { "schema": schema } });
            responses.insert(status.to_owned(), json!({ "description": when, "content": content }));
        }
    }
    for (status, name, description) in [
        ("401", "WWW-Authenticate", "Ways to bring the token"),
        ("429", "Retry-After", "After how many seconds to try again"),
        ("503", "Retry-After", "After how many seconds to try again"),
    ] {
        if let Some(answer) = responses.get_mut(status) {
            let schema = if name == "Retry-After" {
                json!({ "type": "integer", "minimum": 1 })
            } else {
                json!({ "type": "string" })
            };
            answer["headers"] =
                json!({ name: { "description": description, "required": true, "schema": schema } });
        }
    }
}

/// Leads from an answer with an id to the calls that take it.
fn link(paths: &mut Map<String, Value>) {
    let targets = |paths: &Map<String, Value>, prefix: &str| -> Vec<String> {
        let under = paths.iter().filter(|(path, _)| path.starts_with(prefix));
        let operations = under.flat_map(|(_, operations)| operations.as_object()).flat_map(Map::values);
        operations.filter_map(|operation| operation["operationId"].as_str().map(str::to_owned)).collect()
    };
    for (prefix, answers) in [
        ("/v1/jobs/{id}", &[("/v1/jobs", "202"), ("/v1/accuracy", "202")][..]),
        ("/v1/characters/{id}", &[("/v1/characters", "201")]),
    ] {
        let links: Map<String, Value> = targets(paths, prefix)
            .into_iter()
            .map(|name| {
                let link = json!({ "operationId": name, "parameters": { "id": "$response.body#/id" } });
                (name, link)
            })
            .collect();
        for (path, status) in answers {
            if let Some(answer) =
                paths.get_mut(*path).and_then(|path| path.pointer_mut(&format!("/post/responses/{status}")))
            {
                answer["links"] = Value::Object(links.clone());
            }
        }
    }
    let use_character = json!({ "submit_job": { "operationId": "submit_job",
        "requestBody": { "character": { "id": "$response.body#/id" }, "learning": { "generations": 1 } } } });
    if let Some(kept) =
        paths.get_mut("/v1/characters").and_then(|path| path.pointer_mut("/post/responses/201/links"))
        && let (Value::Object(links), Value::Object(more)) = (kept, use_character)
    {
        links.extend(more);
    }
}
