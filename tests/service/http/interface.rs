//! The interface as a whole: its description, its simulations.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::client::{PADDLER, Service};

/// An id that names nothing.
const NOBODY: &str = "01890000-0000-7000-8000-000000000000";

#[test]
fn what_is_described_is_there() {
    let service = Service::start();
    let description = service.json("/openapi.json");
    assert!(description["openapi"].as_str().unwrap().starts_with("3.1"));
    let paths = description["paths"].as_object().unwrap();
    assert!(paths.len() >= 15);
    let mut names = BTreeSet::new();
    for (path, operations) in paths {
        for (method, operation) in operations.as_object().unwrap() {
            assert!(names.insert(operation["operationId"].as_str().unwrap()), "{operation}");
            let answer = service.curl(&path.replace("{id}", NOBODY), &["-X", &method.to_ascii_uppercase()]);
            assert_ne!(answer.status, 405, "{method} {path}");
            assert!(answer.status < 500, "{method} {path}: {}", answer.text());
            assert!(!answer.text().contains("there is nothing at"), "{method} {path}");
        }
    }
}

/// Every `$ref` in a document.
fn references<'a>(value: &'a Value, found: &mut Vec<&'a str>) {
    match value {
        Value::Object(fields) => {
            found.extend(fields.get("$ref").and_then(Value::as_str));
            fields.values().for_each(|value| references(value, found));
        }
        Value::Array(items) => items.iter().for_each(|value| references(value, found)),
        _ => {}
    }
}

#[test]
fn every_schema_that_is_referred_to_is_there() {
    let service = Service::start();
    let description = service.json("/openapi.json");
    let mut found = Vec::new();
    references(&description, &mut found);
    assert!(found.len() > 20);
    for reference in found {
        let pointer = reference.strip_prefix('#').expect("references stay within the document");
        assert!(description.pointer(pointer).is_some(), "{reference}");
    }
}

/// Values just beyond the bounds of a schema.
fn beyond(schema: &Value) -> Vec<Value> {
    let real = |name: &str| schema[name].as_f64();
    let integer = schema["type"].to_string().contains("integer");
    let past = |bound: f64, up: f64| {
        if integer { json!((bound + up) as i64) } else { json!(bound + up * (bound.abs() * 1e-3).max(1e-9)) }
    };
    let mut values: Vec<Value> = real("minimum").map(|bound| past(bound, -1.0)).into_iter().collect();
    values.extend(real("maximum").map(|bound| past(bound, 1.0)));
    values.extend(real("exclusiveMinimum").map(|bound| json!(bound)));
    if schema.get("not").is_some() {
        values.push(json!(schema["minimum"].as_i64().unwrap() + 1));
    }
    values
}

#[test]
fn the_service_keeps_to_the_bounds_that_it_describes() {
    let service = Service::with(&["--queue", "0"]);
    let schemas = service.json("/openapi.json")["components"]["schemas"].clone();
    let mut tried = 0;
    for (schema, place) in [
        ("Learning", "/learning"),
        ("Crossover", "/learning/crossover"),
        ("Mutation", "/learning/mutation"),
        ("Task", "/task"),
        ("Weights", "/task/weights"),
        ("Scene", "/scene"),
        ("AskedAccuracy", "/accuracy"),
        ("SolverChoice", "/accuracy/solver"),
    ] {
        for (name, property) in schemas[schema]["properties"].as_object().unwrap() {
            for value in beyond(property) {
                let pointer = format!("{place}/{name}");
                let mut document = pointer
                    .rsplit('/')
                    .filter(|part| !part.is_empty())
                    .fold(value, |inner, part| json!({ part: inner }));
                document["character"] = json!({ "urdf": PADDLER });
                let problem = service.post_json("/v1/jobs", &document).problem(422);
                let errors = problem["errors"].as_array().unwrap();
                assert!(
                    errors.iter().any(|error| error["pointer"] == pointer.as_str()),
                    "{pointer}: {problem}"
                );
                tried += 1;
            }
        }
    }
    assert!(tried > 80, "{tried}");
    // No number of the learner is without bounds.
    for (name, property) in schemas["Learning"]["properties"].as_object().unwrap() {
        let kind = property["type"].to_string();
        let number = kind.contains("integer") || kind.contains("number");
        assert!(!number || beyond(property).len() >= 2, "{name}: {property}");
    }
}

#[test]
fn every_answer_is_described() {
    let description = Service::start().json("/openapi.json");
    assert!(description.get("security").is_none(), "nobody needs a token here");
    for (path, operations) in description["paths"].as_object().unwrap() {
        for (method, operation) in operations.as_object().unwrap() {
            let answers: Vec<&String> = operation["responses"].as_object().unwrap().keys().collect();
            let has = |status: &str| answers.iter().any(|known| *known == status);
            assert!(!answers.iter().any(|status| status.contains("XX")), "{method} {path}: {answers:?}");
            assert!(has("421") && has("500"), "{method} {path}: {answers:?}");
            assert_eq!(has("404"), path.contains('{'), "{method} {path}: {answers:?}");
            if let Some(body) = operation.get("requestBody") {
                assert!(has("400") && has("413") && has("415") && has("422"), "{method} {path}: {answers:?}");
                for (kind, content) in body["content"].as_object().unwrap() {
                    let bytes = kind == "application/zip";
                    assert!(bytes || content.get("example").is_some(), "{method} {path}: {kind}");
                }
            }
        }
    }
    let guarded = Service::with_token("a-secret", &[]);
    let answer = guarded.curl("/openapi.json", &["-H", "authorization: Bearer a-secret"]).json();
    assert!(answer["security"].is_array());
    assert!(answer.pointer("/paths/~1v1~1jobs/get/responses/401").is_some());
}

#[test]
fn a_problem_may_have_no_faults() {
    let description = Service::start().json("/openapi.json");
    let required = description.pointer("/components/schemas/Problem/required").unwrap();
    assert_eq!(*required, json!(["type", "title", "status", "detail"]));
}

#[test]
fn health_readiness_and_figures() {
    let service = Service::start();
    assert_eq!(service.curl("/healthz", &[]).status, 200);
    assert_eq!(service.curl("/readyz", &[]).status, 200);
    let answer = service.curl("/metrics", &["-H", "x-request-id: mine"]);
    assert!(answer.headers["content-type"].starts_with("text/plain"));
    assert_eq!(answer.headers["x-request-id"], "mine");
    assert_eq!(answer.headers["cache-control"], "no-store");
    let text = answer.text();
    assert!(
        text.contains("http_requests_total{method=\"GET\",route=\"/healthz\",status=\"200\"} 1"),
        "{text}"
    );
}

#[test]
fn a_simulation_comes_line_by_line() {
    let service = Service::start();
    let scenario = json!({ "character": { "urdf": PADDLER }, "duration": 0.5, "sample_every": 0.1 });
    let answer = service.post_json("/v1/simulations", &scenario);
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(answer.headers["content-type"], "application/jsonl");
    let text = answer.text();
    let lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 7, "six samples and the summary");
    for (index, line) in lines[..6].iter().enumerate() {
        assert!((line["time"].as_f64().unwrap() - 0.1 * index as f64).abs() < 1e-9);
    }
    assert_eq!(lines[6]["summary"]["status"], "finished");
    assert_eq!(lines[6]["summary"]["steps"], 250);

    let refused = [
        (json!({ "character": "/etc/passwd" }), "/character"),
        (json!({ "character": { "urdf": PADDLER }, "duration": 1e5 }), "/duration"),
        (json!({ "character": { "urdf": PADDLER }, "durration": 1 }), "/durration"),
        (
            json!({ "character": { "urdf": PADDLER }, "drive": { "kind": "track", "motion": "/etc/passwd" } }),
            "/drive/motion",
        ),
    ];
    for (scenario, place) in refused {
        let problem = service.post_json("/v1/simulations", &scenario).problem(422);
        assert!(problem["pointer"].as_str().unwrap().starts_with(place), "{problem}");
    }
    service.post("/v1/simulations", "text/plain", b"{}").problem(415);
}
