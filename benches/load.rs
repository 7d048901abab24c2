//! The service under load: jobs that learn on all cores, a full queue, clients that follow, and clients that look.
//!
//! `cargo bench --bench load -- [SECONDS] [READERS] [STREAMS] [QUEUED]`: for how long (60), how many clients look at a job
//! once a second (1,000), how many follow its events (500), and how many jobs wait (64). Prints the times that looking at
//! a job takes, from the request to the last byte, and the memory of the service over time.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use gaitwright::jobs::choose_cryptography;
use reqwest::Client;
use serde_json::{Value, json};

const QUADRUPED: &str = include_str!("../examples/quadruped.urdf");

/// How often a reader looks.
const READ_EVERY: Duration = Duration::from_secs(1);

/// How often memory is looked at.
const SAMPLE_EVERY: Duration = Duration::from_secs(5);

/// Points of the curve of memory that is printed.
const MEMORY_POINTS: usize = 16;

/// Time before anything is measured, s: jobs start, pools fill.
const WARM_UP: u64 = 10;

/// A service in a process of its own; killed when dropped.
struct Service {
    child: Child,
    base: String,
}

impl Drop for Service {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Service {
    fn start(data: &std::path::Path, workers: usize, queue: u64) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_gaitwright"))
            .args(["serve", "--listen", "127.0.0.1:0", "--connections", "8192", "--streams", "4096"])
            .args(["--workers", &workers.to_string(), "--queue", &queue.to_string(), "--data"])
            .arg(data)
            .stderr(Stdio::piped())
            .spawn()
            .expect("the service starts");
        let mut log = BufReader::new(child.stderr.take().expect("a pipe")).lines().map_while(Result::ok);
        let base = log.by_ref().find_map(|line| line.strip_prefix("listening on ").map(str::to_owned));
        let base = base.expect("the service says where it listens");
        std::thread::spawn(move || log.for_each(drop));
        Self { child, base }
    }

    /// Resident memory, MB.
    fn memory(&self) -> f64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap_or_default();
        let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kilobytes = resident.and_then(|text| text.trim().strip_suffix(" kB")?.trim().parse::<f64>().ok());
        kilobytes.unwrap_or_default() / 1024.0
    }
}

/// What the clients have seen.
#[derive(Default)]
struct Seen {
    /// s.
    times: Mutex<Vec<f64>>,
    /// Looks that came to nothing, by why.
    failed: Mutex<BTreeMap<String, u64>>,
    event_bytes: AtomicU64,
    /// Streams that were not begun.
    refused: AtomicU64,
    /// Streams that have ended although their jobs had not.
    broken: AtomicU64,
}

/// Posts a job that learns the whole repertoire, however long that takes, and gives its address.
async fn post(client: &Client, base: &str) -> String {
    let job = json!({ "character": { "urdf": QUADRUPED }, "learning": { "generations": 400_000 } });
    let answer = client.post(format!("{base}/v1/jobs")).json(&job).send().await.expect("an answer");
    assert_eq!(answer.status(), 202, "the job is queued");
    let job: Value = answer.json().await.expect("a job");
    format!("{base}{}", job["links"]["self"].as_str().expect("a link"))
}

/// A client on connections of its own. It asks for nothing but plain HTTP: looking for the machine's certificates once for each
/// of so many would take longer than a connection may be silent.
fn client() -> Client {
    Client::builder().tls_certs_only([]).build().expect("a client")
}

/// Follows the events of one job after the other, each to its end.
async fn follow(jobs: Vec<String>, seen: Arc<Seen>) {
    for job in jobs {
        let answer = client().get(format!("{job}/events")).send().await;
        let Some(mut events) = answer.ok().filter(|answer| answer.status() == 200) else {
            seen.refused.fetch_add(1, Ordering::Relaxed);
            return;
        };
        while let Ok(Some(chunk)) = events.chunk().await {
            seen.event_bytes.fetch_add(chunk.len() as u64, Ordering::Relaxed);
        }
        if !has_ended(&job).await {
            seen.broken.fetch_add(1, Ordering::Relaxed);
            return;
        }
    }
}

/// Whether a job says that it has ended.
async fn has_ended(job: &str) -> bool {
    let Ok(answer) = client().get(job).send().await else { return false };
    let job: Value = answer.json().await.unwrap_or_default();
    job["state"] == "succeeded" || job["state"] == "failed"
}

/// Looks at a job again and again, on a connection of its own; counts from `from` on.
async fn look(job: String, offset: Duration, from: Instant, seen: Arc<Seen>) {
    let client = client();
    tokio::time::sleep(offset).await;
    let mut turns = tokio::time::interval(READ_EVERY);
    loop {
        turns.tick().await;
        let start = Instant::now();
        let failure = match client.get(&job).send().await {
            Ok(answer) if answer.status() == 200 => {
                answer.bytes().await.is_err().then(|| "broken off".to_owned())
            }
            Ok(answer) => Some(answer.status().as_u16().to_string()),
            Err(_) => Some("no answer".to_owned()),
        };
        if start < from {
            continue;
        }
        match failure {
            None => seen.times.lock().expect("no panic").push(start.elapsed().as_secs_f64()),
            Some(why) => *seen.failed.lock().expect("no panic").entry(why).or_default() += 1,
        }
    }
}

#[tokio::main(flavor = "current_thread")]
async fn main() {
    choose_cryptography();
    let mut numbers = std::env::args().skip(1).filter_map(|argument| argument.parse::<u64>().ok());
    let mut next = |usual: u64| numbers.next().unwrap_or(usual);
    let (seconds, readers, streams, queued) = (next(60), next(1000), next(500), next(64));
    rlimit::increase_nofile_limit(u64::MAX).expect("the number of open files is known");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let folder = tempfile::tempdir().expect("a folder");
    let service = Service::start(folder.path(), cores, queued + cores as u64);
    let client = client();
    let mut jobs = Vec::new();
    for _ in 0..cores as u64 + queued {
        jobs.push(post(&client, &service.base).await);
    }
    let seen = Arc::new(Seen::default());
    for number in 0..streams as usize {
        // One of those that run, then those that may run when it has ended.
        let followed = jobs.iter().skip(number % cores).step_by(cores).cloned().collect();
        tokio::spawn(follow(followed, Arc::clone(&seen)));
    }
    let from = Instant::now() + Duration::from_secs(WARM_UP);
    for number in 0..readers {
        // Evenly over the time between two looks of one.
        let offset = READ_EVERY.mul_f64(number as f64 / readers as f64);
        let job = jobs[number as usize % jobs.len()].clone();
        tokio::spawn(look(job, offset, from, Arc::clone(&seen)));
    }
    println!("{cores} jobs learn, {queued} wait, {streams} clients follow, {readers} look once a second");
    tokio::time::sleep_until(from.into()).await;
    let mut memory = vec![service.memory()];
    let until = from + Duration::from_secs(seconds);
    while Instant::now() < until {
        tokio::time::sleep(SAMPLE_EVERY.min(until - Instant::now())).await;
        memory.push(service.memory());
    }
    let mut times = std::mem::take(&mut *seen.times.lock().expect("no panic"));
    times.sort_by(f64::total_cmp);
    let quantile = |share: f64| {
        let index = (share * times.len().saturating_sub(1) as f64).round() as usize;
        times.get(index).map_or(f64::NAN, |time| 1e3 * time)
    };
    println!(
        "GET /v1/jobs/{{id}}: {} answers, failures {:?}",
        times.len(),
        seen.failed.lock().expect("no panic")
    );
    println!(
        "time, ms: median {:.1}, 90 % {:.1}, 99 % {:.1}, 99.9 % {:.1}, longest {:.1}",
        quantile(0.5),
        quantile(0.9),
        quantile(0.99),
        quantile(0.999),
        quantile(1.0)
    );
    println!(
        "events: {:.1} MB, {} streams refused, {} broken off",
        seen.event_bytes.load(Ordering::Relaxed) as f64 / 1e6,
        seen.refused.load(Ordering::Relaxed),
        seen.broken.load(Ordering::Relaxed)
    );
    let mut ended = 0;
    for job in &jobs {
        ended += usize::from(has_ended(job).await);
    }
    println!("jobs: {ended} have ended");
    let third = memory.len().div_ceil(3);
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let thirds: Vec<String> = memory.chunks(third).map(|part| format!("{:.0}", mean(part))).collect();
    let mut sorted = memory.clone();
    sorted.sort_by(f64::total_cmp);
    println!(
        "memory of the service, MB: {:.0} at first, {} in the thirds of the time, {:.0} half of the time or less, {:.0} at most",
        memory[0],
        thirds.join(", "),
        sorted[sorted.len() / 2],
        sorted[sorted.len() - 1]
    );
    let points = memory.chunks(memory.len().div_ceil(MEMORY_POINTS));
    let points: Vec<String> = points.map(|part| format!("{:.0}", mean(part))).collect();
    println!("over time, MB: {}", points.join(" "));
}
