//! How jobs end, and what may be asked of them then: cancel, try again, delete; and posting the same job twice.

#[cfg(target_os = "linux")]
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::client::{PADDLER, PADDLER_PART, Service};

fn endless() -> Value {
    json!({ "generations": 100_000 })
}

#[test]
fn a_cancellation_holds_and_is_repeated_without_harm() {
    let service = Service::start();
    let path = service.post_job(&endless());
    service.wait(&path, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 2);
    let answer = service.cancel(&path);
    assert_eq!(answer.status, 202, "{}", answer.text());
    assert_eq!(answer.headers["location"], path);
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "cancelled");
    let again = service.cancel(&path);
    assert_eq!(again.status, 202);
    assert_eq!(again.json(), job, "nothing has changed");
    assert_eq!(service.json(&path), job);

    let done = service.post_job(&json!({ "generations": 1 }));
    let job = service.wait_for_end(&done);
    service.cancel(&done).problem(409);
    assert_eq!(service.json(&done), job);
    let nobody = "/v1/jobs/01890000-0000-7000-8000-000000000000";
    service.cancel(nobody).problem(404);
    service.retry(nobody).problem(404);
}

#[test]
fn only_a_job_that_has_ended_is_deleted() {
    let service = Service::start();
    let running = service.post_job(&endless());
    service.wait(&running, "running", |job| job["state"] == "running");
    let waiting = service.post_job(&endless());
    for path in [&running, &waiting] {
        service.curl(path, &["-X", "DELETE"]).problem(409);
        assert!(["queued", "running"].contains(&service.json(path)["state"].as_str().unwrap()));
        service.cancel(path);
        service.wait_for_end(path);
        assert_eq!(service.curl(path, &["-X", "DELETE"]).status, 204);
        service.curl(path, &["-X", "DELETE"]).problem(404);
    }
}

/// What a job needs while it runs is given back, or a service that is left running has ever less.
#[cfg(target_os = "linux")]
#[test]
fn a_job_that_has_ended_leaves_no_thread_behind() {
    let service = Service::start();
    let running = service.post_job(&endless());
    service.wait(&running, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 1);
    assert!(service.working_threads().len() > 1, "a running job has threads beside its worker");
    service.cancel(&running);
    service.wait_for_end(&running);
    service.wait_for_end(&service.post_gaits(&json!({ "gait": "trot" }), &json!({ "generations": 2 })));
    let since = Instant::now();
    while service.working_threads().len() > 1 {
        assert!(since.elapsed() < Duration::from_secs(30), "{:?}", service.working_threads());
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A job that is cancelled and tried again comes to what it would have come to undisturbed.
#[test]
fn a_cancelled_job_goes_on_from_its_checkpoint() {
    let service = Service::start();
    let path = service.post_two_gaits();
    service.retry(&path).problem(409);
    service.wait(&path, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 13);
    service.retry(&path).problem(409);
    service.cancel(&path);
    let cancelled = service.wait_for_end(&path);
    assert_eq!(cancelled["state"], "cancelled");
    let reached = cancelled["progress"]["generations"].as_u64().unwrap();
    assert!(reached < 24);

    let answer = service.retry(&path);
    assert_eq!(answer.status, 202, "{}", answer.text());
    let queued = answer.json();
    assert_eq!((&queued["state"], &queued["id"]), (&json!("queued"), &cancelled["id"]));
    assert_eq!((&queued["metrics"], &queued["timings"]["ended"]), (&Value::Null, &Value::Null));
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");
    assert_eq!(job["progress"]["generations"], 24);
    service.retry(&path).problem(409);

    let undisturbed = service.post_two_gaits();
    service.wait_for_end(&undisturbed);
    let motion = |path: &str| service.json(&format!("{path}/motion"));
    assert_eq!(motion(&path), motion(&undisturbed));
}

/// What a job has learned stays with it when it is tried again and called off at once: while it waits, before it has begun to learn, and
/// shortly after.
#[test]
fn a_job_called_off_soon_after_it_is_tried_again_keeps_what_it_had() {
    let service = Service::with(&["--workers", "1"]);
    let path = service.post_two_gaits();
    service.wait(&path, "one gait further", |job| !job["motions"].as_array().unwrap().is_empty());
    service.cancel(&path);
    let before = service.wait_for_end(&path);
    let results = ["metrics", "motions", "ended_by", "outcome", "accuracy_check"];
    assert!(before["metrics"]["speed"].is_number(), "{before}");
    let motion = service.json(&format!("{path}/motion"));

    let busy = service.post_job(&endless());
    service.wait(&busy, "running", |job| job["state"] == "running");
    let queued = service.retry(&path).json();
    assert_eq!((&queued["metrics"], &queued["motions"]), (&Value::Null, &json!([])));
    results.iter().for_each(|result| assert_eq!(queued["earlier"][result], before[result], "{result}"));
    let called_off = service.cancel(&path).json();
    assert_eq!(called_off["state"], "cancelled");
    results.iter().for_each(|result| assert_eq!(called_off[result], before[result], "{result}"));
    assert!(called_off.get("earlier").is_none());
    service.cancel(&busy);
    service.wait_for_end(&busy);

    // Too soon for the other gait to be finished; the last time as soon as it learns.
    for milliseconds in [Some(0), Some(30), Some(100), Some(300), None] {
        service.retry(&path);
        match milliseconds {
            Some(milliseconds) => std::thread::sleep(Duration::from_millis(milliseconds)),
            None => drop(service.wait(&path, "learning", |job| job["stage"] == "learning")),
        }
        service.cancel(&path);
        let job = service.wait_for_end(&path);
        assert_eq!(job["state"], "cancelled");
        let motions = job["motions"].as_array().unwrap();
        assert_eq!(motions[..1], before["motions"].as_array().unwrap()[..1], "after {milliseconds:?} ms");
        assert!(job["metrics"]["speed"].is_number(), "after {milliseconds:?} ms");
        if motions.len() == 1 {
            assert_eq!(service.json(&format!("{path}/motion")), motion, "after {milliseconds:?} ms");
        }
        assert!(job.get("earlier").is_none());
    }
}

/// So does a job whose process is killed, and which is called off as soon as there is another.
#[test]
fn a_job_called_off_soon_after_a_kill_keeps_what_it_had() {
    let data = TempDir::new().unwrap();
    let service = Service::on(data.path(), &[]);
    let path = service.post_two_gaits();
    // In the second gait, so that there is a checkpoint behind the first.
    let before =
        service.wait(&path, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 13);
    drop(service);
    let service = Service::on(data.path(), &[]);
    service.cancel(&path);
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "cancelled");
    assert_eq!(job["motions"].as_array().unwrap()[..1], before["motions"].as_array().unwrap()[..1]);
    assert!(job["metrics"]["speed"].is_number() && job["outcome"] != "no_motion", "{job}");
    assert_eq!(service.json(&format!("{path}/motion"))["format"], "gaitwright/motion@1");
}

#[test]
fn a_full_queue_takes_no_job_back() {
    let service = Service::with(&["--queue", "1"]);
    let first = service.post_job(&endless());
    service.wait(&first, "running", |job| job["state"] == "running");
    let second = service.post_job(&endless());
    service.cancel(&second);
    service.post_job(&endless());
    let answer = service.retry(&second);
    answer.problem(429);
    assert_eq!(service.json(&second)["state"], "cancelled");
}

#[test]
fn results_are_whole_or_marked() {
    let service = Service::start();
    let first = service.post_job(&endless());
    service.wait(&first, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 3);
    for result in ["motion", "motion.glb", "motions.glb", "gait", "gait.svg", "report"] {
        service.curl(&format!("{first}/{result}"), &[]).problem(409);
    }
    service.curl(&format!("{first}/motions.glb?preliminary=true"), &[]).problem(409);
    let so_far = |result: &str| service.json(&format!("{first}/{result}?preliminary=true"));
    assert_eq!(
        so_far("motions"),
        json!({ "format": "gaitwright/motions@1", "motion": null, "motions": [], "preliminary": true })
    );
    let report = so_far("report");
    assert_eq!((&report["format"], &report["preliminary"]), (&json!("gaitwright/report@1"), &json!(true)));
    assert_eq!((&report["ended_by"], &report["unsuccessful"]), (&Value::Null, &Value::Null), "{report}");
    service.curl(&format!("{first}/motions/1?preliminary=true"), &[]).problem(409);
    service.curl(&format!("{first}/motion?preliminary=perhaps"), &[]).problem(400);

    // Before a motion is finished there is the best on the way, which leaves no file.
    service.wait(&first, "a motion on the way", |_| {
        service.curl(&format!("{first}/motion?preliminary=true"), &[]).status == 200
    });
    for result in ["motion", "gait"] {
        let shown = service.json(&format!("{first}/{result}?preliminary=true"));
        assert_eq!(shown["preliminary"], true, "{result}");
    }
    for result in ["motion.glb", "gait.svg"] {
        assert_eq!(service.curl(&format!("{first}/{result}?preliminary=true"), &[]).status, 200, "{result}");
    }
    assert!(!service.folder(&first).join("motion.json").exists());

    // A job that waits to be tried again has what its earlier run has left, and shows it to those who ask.
    let again = service.post_gaits(&json!({ "gait": "trot", "froude": 0.4 }), &json!({ "generations": 2 }));
    service.cancel(&first);
    service.wait_for_end(&again);
    let folder = service.folder(&first);
    let left = std::fs::read(service.folder(&again).join("motion.json")).unwrap();
    std::fs::write(folder.join("motion.json"), &left).unwrap();
    let busy = service.post_job(&endless());
    service.wait(&busy, "running", |job| job["state"] == "running");
    service.wait_for_end(&first);
    assert_eq!(service.retry(&first).status, 202);
    let place = format!("{first}/motion");
    service.curl(&place, &[]).problem(409);
    let answer = service.curl(&format!("{place}?preliminary=true"), &[]);
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(answer.headers["cache-control"], "no-store");
    let mut marked = answer.json();
    assert_eq!(marked["preliminary"], true);
    marked.as_object_mut().unwrap().remove("preliminary");
    assert_eq!(marked, serde_json::from_slice::<Value>(&left).unwrap());

    // So with its exports.
    let waiting = service.post_gaits(&json!({ "gait": "trot", "froude": 0.4 }), &json!({ "generations": 2 }));
    std::fs::create_dir_all(service.folder(&waiting)).unwrap();
    std::fs::write(service.folder(&waiting).join("motion.json"), &left).unwrap();
    service.curl(&format!("{waiting}/motion.csv"), &[]).problem(409);
    let export = service.curl(&format!("{waiting}/motion.csv?preliminary=true"), &[]);
    assert_eq!((export.status, &*export.headers["cache-control"]), (200, "no-store"), "{}", export.text());

    // Whole results carry no mark, whatever is asked for.
    let whole = service.json(&format!("{again}/motion?preliminary=true"));
    assert!(whole.get("preliminary").is_none());
}

#[test]
fn the_same_request_is_the_same_job() {
    let data = TempDir::new().unwrap();
    let mut service = Service::on(data.path(), &["--queue", "2"]);
    let document = |seed: u64| {
        json!({ "character": { "urdf": PADDLER }, "learning": { "generations": 100_000 }, "seed": seed })
            .to_string()
    };
    let post = |service: &Service, key: &str, body: &str| {
        let header = format!("idempotency-key: {key}");
        service.curl("/v1/jobs", &["-H", "content-type: application/json", "-H", &header, "-d", body])
    };
    let first = post(&service, "k-1", &document(1));
    assert_eq!(first.status, 202, "{}", first.text());
    let path = first.headers["location"].clone();
    let again = post(&service, "k-1", &document(1));
    assert_eq!((again.status, &again.headers["location"]), (202, &path));
    post(&service, "k-1", &document(2)).problem(422);
    let other = post(&service, "k-2", &document(1));
    assert_eq!(other.status, 202);
    assert_ne!(other.headers["location"], path);
    assert_eq!(service.json("/v1/jobs")["jobs"].as_array().unwrap().len(), 2);

    // A form is the same whatever its boundary is; another form is another.
    let form = |parts: &[&str]| {
        let parts: Vec<&str> = parts.iter().flat_map(|part| ["-F", part]).collect();
        service.curl("/v1/jobs", &[&["-H", "idempotency-key: form"][..], &parts].concat())
    };
    let sent = form(&[PADDLER_PART, r#"job={"seed":3}"#]);
    assert_eq!(sent.status, 202, "{}", sent.text());
    assert_eq!(form(&[PADDLER_PART, r#"job={"seed":3}"#]).headers["location"], sent.headers["location"]);
    form(&[PADDLER_PART, r#"job={"seed":4}"#]).problem(422);

    // A key that is none, and a faulty body, keep nothing.
    post(&service, &"k".repeat(256), &document(1)).problem(400);
    post(&service, "k 3", &document(1)).problem(400);
    post(&service, "k-3", "{}").problem(422);

    // Both outlive the process.
    service.signal("KILL");
    assert!(!service.wait_for_exit());
    let service = Service::on(data.path(), &[]);
    assert_eq!(post(&service, "k-1", &document(1)).headers["location"], path);
    post(&service, "k-1", &document(2)).problem(422);

    // With the job goes its key.
    service.cancel(&path);
    service.wait_for_end(&path);
    assert_eq!(service.curl(&path, &["-X", "DELETE"]).status, 204);
    let new = post(&service, "k-1", &document(2));
    assert_eq!(new.status, 202);
    assert_ne!(new.headers["location"], path);
}
