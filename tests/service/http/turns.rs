//! Short computations take turns, and none keeps its turn when nobody waits for it.

use std::time::{Duration, Instant};

use gaitwright::jobs::{Jobs, ServiceError, ServiceOptions};
use serde_json::json;
use tempfile::TempDir;
use tokio_util::sync::CancellationToken;

use super::client::{PADDLER, Receiver, Service};

fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

#[tokio::test]
async fn a_computation_that_nobody_waits_for_makes_room() {
    let data = TempDir::new().unwrap();
    let options = ServiceOptions::new(data.path().to_owned());
    let jobs = Jobs::open(options, CancellationToken::new()).await.unwrap();
    let endless = |jobs: Jobs| async move {
        let wait = |given_up: &dyn Fn() -> bool| {
            while !given_up() {
                std::thread::sleep(Duration::from_millis(5));
            }
            Ok(())
        };
        jobs.compute(wait).await
    };
    let held: Vec<_> = (0..cores()).map(|_| tokio::spawn(endless(jobs.clone()))).collect();
    tokio::time::sleep(Duration::from_millis(200)).await;
    let since = Instant::now();
    assert!(matches!(jobs.compute(|_| Ok(())).await, Err(ServiceError::Busy)));
    assert!(since.elapsed() < Duration::from_secs(20));
    for task in held {
        task.abort();
    }
    jobs.compute(|_| Ok(())).await.unwrap();
}

#[test]
fn a_simulation_that_nobody_reads_makes_room() {
    let service = Service::start();
    let simulation = |duration: f64| {
        json!({ "character": { "urdf": PADDLER }, "duration": duration, "sample_every": 1e9 }).to_string()
    };
    let (long, short) = (simulation(1999.0), simulation(0.1));
    let json = ["-H", "content-type: application/json", "-d"];
    for _ in 0..cores() {
        // The client leaves with the first sample, long before the next.
        Receiver::with(&service.url("/v1/simulations"), &[&json[..], &[&long]].concat()).leave();
    }
    // It is noticed between two steps.
    let since = Instant::now();
    while service.curl("/v1/simulations", &[&json[..], &[&short]].concat()).status != 200 {
        assert!(since.elapsed() < Duration::from_secs(60), "there is no room");
        std::thread::sleep(Duration::from_millis(50));
    }
}
