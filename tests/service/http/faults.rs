//! A data folder that cannot be written for a while, and a service that goes on afterwards without a restart.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Executor};
use tempfile::TempDir;

use super::client::{Answer, PADDLER, Service};

/// How long a service may take to notice that it can write again.
const RECOVERY: Duration = Duration::from_secs(30);

/// Longest time to an answer while nothing can be written.
const AT_ONCE: Duration = Duration::from_secs(5);

fn post(service: &Service, generations: u32, key: &str) -> Answer {
    let learning = json!({ "generations": generations, "population": 4, "islands": 1, "elite": 1, "episodes": 2,
        "trial_seconds": 0.5, "check_seconds": 1.0 });
    let body = json!({ "character": { "urdf": PADDLER }, "learning": learning, "seed": 7 }).to_string();
    let key = format!("idempotency-key: {key}");
    service.curl("/v1/jobs", &["-H", "content-type: application/json", "-H", &key, "-d", &body])
}

/// Checks that an answer is the one of a service that cannot write.
fn assert_unavailable(answer: &Answer) {
    answer.problem(503);
    assert!(answer.headers["retry-after"].parse::<u32>().unwrap() > 0);
}

fn wait_until_ready(service: &Service) {
    let since = Instant::now();
    while service.curl("/readyz", &[]).status != 200 {
        assert!(since.elapsed() < RECOVERY, "the service has not recovered by itself");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn nothing_accepted_is_lost_when_the_disk_is_full_for_a_while() {
    let data = TempDir::new().unwrap();
    let mut service = Service::with_limits(data.path(), &["--queue", "1000"]);
    // By path, with the key that it was posted under.
    let mut accepted: BTreeMap<String, String> = BTreeMap::new();
    let mut accept = |answer: &Answer, key: &str| {
        assert_eq!(answer.status, 202, "{}", answer.text());
        accepted.insert(answer.headers["location"].clone(), key.to_owned());
        answer.headers["location"].clone()
    };
    let running = accept(&post(&service, 100_000, "running"), "running");
    service.wait(&running, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 2);
    let waiting = accept(&post(&service, 1, "waiting"), "waiting");

    // Nothing at all can be written.
    service.limit_files(Some(0));
    let since = Instant::now();
    assert_unavailable(&post(&service, 1, "refused"));
    assert_unavailable(&service.cancel(&waiting));
    assert_unavailable(&service.post("/v1/characters", "application/xml", PADDLER.as_bytes()));
    assert!(since.elapsed() < 3 * AT_ONCE, "{:?}", since.elapsed());
    let unready = service.curl("/readyz", &[]);
    assert_unavailable(&unready);
    assert!(unready.json()["detail"].as_str().unwrap().contains("store failed"), "{}", unready.text());
    assert_eq!(service.json(&waiting)["state"], "queued");
    assert_eq!(service.json("/v1/jobs")["jobs"].as_array().unwrap().len(), 2);
    assert_eq!(service.curl("/healthz", &[]).status, 200);
    service.limit_files(None);
    wait_until_ready(&service);
    accept(&post(&service, 1, "refused"), "refused");

    // A cancellation that was acknowledged holds.
    let acknowledged = service.cancel(&running);
    assert_eq!(acknowledged.status, 202, "{}", acknowledged.text());
    assert_eq!(service.wait_for_end(&running)["state"], "cancelled");

    // The write that fails is another each time: the log of the database can grow by so many pages.
    let log = data.path().join("gaitwright.db-wal");
    for pages in 0..8 {
        let size = std::fs::metadata(&log).map_or(0, |log| log.len());
        service.limit_files(Some(size + pages * 2060));
        let mut refused = Vec::new();
        for number in 0..4 {
            let key = format!("{pages}-{number}");
            let answer = post(&service, 1, &key);
            if answer.status == 202 {
                accept(&answer, &key);
            } else {
                assert_unavailable(&answer);
                refused.push(key);
            }
        }
        service.limit_files(None);
        wait_until_ready(&service);
        for key in refused {
            accept(&post(&service, 1, &key), &key);
        }
    }

    let of_all = |service: &Service, what: &dyn Fn(&str, &Value)| {
        for (path, key) in &accepted {
            what(key, &service.json(path));
            let generations = if key == "running" { 100_000 } else { 1 };
            assert_eq!(&post(service, generations, key).headers["location"], path, "{key}");
        }
    };
    of_all(&service, &|_, _| {});

    // The service works on, and what it says holds after the process has been killed.
    assert!(service.wait_for_end(&waiting)["timings"]["ended"].is_string());
    service.signal("KILL");
    assert!(!service.wait_for_exit());
    let service = Service::on(data.path(), &["--queue", "1000"]);
    of_all(&service, &|key, job| {
        let state = job["state"].as_str().unwrap();
        assert_eq!(state == "cancelled", key == "running", "{key}: {job}");
    });
    for path in accepted.keys() {
        let job = service.wait_for_end(path);
        let error = job["error"].as_str().unwrap_or_default();
        assert!(!error.contains("store") && !error.contains("written"), "{job}");
    }
}

/// Another program that holds on to the database, such as one that copies it, is a reason to come again later, and no more.
#[tokio::test]
async fn nothing_accepted_is_lost_when_the_database_is_busy_for_a_while() {
    let data = TempDir::new().unwrap();
    let service = Service::on(data.path(), &["--queue", "1000"]);
    let running = post(&service, 100_000, "running").headers["location"].clone();
    service.wait(&running, "learning", |job| job["progress"]["generations"].as_u64().unwrap() >= 2);
    let waiting = post(&service, 1, "waiting").headers["location"].clone();

    let options = SqliteConnectOptions::new().filename(data.path().join("gaitwright.db"));
    let mut other = options.busy_timeout(RECOVERY).connect().await.unwrap();
    other.execute("BEGIN IMMEDIATE").await.unwrap();
    let since = Instant::now();
    assert_unavailable(&post(&service, 1, "refused"));
    assert_unavailable(&service.cancel(&waiting));
    assert!(since.elapsed() < 2 * AT_ONCE, "{:?}", since.elapsed());
    let unready = service.curl("/readyz", &[]);
    assert_unavailable(&unready);
    let reason = unready.json()["detail"].as_str().unwrap().to_owned();
    assert!(reason.contains("locked") || reason.contains("busy"), "{reason}");
    for path in ["/v1/jobs", &running, &waiting, &format!("{running}/curve"), "/healthz", "/metrics"] {
        assert_eq!(service.curl(path, &[]).status, 200, "reading goes on: {path}");
    }
    assert_eq!(service.json(&waiting)["state"], "queued");
    other.execute("ROLLBACK").await.unwrap();

    wait_until_ready(&service);
    assert_eq!(post(&service, 1, "refused").status, 202);
    assert_eq!(post(&service, 1, "waiting").headers["location"], waiting);
    let before = service.json(&running)["progress"]["generations"].as_u64();
    service.wait(&running, "learning on", |job| job["progress"]["generations"].as_u64() > before);
    assert_eq!(service.cancel(&running).status, 202);
    assert_eq!(service.wait_for_end(&running)["state"], "cancelled");
    assert!(service.wait_for_end(&waiting)["timings"]["ended"].is_string());
}
