//! The queue's own ceiling, and jobs an hour by the number of workers.
//!
//! `cargo bench --bench machines -- [STORE] [FILES] [JOBS]`: an empty PostgreSQL database and a place of files as `serve` takes
//! them, and how many jobs are worked at by each number of workers (12). Without a database, SQLite's queue alone is measured.
//!
//! The queue holds 10,000 jobs of ten callers. Printed are how many jobs a second eight post who do at once, how many are claimed by one and
//! by eight who ask at once, how many are claimed and settled, and the bytes that a job takes. For jobs an hour, workers are
//! processes with one thread each, on one core each as far as there are cores.

use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use gaitwright::jobs::{
    CharacterName, FilesPlace, Job, JobState, Jobs, Priority, QueueRoom, ServiceOptions, Settings, Store,
    StoreError, StorePlace,
};
use serde_json::json;
use tokio::runtime::Runtime;
use tokio_util::sync::CancellationToken;

const QUADRUPED: &str = include_str!("../examples/quadruped.urdf");

/// Jobs that wait.
const QUEUED: usize = 10_000;

/// Who posts them.
const CALLERS: usize = 10;

/// Claims that are timed.
const CLAIMS: usize = 500;

const LEASE: Duration = Duration::from_secs(3600);

fn job(number: usize) -> Job {
    let character = CharacterName { name: "quadruped".to_owned(), digest: "sha256:0".to_owned() };
    Job::queued(character, Settings::default(), (format!("caller {}", number % CALLERS), Priority::default()))
}

/// Carries `work` out so many times, by so many at once, and gives how often that is a second.
async fn rate<F: Future<Output = ()> + Send + 'static>(
    times: usize,
    at_once: usize,
    work: impl Fn(usize) -> F + Clone + Send + 'static,
) -> f64 {
    let since = Instant::now();
    let runs: Vec<_> = (0..at_once)
        .map(|one| {
            let work = work.clone();
            tokio::spawn(async move {
                for number in (one..times).step_by(at_once) {
                    work(number).await;
                }
            })
        })
        .collect();
    for run in runs {
        run.await.expect("the work succeeds");
    }
    times as f64 / since.elapsed().as_secs_f64()
}

/// What comes of asking a store until it has time: who writes into a file waits for the others, and not for ever.
macro_rules! answered {
    ($asked:expr) => {
        loop {
            match $asked.await {
                Ok(answer) => break answer,
                Err(StoreError::Busy) => {}
                Err(error) => panic!("{error}"),
            }
        }
    };
}

async fn queue(name: &str, store: Store, bytes: impl AsyncFn() -> f64) {
    let room = QueueRoom { all: u64::MAX, caller: u64::MAX };
    let before = bytes().await;
    let post = {
        let store = store.clone();
        move |number| {
            let store = store.clone();
            async move {
                let job = job(number);
                answered!(store.post(&job, QUADRUPED.as_bytes(), None, room));
            }
        }
    };
    let posted = rate(QUEUED, 8, post).await;
    let size = (bytes().await - before) / QUEUED as f64;
    let claim = |settle: bool| {
        let store = store.clone();
        move |_| {
            let store = store.clone();
            async move {
                let claimed = answered!(store.claim("bench", LEASE));
                let mut claimed = claimed.expect("a job waits");
                if settle {
                    claimed.job.end(JobState::Succeeded);
                    assert!(answered!(store.settle(claimed.claim, &mut claimed.job)));
                }
            }
        }
    };
    let one = rate(CLAIMS, 1, claim(false)).await;
    let eight = rate(CLAIMS, 8, claim(false)).await;
    let settled = rate(CLAIMS, 8, claim(true)).await;
    println!("| {name} | {posted:.0} | {one:.0} | {eight:.0} | {settled:.0} | {size:.0} |");
}

/// A worker in a process of its own; killed when dropped.
struct Worker(Child);

impl Drop for Worker {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Worker {
    fn start(number: usize, data: &std::path::Path, store: &str, files: &str) -> Self {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let child = Command::new("taskset")
            .args(["-c", &(number % cores).to_string(), env!("CARGO_BIN_EXE_gaitwright"), "work"])
            .args(["--store", store, "--files", files, "--data"])
            .arg(data)
            .stderr(Stdio::null())
            .spawn()
            .expect("a worker starts");
        Self(child)
    }
}

/// Jobs an hour of so many workers, each job a trot of the bundled quadruped.
async fn jobs_an_hour(workers: usize, count: usize, data: &std::path::Path, store: &str, files: &str) -> f64 {
    let options = ServiceOptions {
        store: store.parse::<StorePlace>().expect("a store"),
        files: files.parse::<FilesPlace>().expect("files"),
        workers: 0,
        queue: u64::MAX,
        ..ServiceOptions::new(data.to_owned())
    };
    let jobs = Jobs::open(options, CancellationToken::new()).await.expect("the jobs open");
    let learning = json!({ "generations": 4 });
    let task = json!({ "gait": "trot", "froude": 0.4 });
    let mut posted = Vec::new();
    for seed in 0..count {
        let document =
            json!({ "character": { "urdf": QUADRUPED }, "task": task, "learning": learning, "seed": seed });
        let request =
            gaitwright::jobs::JobRequest::parse(document.to_string().as_bytes()).expect("a request");
        let job = jobs.submit(request.character, request.terms, Default::default()).await.expect("queued");
        posted.push(job.id);
    }
    let _workers: Vec<_> = (0..workers).map(|number| Worker::start(number, data, store, files)).collect();
    let mut times = Vec::new();
    for id in posted {
        let job = loop {
            let job = jobs.job(id).await.expect("the job is there");
            if job.state.is_final() {
                break job;
            }
            tokio::time::sleep(Duration::from_millis(200)).await;
        };
        assert_eq!(job.state, JobState::Succeeded, "{:?}", job.error);
        times.push((job.timings.started.expect("begun"), job.timings.ended.expect("ended")));
    }
    jobs.close().await;
    let begun = times.iter().map(|(begun, _)| *begun).min().expect("a job");
    let ended = times.iter().map(|(_, ended)| *ended).max().expect("a job");
    count as f64 * 3600.0 / ended.duration_since(begun).as_secs_f64()
}

/// Size of the database at `url`, bytes.
async fn database_size(url: &str) -> f64 {
    use sqlx::{ConnectOptions, Row};
    let options: sqlx::postgres::PgConnectOptions = url.parse().expect("a URL");
    let mut connection = options.connect().await.expect("a connection");
    let query = sqlx::query("SELECT pg_total_relation_size('jobs') AS size");
    query.fetch_one(&mut connection).await.map_or(0.0, |row| row.get::<i64, _>("size") as f64)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let runtime = Runtime::new().expect("the runtime starts");
    let folder = tempfile::tempdir().expect("a folder");
    println!(
        "| store | posted a second, by eight | claimed a second, by one | by eight | claimed and settled by eight | bytes a job |"
    );
    println!("|---|---|---|---|---|---|");
    runtime.block_on(async {
        let size = async || {
            let files = ["gaitwright.db", "gaitwright.db-wal"];
            files
                .iter()
                .map(|file| std::fs::metadata(folder.path().join(file)).map_or(0, |about| about.len()))
                .sum::<u64>() as f64
        };
        queue("SQLite", Store::open(folder.path()).await.expect("the store opens"), size).await;
    });
    let [url, files, ..] = arguments.as_slice() else { return };
    let count = arguments.get(2).map_or(12, |text| text.parse().expect("a number of jobs"));
    runtime.block_on(async {
        let store = Store::connect(&url.parse().expect("a URL")).await.expect("the store opens");
        queue("PostgreSQL", store.clone(), async || database_size(url).await).await;
        // What waits is not what the workers are to do.
        for id in store.ids().await.expect("the ids") {
            let any = |_: gaitwright::jobs::StoredJob, _: bool| Ok::<_, StoreError>(());
            store.delete(id, any).await.expect("deleted");
        }
        println!("\n| workers | jobs an hour |\n|---|---|");
        for workers in [1, 2, 4] {
            let rate = jobs_an_hour(workers, count, folder.path(), url, files).await;
            println!("| {workers} | {rate:.0} |");
        }
    });
}
