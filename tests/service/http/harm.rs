//! Jobs that would take the service with them.

use std::process::Command;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::client::{PADDLER, Service};

fn endless() -> Value {
    json!({ "generations": 100_000 })
}

#[test]
fn a_job_that_takes_the_process_down_fails_while_the_others_go_on() {
    let data = TempDir::new().unwrap();
    let mut service = Service::on(data.path(), &[]);
    let harmful = service.post_job(&endless());
    let other = service.post_job(&json!({ "generations": 1 }));
    let mut deaths = 0;
    loop {
        let job = service.wait(&harmful, "taken up", |job| job["state"] != "queued");
        if job["state"] == "failed" {
            assert_eq!(job["attempts"], 4);
            let error = job["error"].as_str().unwrap();
            assert!(error.contains("the service ended") && error.contains("4 times"), "{error}");
            break;
        }
        service.signal("KILL");
        assert!(!service.wait_for_exit());
        deaths += 1;
        assert!(deaths < 20, "it is taken up again and again");
        service = Service::on(data.path(), &[]);
    }
    assert!(deaths >= 4);
    let job = service.wait_for_end(&other);
    assert!(job["attempts"].as_u64().unwrap() <= 1, "{job}");
    assert_eq!(service.retry(&harmful).json()["attempts"], 0);
}

/// A worker that waits for ever, here for the other end of a pipe, is replaced.
#[test]
fn a_job_that_outlives_its_lease_fails_while_the_others_go_on() {
    let service = Service::with(&["--lease", "0.5"]);
    let first = service.post_job(&endless());
    service.wait(&first, "running", |job| job["state"] == "running");
    let stuck = service.post_job(&json!({ "generations": 1 }));
    let other = service.post_job(&json!({ "generations": 1 }));
    let folder = service.folder(&stuck);
    std::fs::create_dir_all(&folder).unwrap();
    let made = Command::new("mkfifo").arg(folder.join("checkpoint.json")).status();
    assert!(made.expect("this test needs the program mkfifo, which was not found").success());
    service.cancel(&first);

    let job = service.wait_for_end(&stuck);
    assert_eq!((&job["state"], &job["attempts"]), (&json!("failed"), &json!(4)), "{job}");
    let error = job["error"].as_str().unwrap();
    assert!(error.contains("no sign of life for 0.5 s") && error.contains("4 times"), "{error}");
    assert_ne!(service.wait_for_end(&other)["state"], "cancelled");
    assert_eq!(service.curl("/readyz", &[]).status, 200, "all workers are there");
}

#[test]
fn what_needs_too_much_memory_is_refused_with_the_figures() {
    let service = Service::start();
    let character = json!({ "urdf": PADDLER });
    for (learning, pointer) in [
        (json!({ "states": 200, "trunk_cells": 15 }), "/learning/states"),
        (json!({ "population": 10_000, "islands": 1000 }), "/learning/population"),
        (
            json!({ "population": 1000, "islands": 100, "states": 100, "episodes": 1000, "episode_length": 1000 }),
            "/learning/population",
        ),
        (
            json!({ "population": 200, "islands": 10, "states": 50, "episodes": 100_000,
                "cache_transitions": 100_000_000, "cache_generations": 1000 }),
            "/learning/cache_transitions",
        ),
        (json!({ "states": 200, "transition_time": 10.0 }), "/learning/transition_time"),
        (json!({ "generations": 1_000_000, "states": 200, "transition_time": 0.1 }), "/learning/generations"),
        (json!({ "seconds": 1e7 }), "/learning/seconds"),
    ] {
        let answer = service.post_json("/v1/jobs", &json!({ "character": character, "learning": learning }));
        let problem = answer.problem(422);
        assert_eq!(problem["pointer"], pointer, "{learning}: {problem}");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("GB") && detail.contains("1.1 GB are allowed"), "{detail}");
    }
    // Many links, in whichever call they come.
    let link = |index: usize| {
        format!(
            "<link name=\"l{index}\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" \
             iyz=\"0\" izz=\"1\"/></inertial><collision><geometry><sphere radius=\"0.1\"/></geometry></collision>\
             </link>"
        )
    };
    let joint = |index: usize| {
        let parent = index - 1;
        format!(
            "<joint name=\"j{index}\" type=\"continuous\"><parent link=\"l{parent}\"/><child link=\"l{index}\"/>\
             <axis xyz=\"0 0 1\"/></joint>"
        )
    };
    let count = 900;
    let text: String = (0..count).map(link).chain((1..count).map(joint)).collect();
    let chain = format!("<robot name=\"chain\">{text}</robot>");
    let tight = Service::with(&["--job-memory", "50"]);
    for answer in [
        tight.post("/v1/jobs", "application/xml", chain.as_bytes()),
        tight.post("/v1/characters", "application/xml", chain.as_bytes()),
        tight.post_json("/v1/simulations", &json!({ "character": { "urdf": chain }, "duration": 0.01 })),
        tight.post_json(
            "/v1/accuracy",
            &json!({ "scenario": { "character": { "urdf": chain }, "duration": 0.01 } }),
        ),
    ] {
        let problem = answer.problem(422);
        // What is learned with them may come to more than they do themselves.
        let pointer = problem["pointer"].as_str().unwrap();
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("52.4 MB are allowed"), "{problem}");
        assert!(
            pointer.starts_with("/learning")
                || (pointer.ends_with("/character") && detail.contains("900 links")),
            "{problem}"
        );
    }
    assert!(tight.json("/v1/jobs")["jobs"].as_array().unwrap().is_empty());
    assert!(service.json("/v1/jobs")["jobs"].as_array().unwrap().is_empty());

    // The budget is a setting; one that has become smaller in the meantime is asked again.
    let data = TempDir::new().unwrap();
    let mut roomy = Service::on(data.path(), &["--job-memory", "100000"]);
    let first = roomy.post_job(&endless());
    roomy.wait(&first, "running", |job| job["state"] == "running");
    let large = roomy.post_job(&json!({ "states": 200, "trunk_cells": 3, "generations": 1 }));
    roomy.signal("KILL");
    roomy.wait_for_exit();
    let tight = Service::on(data.path(), &["--job-memory", "100"]);
    tight.cancel(&first);
    let job = tight.wait_for_end(&large);
    assert_eq!(job["state"], "failed", "{job}");
    assert!(job["error"].as_str().unwrap().contains("104.9 MB are allowed"), "{job}");
}
