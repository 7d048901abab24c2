//! The interface as a whole: its description, its page, its simulations.

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

#[test]
fn a_problem_may_have_no_faults() {
    let description = Service::start().json("/openapi.json");
    let required = description.pointer("/components/schemas/Problem/required").unwrap();
    assert_eq!(*required, json!(["type", "title", "status", "detail"]));
}

#[test]
fn the_page_and_the_viewer_come_from_the_program() {
    let service = Service::start();
    for (path, media_type) in [
        ("/", "text/html"),
        ("/style.css", "text/css"),
        ("/app.js", "text/javascript"),
        ("/viewer/", "text/html"),
        ("/viewer/start.js", "text/javascript"),
    ] {
        let answer = service.curl(path, &[]);
        assert_eq!(answer.status, 200, "{path}");
        assert!(answer.headers["content-type"].starts_with(media_type), "{path}");
        assert!(answer.headers["content-security-policy"].contains("default-src 'self'"));
        assert_eq!(answer.headers["x-content-type-options"], "nosniff");
        let text = answer.text();
        // A namespace is a name and is not fetched.
        let text = text.replace("http://www.w3.org/2000/svg", "");
        assert!(!text.contains("http://") && !text.contains("https://"), "{path} asks elsewhere");
    }
    let program = service.curl("/viewer/re_viewer_bg.wasm", &[]);
    assert_eq!(program.headers["content-type"], "application/wasm");
    assert_eq!(&program.body[..4], b"\0asm");
    let tag = format!("if-none-match: {}", program.headers["etag"]);
    assert_eq!(service.curl("/viewer/re_viewer_bg.wasm", &["-H", &tag]).status, 304);
    assert_eq!(service.curl("/viewer/re_viewer.js", &[]).status, 200);
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
