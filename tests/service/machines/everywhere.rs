//! Everything works from any server, whichever process works at the job.

use std::process::Command;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::cluster::Cluster;
use super::objects::ObjectStore;
use super::postgres::{Database, Server};
use super::results::Results;
use crate::http::client::{PADDLER, Receiver, Service, curl, events};
use crate::http::whole::{sound_messages, tiny_job};

/// A job that is not over before it is cancelled.
fn long_job() -> Value {
    json!({ "character": { "urdf": PADDLER }, "task": { "direction": [-1.0, 0.0, 0.0] }, "seed": 7,
        "learning": { "population": 4, "islands": 1, "elite": 1, "episodes": 2, "trial_seconds": 0.5,
            "check_seconds": 1.0, "generations": 100_000, "search": "paper" } })
}

fn post(service: &Service, job: &Value) -> String {
    let answer = service.post_json("/v1/jobs", job);
    assert_eq!(answer.status, 202, "{}", answer.text());
    answer.headers["location"].clone()
}

#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn a_job_is_seen_from_every_server() {
    let cluster = Cluster::new(Database::new().await);
    let (one, other) = (cluster.server(), cluster.server());
    let path = post(&one, &tiny_job(2));
    // Followed from the beginning on a server that has heard of it from the store alone.
    let followed = Receiver::start(&other.url(&format!("{path}/events")));
    assert_eq!(other.json(&path)["state"], "queued");
    let _worker = cluster.worker();
    let job = other.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");

    let told = events(&followed.finish());
    let kinds: Vec<&str> = told.iter().map(|(kind, _)| kind.as_str()).collect();
    assert_eq!((kinds.first(), kinds.last()), (Some(&"state"), Some(&"end")), "{kinds:?}");
    let generations: Vec<u64> = told
        .iter()
        .filter(|(kind, _)| kind == "generation")
        .map(|(_, figures)| figures["generation"].as_u64().unwrap())
        .collect();
    assert_eq!(generations, [0, 1]);

    let alone = Service::start();
    let undisturbed = post(&alone, &tiny_job(2));
    alone.wait_for_end(&undisturbed);
    let expected = Results::by(&alone, &undisturbed);
    assert!(expected.has_motion());
    for server in [&one, &other] {
        let results = Results::by(server, &path);
        assert!(results == expected, "{}", results.difference(&expected));
        let metrics = server.curl("/metrics", &[]).text();
        assert!(metrics.contains("gaitwright_jobs{state=\"succeeded\"} 1"), "{metrics}");
        assert_eq!(server.curl("/readyz", &[]).status, 200);
    }

    // Cancelling, trying again and deleting, each by another server than the one before.
    assert_eq!(one.cancel(&path).status, 409);
    assert_eq!(other.curl(&path, &["-X", "DELETE"]).status, 204);
    assert_eq!(one.curl(&path, &[]).status, 404);
    assert_eq!(one.curl(&format!("{path}/recording.rrd"), &[]).status, 404);
}

/// A figure of `/metrics`, by its name and labels; 0 where there is none.
fn figure(metrics: &str, name: &str) -> f64 {
    let line = metrics.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '));
    line.map_or(0.0, |value| value.parse().unwrap())
}

/// Each process has figures of its own, a worker too; those of the queue are the same wherever they are asked for.
#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn every_process_has_its_own_figures() {
    let cluster = Cluster::new(Database::new().await);
    let (one, other) = (cluster.server(), cluster.server());
    let path = post(&one, &tiny_job(2));
    // The first thing that it does is to take this job up, and that counts as well.
    let worker = cluster.worker_with_status();
    let job = other.wait_for_end(&path);
    assert_eq!(job["state"], "succeeded", "{job}");
    // It is counted once that is recorded, and logged then.
    worker.logged("that the job has ended", |line| line.contains("left"));
    let asked = |path: &str| curl(&worker.url(path), &[], None);
    assert_eq!((asked("/healthz").status, asked("/readyz").status), (200, 200));
    // Nothing else is to be had there.
    assert_eq!((asked("/v1/jobs").status, asked("/").status), (404, 404));
    let metrics = [asked("/metrics"), one.curl("/metrics", &[]), other.curl("/metrics", &[])];
    let metrics = metrics.map(|answer| answer.text());
    let figures = |name: &str| metrics.each_ref().map(|metrics| figure(metrics, name));
    let generations = job["progress"]["generations"].as_f64().unwrap();
    for (name, [by_worker, by_one, by_other]) in [
        ("gaitwright_generations_total", [generations, 0.0, 0.0]),
        ("gaitwright_jobs_ended_total{state=\"succeeded\"}", [1.0, 0.0, 0.0]),
        ("gaitwright_queue_wait_seconds_count", [1.0, 0.0, 0.0]),
        ("gaitwright_jobs_posted_total", [0.0, 1.0, 0.0]),
        ("gaitwright_jobs{state=\"succeeded\"}", [1.0, 1.0, 1.0]),
        ("gaitwright_jobs{state=\"queued\"}", [0.0, 0.0, 0.0]),
    ] {
        assert_eq!(figures(name), [by_worker, by_one, by_other], "{name}");
    }
    assert!(figure(&metrics[0], "gaitwright_steps_total") > 0.0, "{}", metrics[0]);
}

/// A worker that others can ask wants a token as a server does.
#[test]
fn a_worker_tells_others_nothing_without_a_token() {
    let output = Command::new(env!("CARGO_BIN_EXE_gaitwright"))
        .args(["work", "--store", "postgres://a@127.0.0.1:1/a", "--files", "file:///tmp/objects"])
        .env("GAITWRIGHT_STATUS", "0.0.0.0:0")
        .output()
        .unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("GAITWRIGHT_TOKEN"), "{message}");
}

/// A database that asks for a password has it from the URL or from `PGPASSWORD`, and nobody is told.
#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn a_database_may_ask_for_a_password() {
    const PASSWORD: &str = "correct-horse";
    let database = Server::start().guarded_database(PASSWORD).await;
    let folder = tempfile::tempdir().unwrap();
    let files = format!("file://{}", folder.path().join("objects").display());
    let (named, bare) = (database.guarded_url(&format!(":{PASSWORD}")), database.guarded_url(""));
    let arguments = |store| ["--store", store, "--files", files.as_str(), "--log", "debug,sqlx=trace"];
    let by_url = Service::with(&arguments(&named));
    let by_variable = Service::with_environment(&[("PGPASSWORD", PASSWORD)], &arguments(&bare));
    let path = post(&by_url, &tiny_job(2));
    assert_eq!(by_variable.wait_for_end(&path)["state"], "succeeded");
    for service in [&by_url, &by_variable] {
        let log = service.log();
        assert!(log.len() > 10 && !log.iter().any(|line| line.contains(PASSWORD)), "{log:#?}");
    }
    // Neither with another password nor with none.
    for (store, environment) in [
        (&bare, None),
        (&database.guarded_url(":wrong-one"), None),
        (&bare, Some(("PGPASSWORD", "wrong-one"))),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_gaitwright"))
            .arg("serve")
            .args(arguments(store))
            .args(["--listen", "127.0.0.1:0", "--data"])
            .arg(folder.path())
            .env_remove("PGPASSWORD")
            .envs(environment)
            .output()
            .unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(
            message.contains(&bare) && message.contains("password") && !message.contains("wrong-one"),
            "{message}"
        );
    }
}

#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn a_job_is_cancelled_from_any_server() {
    let cluster = Cluster::new(Database::new().await);
    let (one, other, _worker) = (cluster.server(), cluster.server(), cluster.worker());
    let path = post(&one, &long_job());
    one.wait(&path, "learning", |job| job["progress"]["generations"].as_u64() > Some(3));
    let since = Instant::now();
    assert_eq!(other.cancel(&path).status, 202);
    let job = one.wait_for_end(&path);
    println!("cancelled within {:?}", since.elapsed());
    assert_eq!(job["state"], "cancelled");
    // Tried again, it goes on.
    let before = job["progress"]["generations"].as_u64().unwrap();
    assert_eq!(other.retry(&path).status, 202);
    one.wait(&path, "further", |job| job["progress"]["generations"].as_u64() > Some(before));
    assert_eq!(one.cancel(&path).status, 202);
    assert_eq!(other.wait_for_end(&path)["state"], "cancelled");
}

/// A run that is called off before its work proper has begun leaves the recording of the one before it.
#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn a_recording_outlives_a_run_that_never_began() {
    let cluster = Cluster::new(Database::new().await);
    let (server, _worker) = (cluster.server(), cluster.worker());
    let mut job = long_job();
    // An accuracy that takes a while to be found.
    job["accuracy"] = json!({ "tolerance": 1e-5 });
    let path = post(&server, &job);
    server.wait(&path, "learning", |job| job["progress"]["generations"].as_u64() > Some(3));
    assert_eq!(server.cancel(&path).status, 202);
    let ended = server.wait_for_end(&path);
    let before = server.curl(&format!("{path}/recording.rrd"), &[]);
    assert_eq!(before.status, 200);
    assert_eq!(server.retry(&path).status, 202);
    server.wait(&path, "standing", |job| job["stage"] == "standing");
    assert_eq!(server.cancel(&path).status, 202);
    let job = server.wait_for_end(&path);
    assert_eq!((&job["state"], &job["stage"]), (&json!("cancelled"), &json!(null)));
    assert_eq!(job["storage"]["recording_bytes"], ended["storage"]["recording_bytes"]);
    let after = server.curl(&format!("{path}/recording.rrd"), &[]);
    assert!(after.status == 200 && after.body == before.body);
}

/// Parts of a recording that grows in an object store are joined for whoever follows it, and ranges are cut from it.
#[tokio::test]
#[ignore = "needs PostgreSQL and moto_server"]
async fn a_recording_is_followed_and_read_in_ranges() {
    let objects = ObjectStore::start();
    let environment = ObjectStore::environment(objects.port());
    let cluster = Cluster::with_files(Database::new().await, "s3://bucket/a/b", environment);
    let (one, other, worker) = (cluster.server(), cluster.server(), cluster.worker());
    let path = post(&one, &long_job());
    let recording = format!("{path}/recording.rrd");
    one.wait(&path, "learning", |job| job["progress"]["generations"].as_u64() > Some(3));
    let followed = Receiver::start(&other.url(&recording));
    // Long enough for several parts.
    let enough = one.json(&path)["progress"]["generations"].as_u64().unwrap() + 50;
    let since = Instant::now();
    one.wait(&path, "further", |job| {
        job["progress"]["generations"].as_u64() > Some(enough) && since.elapsed() > Duration::from_secs(14)
    });
    assert_eq!(one.cancel(&path).status, 202);
    let job = one.wait_for_end(&path);
    let followed = followed.finish();
    let whole = one.curl(&recording, &[]);
    assert_eq!((whole.status, &*whole.headers["accept-ranges"]), (200, "bytes"));
    assert_eq!(whole.body.len() as u64, job["storage"]["recording_bytes"].as_u64().unwrap());
    assert!(whole.body == followed, "{} bytes were followed of {}", followed.len(), whole.body.len());
    assert!(sound_messages(&whole.body) > 10);

    let length = whole.body.len();
    let range = |range: &str, condition: Option<&str>| {
        let range = format!("Range: bytes={range}");
        let condition = condition.map(|tag| format!("If-Range: {tag}"));
        let mut arguments = vec!["-H", &range];
        arguments.extend(condition.iter().flat_map(|condition| ["-H", condition]));
        other.curl(&recording, &arguments)
    };
    let tag = &whole.headers["etag"];
    // Conditions are looked at in the order that the standard has, as for files in a folder.
    let (old, last) = ("Sun, 06 Nov 1994 08:49:37 GMT", &whole.headers["last-modified"]);
    for (conditions, status) in [
        (vec![format!("If-Match: {tag}")], 200),
        (vec!["If-Match: \"0\"".to_owned()], 412),
        (vec!["If-Match: *".to_owned(), format!("If-Unmodified-Since: {old}")], 200),
        (vec![format!("If-Unmodified-Since: {old}")], 412),
        (vec![format!("If-Unmodified-Since: {last}")], 200),
        (vec![format!("If-Modified-Since: {last}")], 304),
        (vec![format!("If-Modified-Since: {old}")], 200),
        (vec!["If-None-Match: \"0\"".to_owned(), format!("If-Modified-Since: {last}")], 200),
        (vec![format!("If-None-Match: {tag}")], 304),
    ] {
        let arguments: Vec<&str> = conditions.iter().flat_map(|condition| ["-H", condition]).collect();
        assert_eq!(other.curl(&recording, &arguments).status, status, "{conditions:?}");
    }
    for (asked, from, to) in [
        ("0-0".to_owned(), 0, 1),
        ("100-299".to_owned(), 100, 300),
        (format!("{}-", length - 7), length - 7, length),
        ("-20".to_owned(), length - 20, length),
        (format!("5-{}", 2 * length), 5, length),
    ] {
        for condition in [None, Some(tag.as_str())] {
            let part = range(&asked, condition);
            assert_eq!(part.status, 206, "{asked}");
            assert_eq!(part.headers["content-range"], format!("bytes {from}-{}/{length}", to - 1));
            assert!(part.body == whole.body[from..to], "{asked}");
        }
    }
    assert_eq!(range(&format!("{length}-"), None).status, 416);
    assert_eq!(range("0-0", Some("\"other\"")).status, 200);
    assert_eq!(other.curl(&recording, &["-H", &format!("If-None-Match: {tag}")]).status, 304);
    let head = other.curl(&recording, &["-I"]);
    assert_eq!((head.status, head.headers["content-length"].parse::<usize>().unwrap()), (200, length));
    assert!(worker.leave());
}

#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn a_worker_that_is_asked_to_leave_puts_its_job_back() {
    let cluster = Cluster::new(Database::new().await);
    let (server, worker) = (cluster.server(), cluster.worker());
    let path = post(&server, &long_job());
    server.wait(&path, "learning", |job| job["progress"]["generations"].as_u64() > Some(3));
    assert!(worker.leave());
    let job = server.json(&path);
    assert_eq!((&job["state"], &job["attempts"]), (&json!("queued"), &json!(0)));
    let reached = job["progress"]["generations"].as_u64().unwrap();
    let _next = cluster.worker();
    // From where the first has left off: it would take longer from the beginning, and the curve would begin anew.
    let job = server.wait(&path, "further", |job| job["progress"]["generations"].as_u64() > Some(reached));
    assert_eq!(job["attempts"], 1);
    assert_eq!(server.cancel(&path).status, 202);
    server.wait_for_end(&path);
}
