//! Jobs outlive the process that works at them.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use tempfile::TempDir;

use super::client::Service;
use super::whole;

/// The curve without the time that it took.
fn figures(service: &Service, path: &str) -> Vec<Value> {
    let mut curve = service.json(&format!("{path}/curve"));
    for point in curve["points"].as_array_mut().unwrap() {
        point.as_object_mut().unwrap().remove("elapsed");
    }
    curve["points"].as_array().unwrap().clone()
}

/// How many rows the recording of a job holds of every entity.
fn rows(service: &Service, path: &str) -> BTreeMap<String, usize> {
    whole::rows(&service.curl(&format!("{path}/recording.rrd"), &[]).body)
}

/// Curve, motion and rows of the recording of the job as it comes out undisturbed.
fn undisturbed() -> (Vec<Value>, Value, BTreeMap<String, usize>) {
    let service = Service::start();
    let path = service.post_two_gaits();
    assert_eq!(service.wait_for_end(&path)["state"], "succeeded");
    (figures(&service, &path), service.json(&format!("{path}/motion")), rows(&service, &path))
}

#[test]
fn a_killed_service_goes_on_to_the_same_result() {
    let data = TempDir::new().unwrap();
    let mut service = Service::on(data.path(), &[]);
    let path = service.post_two_gaits();
    let waiting = service.post_job(&json!({ "generations": 1 }));
    let after = |generations: u64| {
        service.wait(&path, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= generations)
    };
    let tried = |job: &Value| job["progress"]["evaluations"].as_u64().unwrap();
    // How many candidates have been tried is written now and then: by the second look, what the first has seen.
    let earlier = tried(&after(6));
    after(13);
    service.signal("KILL");
    assert!(!service.wait_for_exit());

    let service = Service::on(data.path(), &[]);
    let resumed = service.wait(&path, "resumed", |job| job["state"] == "running");
    assert!(tried(&resumed) >= earlier, "{earlier} before, then {resumed}");
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");
    assert!(tried(&job) > tried(&resumed), "{job}");
    assert_eq!(job["progress"]["generations"], 24);
    let (curve, motion, _) = undisturbed();
    assert_eq!(figures(&service, &path), curve);
    assert_eq!(service.json(&format!("{path}/motion")), motion);
    assert_ne!(service.wait_for_end(&waiting)["state"], "cancelled");
}

#[test]
fn a_service_shut_down_puts_its_job_back() {
    let data = TempDir::new().unwrap();
    let mut service = Service::on(data.path(), &[]);
    let path = service.post_two_gaits();
    service.wait(&path, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 13);
    let stream = super::client::Receiver::start(&service.url(&format!("{path}/events")));
    let recording = super::client::Receiver::start(&service.url(&format!("{path}/recording.rrd")));
    service.signal("TERM");
    assert!(service.wait_for_exit(), "it ends by itself, in order");
    stream.finish();
    recording.breaks_off();
    assert!(service.folder(&path).join("checkpoint.json").is_file());

    let service = Service::on(data.path(), &[]);
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");
    let (curve, motion, recorded) = undisturbed();
    assert_eq!(figures(&service, &path), curve);
    assert_eq!(service.json(&format!("{path}/motion")), motion);
    assert!(recorded["/world/path"] > 1, "there is more than one motion to be missed: {recorded:?}");
    assert_eq!(rows(&service, &path), recorded, "nothing is missing from the recording");
}

#[test]
fn an_acknowledged_cancellation_outlives_the_process() {
    let data = TempDir::new().unwrap();
    let mut service = Service::on(data.path(), &[]);
    let path = service.post_two_gaits();
    service.wait(&path, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 1);
    assert_eq!(service.cancel(&path).status, 202);
    service.signal("KILL");
    assert!(!service.wait_for_exit());
    let service = Service::on(data.path(), &[]);
    assert_eq!(service.json(&path)["state"], "cancelled");
}

#[test]
fn a_data_folder_has_one_service() {
    let data = TempDir::new().unwrap();
    let _service = Service::on(data.path(), &[]);
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_gaitwright"))
        .args(["serve", "--listen", "127.0.0.1:0", "--data"])
        .arg(data.path())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains(data.path().to_str().unwrap()) && message.contains("in use"), "{message}");
}
