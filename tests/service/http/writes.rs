//! Every write that a service makes fails once, as on a full disk, and so do all after it until there is room again; the
//! service goes on without a restart.
//!
//! `WRITE_FAULTS` is at how many of the writes of a running job this is tried (10).

use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::json;
use tempfile::TempDir;

use super::client::{Answer, FailingWrites, PADDLER, Service};
use super::whole::{Left, tiny_job};

/// Longest time to an answer while nothing can be written.
const AT_ONCE: Duration = Duration::from_secs(5);

/// How long a service may take to notice that it can write again.
const RECOVERY: Duration = Duration::from_secs(60);

/// More writes than a call can need.
const MANY: i64 = 200;

fn wait_until_ready(service: &Service) {
    let since = Instant::now();
    while service.curl("/readyz", &[]).status != 200 {
        assert!(since.elapsed() < RECOVERY, "the service has not recovered by itself");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Makes a call again and again, with one more write that succeeds each time, until it needs no more; `check` looks at
/// each answer once there is room again. Gives the number of writes that have failed.
fn at_every_write(
    service: &Service,
    writes: &FailingWrites,
    call: &mut dyn FnMut() -> Answer,
    check: &mut dyn FnMut(&Answer),
) -> i64 {
    for allowed in 0..MANY {
        writes.allow(Some(allowed));
        let since = Instant::now();
        let answer = call();
        let took = since.elapsed();
        let failed = writes.failing();
        if failed && allowed == 0 {
            // That it could be written a moment ago holds for a moment.
            let mut unready = service.curl("/readyz", &[]);
            while unready.status == 200 && since.elapsed() < RECOVERY {
                unready = service.curl("/readyz", &[]);
            }
            let reason = unready.problem(503)["detail"].as_str().unwrap().to_owned();
            assert!(
                reason.contains("full") || reason.contains("disk") || reason.contains("error"),
                "{reason}"
            );
            assert_eq!(service.curl("/v1/jobs", &[]).status, 200, "reading goes on");
        }
        writes.allow(None);
        assert!(took < AT_ONCE, "{took:?}");
        if answer.status >= 300 {
            answer.problem(503);
            assert!(answer.headers["retry-after"].parse::<u32>().unwrap() > 0);
        }
        wait_until_ready(service);
        check(&answer);
        if !failed {
            assert!(answer.status < 300, "{}", answer.text());
            return allowed;
        }
    }
    panic!("a call needs more than {MANY} writes");
}

/// Nothing that was acknowledged is lost, at whichever write of a call the disk was full.
#[test]
fn calls_hold_what_they_say_at_every_write() {
    let writes = FailingWrites::new();
    let data = TempDir::new().unwrap();
    let arguments = ["--queue", "1000", "--lease", "3600"];
    let service = Service::with_failing_writes(data.path(), &arguments, &writes);
    // The worker waits for ever at the other end of a pipe, so that nobody else writes.
    let first = service.post_job(&json!({ "generations": 100_000 }));
    service.wait(&first, "running", |job| job["state"] == "running");
    let busy = service.post_job(&json!({ "generations": 1 }));
    std::fs::create_dir_all(service.folder(&busy)).unwrap();
    let pipe = service.folder(&busy).join("checkpoint.json");
    assert!(Command::new("mkfifo").arg(pipe).status().unwrap().success());
    service.cancel(&first);
    service.wait(&busy, "running", |job| job["state"] == "running");

    let body = tiny_job(1).to_string();
    let mut number = 0;
    let mut keys = Vec::new();
    let post = |key: &str| {
        let key = format!("idempotency-key: {key}");
        service.curl("/v1/jobs", &["-H", "content-type: application/json", "-H", &key, "-d", &body])
    };
    let mut accepted = Vec::new();
    let posted = at_every_write(
        &service,
        &writes,
        &mut || {
            number += 1;
            keys.push(format!("key-{number}"));
            post(&keys[number - 1])
        },
        &mut |answer| {
            if answer.status == 202 {
                accepted.push(answer.headers["location"].clone());
            }
        },
    );
    for path in &accepted {
        assert_eq!(service.json(path)["state"], "queued");
    }
    // The same requests again are the same jobs, or come about now.
    for key in &keys {
        assert_eq!(post(key).headers["location"], post(key).headers["location"]);
    }
    assert_eq!(service.json("/v1/jobs?state=queued&limit=200")["jobs"].as_array().unwrap().len(), keys.len());

    let path = accepted[0].clone();
    let state = |expected: &'static str| {
        let (service, path) = (&service, &path);
        move |answer: &Answer| {
            if answer.status == 202 {
                assert_eq!(service.json(path)["state"], expected);
            }
        }
    };
    let mut calls = vec![("POST /v1/jobs", posted)];
    let cancelled = at_every_write(&service, &writes, &mut || service.cancel(&path), &mut state("cancelled"));
    calls.push(("cancel", cancelled));
    let retried = at_every_write(
        &service,
        &writes,
        &mut || match service.retry(&path) {
            // An earlier call has queued it although it could not say so.
            answer if answer.status == 409 => Answer { status: 202, ..answer },
            answer => answer,
        },
        &mut state("queued"),
    );
    calls.push(("retry", retried));
    assert_eq!(service.cancel(&path).status, 202);
    let mut gone = false;
    let deleted = at_every_write(
        &service,
        &writes,
        &mut || match service.curl(&path, &["-X", "DELETE"]) {
            // An earlier call has deleted it although it could not say so.
            answer if answer.status == 404 => Answer { status: 204, ..answer },
            answer => answer,
        },
        &mut |answer| {
            let there = service.curl(&path, &[]).status == 200;
            assert!(!(gone && there), "what was deleted is back");
            assert!(!(answer.status == 204 && there), "an acknowledged deletion holds");
            gone |= !there;
        },
    );
    calls.push(("DELETE", deleted));
    let mut characters = 0;
    let kept = at_every_write(
        &service,
        &writes,
        &mut || {
            characters += 1;
            let text = PADDLER.replace("paddler", &format!("paddler-{characters}"));
            service.post("/v1/characters", "application/xml", text.as_bytes())
        },
        &mut |answer| {
            if answer.status == 201 {
                assert_eq!(service.curl(&answer.headers["location"], &[]).status, 200);
            }
        },
    );
    calls.push(("POST /v1/characters", kept));
    eprintln!("writes that failed, by call: {calls:?}");
    assert!(calls.iter().all(|(_, failed)| *failed >= 3), "{calls:?}");

    // What was acknowledged is on the disk.
    service.signal("KILL");
    drop(service);
    let service = Service::on(data.path(), &["--queue", "1000"]);
    for other in &accepted[1..] {
        assert_eq!(service.curl(other, &[]).status, 200);
    }
    service.curl(&path, &[]).problem(404);
}

/// A job comes to the same result, at whichever of its writes the disk was full.
#[test]
fn a_job_outlives_a_full_disk_at_any_write() {
    let tries = std::env::var("WRITE_FAULTS").map_or(10, |text| text.parse::<i64>().unwrap());
    let writes = FailingWrites::new();
    let data = TempDir::new().unwrap();
    let service = Service::with_failing_writes(data.path(), &[], &writes);
    let run = |service: &Service| {
        let answer = service.post_json("/v1/jobs", &tiny_job(2));
        assert_eq!(answer.status, 202, "{}", answer.text());
        answer.headers["location"].clone()
    };
    let before = writes.count();
    let path = run(&service);
    service.wait_for_end(&path);
    let needed = writes.count() - before;
    let expected = Left::by(&service, &path);
    assert!(expected.has_motion());

    for index in 0..tries {
        // Evenly spread, and not always the same ones of each period.
        let allowed = 30 + (needed - 40).max(1) * index / tries + index % 7;
        let path = run(&service);
        writes.allow(Some(allowed));
        let job = service.wait(&path, "out of room, or over", |job| {
            writes.failing() || !["queued", "running"].contains(&job["state"].as_str().unwrap())
        });
        std::thread::sleep(Duration::from_millis(300));
        writes.allow(None);
        let job = if job["timings"]["ended"].is_null() { service.wait_for_end(&path) } else { job };
        assert!(job["error"].is_null(), "after {allowed} of {needed} writes: {job}");
        assert_eq!(Left::by(&service, &path), expected, "after {allowed} of {needed} writes");
        wait_until_ready(&service);
    }
}
