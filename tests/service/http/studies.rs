//! The price of accuracy over HTTP: a study as a job, and jobs that ask for a tolerance.

use gaitwright_learning::accuracy::{RowStatus, Table};
use serde_json::{Value, json};
use tempfile::TempDir;

use super::client::{PADDLER, Service, events};

/// A study of the paddler swinging its paddles for `seconds`.
fn request(seconds: f64) -> Value {
    json!({
        "scenario": {
            "character": { "urdf": PADDLER },
            "drive": { "kind": "hold", "feedforward": "none", "joints": { "left_hinge": 0.5 } },
            "duration": seconds },
        "tolerances": [1e-2, 1e-12] })
}

fn post(service: &Service, request: &Value) -> String {
    let answer = service.post_json("/v1/accuracy", request);
    assert_eq!(answer.status, 202, "{}", answer.text());
    answer.headers["location"].clone()
}

#[test]
fn a_study_leaves_table_diagram_and_recommendations() {
    let service = Service::start();
    let path = post(&service, &request(0.02));
    let job = service.wait_for_end(&path);
    assert_eq!((&job["state"], &job["kind"]), (&json!("succeeded"), &json!("accuracy")), "{job}");
    assert_eq!(job["progress"]["fraction"], 1.0);
    assert_eq!(job["character"]["name"], "paddler");
    assert_eq!(job["subject"]["unit"], "m");
    let recommended = job["recommendations"].as_array().unwrap();
    assert_eq!(recommended.len(), 2);
    assert!(recommended[0]["error"].as_f64().unwrap() <= 1e-2, "{job}");
    assert_eq!(recommended[1]["accuracy"], Value::Null);

    let links = job["links"].as_object().unwrap();
    assert!(!links.contains_key("motion"), "a study leaves no motion");
    let link = |name: &str| links[name].as_str().unwrap();
    let table: Table = serde_json::from_value(service.json(link("table"))).unwrap();
    assert_eq!(serde_json::to_value(table.recommend(1e-2)).unwrap(), recommended[0]);
    assert!(table.rows.iter().any(|row| row.status == RowStatus::Measured));
    let csv = service.curl(link("table"), &["-H", "accept: text/csv"]);
    assert!(csv.headers["content-type"].starts_with("text/csv"));
    assert_eq!(csv.text(), table.to_csv());
    assert_eq!(csv.headers["vary"], "accept, accept-encoding");
    let diagram = service.curl(link("front"), &[]);
    assert_eq!(diagram.headers["content-type"], "image/svg+xml");
    assert!(diagram.text().contains("<svg"));

    let told = events(&service.curl(link("events"), &[]).body);
    assert_eq!(told.len(), 1);
    assert_eq!(told[0], ("end".to_owned(), job));
    // What only a job that learns leaves will never be there.
    for result in [
        "motion",
        "motions",
        "motions/1",
        "motions/1/gait",
        "motion.csv",
        "motions.glb",
        "gait",
        "gait.svg",
        "report",
        "curve",
        "recording.rrd",
    ] {
        let detail = service.curl(&format!("{path}/{result}"), &[]).problem(404)["detail"].clone();
        assert!(detail.as_str().unwrap().starts_with("a study leaves no "), "{result}: {detail}");
    }
    let learned = service.post_job(&json!({ "generations": 1 }));
    for result in ["table", "front.svg"] {
        let detail = service.curl(&format!("{learned}/{result}"), &[]).problem(404)["detail"].clone();
        assert!(detail.as_str().unwrap().starts_with("a job that learns leaves no "), "{result}: {detail}");
    }
    let listed = service.json("/v1/jobs");
    assert_eq!(listed["jobs"][1]["kind"], "accuracy");
}

#[test]
fn a_study_can_be_called_off() {
    let service = Service::start();
    let path = post(&service, &request(60.0));
    service.wait(&path, "studying", |job| job["stage"] == "studying");
    assert_eq!(service.cancel(&path).status, 202);
    assert_eq!(service.wait_for_end(&path)["state"], "cancelled");
    service.curl(&format!("{path}/table"), &[]).problem(409);
}

#[test]
fn a_killed_service_studies_again() {
    let data = TempDir::new().unwrap();
    let mut service = Service::on(data.path(), &[]);
    let path = post(&service, &request(0.2));
    service.wait(&path, "studying", |job| job["stage"] == "studying");
    service.signal("KILL");
    assert!(!service.wait_for_exit());
    let service = Service::on(data.path(), &[]);
    assert_eq!(service.wait_for_end(&path)["state"], "succeeded");
    assert_eq!(service.json(&format!("{path}/table"))["format"], "gaitwright/accuracy@1");
}

#[test]
fn what_cannot_be_studied_is_refused_with_its_place() {
    let service = Service::start();
    let with = |name: &str, value: Value| {
        let mut scenario = request(0.1)["scenario"].clone();
        scenario[name] = value;
        json!({ "scenario": scenario })
    };
    for (document, place) in [
        (json!({}), "/scenario"),
        (json!({ "scenario": { "character": "paddler.urdf" } }), "/scenario/character"),
        (with("duration", json!(61)), "/scenario/duration"),
        (
            with("drive", json!({ "kind": "hold", "joints": { "third_hinge": 0 } })),
            "/scenario/drive/joints/third_hinge",
        ),
        (with("gravity", json!(1)), "/scenario/gravity"),
        (json!({ "scenario": request(0.1)["scenario"], "tolerances": [1e-3, -1] }), "/tolerances/1"),
        (json!({ "scenario": request(0.1)["scenario"], "speed": 1 }), "/speed"),
    ] {
        let problem = service.post_json("/v1/accuracy", &document).problem(422);
        assert_eq!(problem["pointer"], place, "{problem}");
    }
    service.post("/v1/accuracy", "application/json", b"{").problem(400);
    service.post("/v1/accuracy", "text/plain", b"{}").problem(415);
}

#[test]
fn a_job_is_learned_with_the_accuracy_that_it_asked_for() {
    let service = Service::start();
    let document = json!({ "character": { "urdf": PADDLER }, "accuracy": { "tolerance": 0.004 },
        "learning": { "generations": 1, "population": 4, "islands": 1, "elite": 1, "episodes": 2,
            "trial_seconds": 0.5, "check_seconds": 1.0 } });
    let answer = service.post_json("/v1/jobs", &document);
    assert_eq!(answer.status, 202, "{}", answer.text());
    let job = service.wait_for_end(&answer.headers["location"]);
    assert_eq!(job["kind"], "learning");
    assert_eq!(job["accuracy_choice"]["tolerance"], 0.004, "{job}");
    assert!(job["accuracy"]["step"].as_f64().unwrap() > 0.0, "{job}");

    let impossible = json!({ "character": { "urdf": PADDLER }, "accuracy": { "tolerance": -1 } });
    let problem = service.post_json("/v1/jobs", &impossible).problem(422);
    assert_eq!(problem["pointer"], "/accuracy/tolerance");
}

#[test]
fn a_simulation_chooses_for_its_tolerance() {
    let service = Service::start();
    let mut scenario = request(0.1)["scenario"].clone();
    scenario["accuracy"] = json!({ "tolerance": 0.004 });
    let answer = service.post_json("/v1/simulations", &scenario);
    assert_eq!(answer.status, 200, "{}", answer.text());
    let summary: Value = serde_json::from_str(answer.text().lines().last().unwrap()).unwrap();
    assert_eq!(summary["summary"]["accuracy_choice"]["tolerance"], 0.004, "{summary}");

    scenario["accuracy"] = json!({ "tolerance": 1e-15 });
    let problem = service.post_json("/v1/simulations", &scenario).problem(422);
    assert_eq!(problem["pointer"], "/accuracy/tolerance");
}
