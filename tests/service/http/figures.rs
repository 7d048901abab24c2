//! What is seen of the service from outside: figures and log.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::client::Service;

/// The samples of the Prometheus text format: name with labels, and value.
fn samples(service: &Service) -> BTreeMap<String, f64> {
    let text = service.curl("/metrics", &[]).text();
    let lines = text.lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    lines
        .map(|line| {
            let (name, value) = line.rsplit_once(' ').unwrap();
            (name.to_owned(), value.parse().unwrap())
        })
        .collect()
}

/// The same once the only job has ended: it is counted after that is recorded, and logged then.
fn samples_in_the_end(service: &Service) -> BTreeMap<String, f64> {
    service.logged("that the job has ended", |line| line.contains(" left "));
    samples(service)
}

/// Checks that the buckets of a histogram without labels are cumulative and end with its count, and gives the count.
fn count(samples: &BTreeMap<String, f64>, name: &str) -> f64 {
    let of = |line: &str| {
        line.strip_prefix(name)?.strip_prefix("_bucket{le=\"")?.strip_suffix("\"}")?.parse().ok()
    };
    let mut buckets: Vec<(f64, f64)> =
        samples.iter().filter_map(|(line, value)| Some((of(line)?, *value))).collect();
    buckets.sort_by(|a, b| a.0.total_cmp(&b.0));
    assert!(buckets.len() > 5, "{name}: {samples:#?}");
    assert!(buckets.is_sorted_by(|a, b| a.1 <= b.1), "{name}: {buckets:?}");
    let count = samples[&format!("{name}_count")];
    assert_eq!(buckets.last().unwrap(), &(f64::INFINITY, count));
    count
}

#[test]
fn a_job_shows_in_the_figures() {
    let service = Service::start();
    let path =
        service.post_gaits(&json!({ "speed": 0.9 }), &json!({ "generations": 12, "gait_generations": 12 }));
    let job = service.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");
    let samples = samples_in_the_end(&service);
    let get = |name: &str| samples.get(name).copied().unwrap_or_default();
    assert_eq!(get("gaitwright_jobs_posted_total"), 1.0);
    assert_eq!(get("gaitwright_jobs_ended_total{state=\"succeeded\"}"), 1.0);
    assert_eq!(get("gaitwright_jobs{state=\"succeeded\"}"), 1.0);
    assert_eq!(get("gaitwright_generations_total"), 12.0);
    assert_eq!(count(&samples, "gaitwright_generation_seconds"), 12.0);
    assert_eq!(count(&samples, "gaitwright_queue_wait_seconds"), 1.0);
    let curve = service.json(job["links"]["curve"].as_str().unwrap());
    let taken = curve["points"].as_array().unwrap().last().unwrap()["elapsed"].as_f64().unwrap();
    let timed = get("gaitwright_generation_seconds_sum");
    assert!((timed - taken).abs() < 1e-3 * taken, "{timed} s of {taken} s");
    let steps =
        job["progress"]["simulated_seconds"].as_f64().unwrap() / job["accuracy"]["step"].as_f64().unwrap();
    let counted = get("gaitwright_steps_total");
    assert!((counted - steps).abs() <= 12.0, "{counted} of {steps} steps");
    let build = samples.keys().find(|name| name.starts_with("gaitwright_build_info")).unwrap();
    assert!(build.contains(&format!("version=\"{}\"", env!("CARGO_PKG_VERSION"))), "{build}");
    let requests = "http_request_duration_seconds_bucket{method=\"GET\",route=\"/v1/jobs/{id}\",le=\"+Inf\"}";
    assert!(get(requests) >= 1.0, "{samples:#?}");
}

#[test]
fn hits_of_the_cache_and_failures_are_counted() {
    let service = Service::start();
    let learning = json!({ "generations": 8, "search": "paper", "population": 4, "elite": 1 });
    let job = service.wait_for_end(&service.post_job(&learning));
    let samples = samples_in_the_end(&service);
    let learned = |name: &str| job["progress"][name].as_f64().unwrap();
    let hits = learned("saved_seconds") / job["learning"]["transition_time"].as_f64().unwrap();
    assert!(hits > 0.0, "{job}");
    let counted = samples["gaitwright_cache_hits_total"];
    assert!((counted - hits).abs() <= 8.0, "{counted} of {hits}");
    let failed: f64 = samples
        .iter()
        .filter(|(name, _)| name.starts_with("gaitwright_jobs_failed_total"))
        .map(|(_, value)| value)
        .sum();
    assert_eq!(failed, if job["state"] == "failed" { 1.0 } else { 0.0 }, "{samples:#?}");
}

#[test]
fn the_log_names_request_and_job() {
    let service = Service::with(&["--log-format", "json"]);
    let body = json!({ "character": { "urdf": super::client::PADDLER }, "learning": { "generations": 1 } });
    let posted = service.curl(
        "/v1/jobs",
        &["-H", "x-request-id: the-request", "-H", "content-type: application/json", "-d", &body.to_string()],
    );
    assert_eq!(posted.status, 202, "{}", posted.text());
    let id = posted.json()["id"].as_str().unwrap().to_owned();
    let event = |what: &str, condition: &dyn Fn(&Value) -> bool| -> Value {
        let line =
            service.logged(what, |line| serde_json::from_str(line).is_ok_and(|event| condition(&event)));
        serde_json::from_str(&line).unwrap()
    };
    let queued = event("the queued job", &|event| event["message"] == "queued");
    assert_eq!(queued["request_id"], "the-request", "{queued}");
    assert_eq!(queued["job_id"], id, "{queued}");
    assert_eq!(queued["level"], "INFO");
    let answered = event("the answer", &|event| event["message"] == "answered");
    assert_eq!((&answered["status"], &answered["request_id"]), (&json!(202), &json!("the-request")));
    assert_eq!(answered["path"], "/v1/jobs");
    assert_eq!(answered["caller"], "address 127.0.0.1");
    let started = event("the start of the job", &|event| event["message"] == "started");
    assert_eq!(started["job_id"], id, "{started}");
}

#[test]
fn a_line_of_text_names_the_request() {
    let service = Service::start();
    service.curl("/v1/jobs", &["-H", "x-request-id: mine", "-X", "POST"]);
    let line = service.logged("the answer", |line| line.contains("answered"));
    assert!(line.contains("request_id=mine") || line.contains("request_id=\"mine\""), "{line}");
}
