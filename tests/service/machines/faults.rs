//! Whatever fails, no accepted job is lost, and each comes to what it comes to when nothing does.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use gaitwright::jobs::MOST_ATTEMPTS;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use super::cluster::{Cluster, Worker};
use super::forwarder::Forwarder;
use super::objects::ObjectStore;
use super::postgres::{Database, Server};
use super::results::Results;
use crate::http::client::{Receiver, Service, events};
use crate::http::whole::tiny_job;

const SEEDS: [u64; 3] = [1, 2, 3];

/// How long a worker is cut off.
const CUT: Duration = Duration::from_secs(60);

/// A tiny job that takes some seconds, with a checkpoint now and then.
fn slow_job(seed: u64) -> Value {
    let mut job = tiny_job(seed);
    job["learning"]["generations"] = 150.into();
    job["learning"]["search"] = "paper".into();
    job
}

/// Posts one of the jobs for every seed. Gives them by their paths.
fn post_all(server: &Service, job: impl Fn(u64) -> Value) -> BTreeMap<String, u64> {
    let post = |seed| {
        let answer = server.post_json("/v1/jobs", &job(seed));
        assert_eq!(answer.status, 202, "{}", answer.text());
        (answer.headers["location"].clone(), seed)
    };
    SEEDS.into_iter().map(post).collect()
}

/// Waits for the end of all jobs, and compares what they leave with what they leave on a server of the usual kind.
fn check_all(server: &Service, jobs: &BTreeMap<String, u64>, job: impl Fn(u64) -> Value) {
    let alone = Service::start();
    let mut motions = 0;
    for (path, seed) in jobs {
        let ended = server.wait_for_end(path);
        let undisturbed = alone.post_json("/v1/jobs", &job(*seed)).headers["location"].clone();
        alone.wait_for_end(&undisturbed);
        let (results, expected) = (Results::by(server, path), Results::by(&alone, &undisturbed));
        assert!(results == expected, "seed {seed}: {ended}\n{}", results.difference(&expected));
        motions += usize::from(results.has_motion());
    }
    assert!(motions > 0);
}

fn wait_until_learning(server: &Service, path: &str, generations: u64) {
    server.wait(path, "learning", |job| job["progress"]["generations"].as_u64() > Some(generations));
}

#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn workers_are_killed() {
    let cluster = Cluster::new(Database::new().await);
    let server = cluster.server();
    let jobs = post_all(&server, slow_job);
    let mut workers: Vec<Worker> = (0..2).map(|_| cluster.worker()).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..8 {
        std::thread::sleep(Duration::from_millis(rng.random_range(200..4000)));
        // A job that is lost too often in a row fails, which is not what this is about.
        for path in jobs.keys() {
            server.wait(path, "at an attempt with two more to come", |job| {
                job["state"] == "succeeded" || job["attempts"].as_u64() < Some(u64::from(MOST_ATTEMPTS) - 1)
            });
        }
        workers.remove(rng.random_range(0..2)).kill();
        workers.push(cluster.worker());
    }
    check_all(&server, &jobs, slow_job);
}

/// The one that is cut off for a minute stops by itself, before it can hear that another has its job.
#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn a_worker_is_cut_off_from_the_database() {
    let cluster = Cluster::with_usual_lease(Database::new().await);
    let server = cluster.server();
    let way = Forwarder::to(cluster.database.server().port());
    let jobs = post_all(&server, slow_job);
    let first = cluster.worker_at(&cluster.database.url_at(way.port()));
    let path = jobs.keys().next().unwrap();
    wait_until_learning(&server, path, 5);
    way.block();
    let since = Instant::now();
    first.logged("that its lease is over", |line| line.contains("lease is over"));
    println!("the first has stopped after {:?}", since.elapsed());
    let second = cluster.worker();
    server.wait(path, "taken up by another", |job| job["attempts"] == 2 || job["state"] != "running");
    println!("taken from the first after {:?}", since.elapsed());
    let id = path.rsplit('/').next().unwrap();
    let line = second.logged("from where it goes on", |line| {
        line.contains(id) && line.contains("goes on from its checkpoint")
    });
    println!("{line}");
    std::thread::sleep(CUT.saturating_sub(since.elapsed()));
    wait_until_learning(&server, path, 10);
    // What the first has kept to itself arrives now, and what it has begun to say.
    way.open();
    check_all(&server, &jobs, slow_job);
    first.logged("that it has lost its job", |line| line.contains("has passed to another worker"));
}

#[tokio::test]
#[ignore = "needs PostgreSQL"]
async fn the_database_is_restarted() {
    let database = Server::start().database().await;
    let cluster = Cluster::new(database);
    let server = cluster.server();
    let _workers = [cluster.worker(), cluster.worker()];
    let jobs = post_all(&server, slow_job);
    let followed = Receiver::start(&server.url(&format!("{}/events", jobs.keys().next().unwrap())));
    // As the first run begins: that its files are the job's can be recorded only later.
    server.wait(jobs.keys().next().unwrap(), "taken up", |job| job["state"] == "running");
    cluster.database.server().fall();
    std::thread::sleep(Duration::from_secs(2));
    cluster.database.server().rise();
    for pause in [0, 1, 4] {
        let path = jobs.keys().next().unwrap();
        wait_until_learning(&server, path, 3);
        cluster.database.server().fall();
        // Nothing is accepted that is not kept.
        let refused = server.post_json("/v1/jobs", &tiny_job(1));
        refused.problem(503);
        assert_eq!(server.curl("/readyz", &[]).status, 503);
        assert_eq!(server.curl("/healthz", &[]).status, 200);
        std::thread::sleep(Duration::from_secs(pause));
        cluster.database.server().rise();
    }
    check_all(&server, &jobs, slow_job);
    let listed = server.json("/v1/jobs");
    assert_eq!(listed["jobs"].as_array().unwrap().len(), SEEDS.len(), "{listed}");
    let events = events(&followed.finish());
    assert_eq!(events.last().unwrap().0, "end", "who follows a job does so to its end");
}

#[tokio::test]
#[ignore = "needs PostgreSQL and moto_server"]
async fn the_object_store_is_slow_and_fails() {
    let objects = ObjectStore::start();
    let way = Forwarder::to(objects.port());
    let environment = ObjectStore::environment(way.port());
    let cluster = Cluster::with_files(Database::new().await, "s3://bucket/prefix", environment);
    let server = cluster.server();
    let workers = [cluster.worker(), cluster.worker()];
    let early = post_all(&server, tiny_job);
    early.keys().for_each(|path| drop(server.wait_for_end(path)));
    way.slow_down(300);
    let jobs = post_all(&server, slow_job);
    wait_until_learning(&server, jobs.keys().next().unwrap(), 3);
    way.block();
    std::thread::sleep(Duration::from_secs(10));
    // Jobs are accepted all the same, and wait for their files to arrive.
    let answer = server.post_json("/v1/jobs", &slow_job(2));
    assert_eq!(answer.status, 202);
    // What is in the database is read all the same; what is not, later.
    assert_eq!(server.curl("/v1/jobs", &[]).status, 200);
    let report = format!("{}/report", early.keys().next().unwrap());
    let unread = server.curl(&report, &["--max-time", "100"]);
    unread.problem(503);
    assert!(unread.headers["retry-after"].parse::<u32>().unwrap() > 0);
    let since = Instant::now();
    let reason = server.curl("/readyz", &[]).problem(503)["detail"].to_string();
    assert!(reason.contains("has not answered"), "{reason}");
    println!("not ready after {:?}: {reason}", since.elapsed());
    std::thread::sleep(Duration::from_secs(10));
    way.open();
    assert_eq!(server.curl(&report, &["--max-time", "100"]).status, 200);
    check_all(&server, &jobs, slow_job);
    server.wait_for_end(&answer.headers["location"]);
    drop(workers);
}
