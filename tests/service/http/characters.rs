//! Characters over HTTP.

use std::process::Command;

use serde_json::{Value, json};

use super::client::{PADDLER, Service};

#[test]
fn a_character_is_kept_and_serves_in_jobs() {
    let service = Service::start();
    let answer = service.post("/v1/characters", "application/xml", PADDLER.as_bytes());
    assert_eq!(answer.status, 201, "{}", answer.text());
    let character = answer.json();
    assert_eq!(character["format"], "gaitwright/check@1");
    assert_eq!(character["name"], "paddler");
    assert!((character["mass"].as_f64().unwrap() - 2.6).abs() < 1e-12);
    let joints: Vec<_> = character["joints"].as_array().unwrap().iter().map(|joint| &joint["name"]).collect();
    assert_eq!(joints, ["left_hinge", "right_hinge"]);
    assert_eq!(service.json(&answer.headers["location"]), character);

    let id = character["id"].as_str().unwrap();
    assert_eq!(answer.headers["location"], format!("/v1/characters/{id}"));
    let again = service.post("/v1/characters", "text/xml; charset=utf-8", PADDLER.as_bytes()).json();
    assert_eq!(again["id"], character["id"], "the same bytes keep their id");

    let job = json!({ "character": { "id": id }, "learning": { "generations": 1, "population": 4 } });
    let answer = service.post_json("/v1/jobs", &job);
    assert_eq!(answer.status, 202, "{}", answer.text());
    assert_eq!(answer.json()["character"]["digest"], character["digest"]);
    assert_ne!(service.wait_for_end(&answer.headers["location"])["state"], "cancelled");
}

#[test]
fn the_service_and_the_command_understand_the_same() {
    let service = Service::start();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), PADDLER).unwrap();
    let form = format!("character=@{}", file.path().display());
    let mut kept = service.curl("/v1/characters", &["-F", &form]).json();
    kept.as_object_mut().unwrap().remove("id");
    let output =
        Command::new(env!("CARGO_BIN_EXE_gaitwright")).arg("check").arg(file.path()).output().unwrap();
    let checked: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(kept, checked);
}

#[test]
fn the_schema_is_that_of_the_command() {
    let service = Service::start();
    let output = Command::new(env!("CARGO_BIN_EXE_gaitwright")).arg("schema").output().unwrap();
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(service.json("/v1/schemas/character"), printed);
    assert!(printed["$schema"].as_str().unwrap().contains("2020-12"));
}
