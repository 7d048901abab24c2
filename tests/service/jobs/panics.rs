//! A panic in a job fails that job alone.

use std::fmt::Debug;
use std::time::Duration;

use gaitwright::jobs::{Job, JobTerms, Jobs, Posting, ServiceOptions, start};
use serde_json::json;
use tempfile::TempDir;
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;
use tracing::field::{Field, Visit};
use tracing::{Event, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

use crate::http::client::PADDLER;

/// What a worker logs in the middle of a job whose checkpoint is damaged.
const DAMAGED: &str = "the checkpoint cannot be read";

/// A log that panics when that is logged, on the thread and in the place that logs it.
struct Panicking;

struct Message(bool);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        self.0 |= field.name() == "message" && format!("{value:?}").starts_with(DAMAGED);
    }
}

impl<S: Subscriber> Layer<S> for Panicking {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut message = Message(false);
        event.record(&mut message);
        assert!(!message.0, "a defect on purpose");
    }
}

async fn post(jobs: &Jobs) -> Job {
    let terms = json!({ "seed": 2, "learning": { "population": 4, "islands": 1, "elite": 1, "episodes": 2,
        "trial_seconds": 0.5, "check_seconds": 1.0, "generations": 1 } });
    let terms = JobTerms::parse(terms.to_string().as_bytes()).unwrap();
    let posting = Posting { caller: String::new(), key: None };
    jobs.submit_bytes((PADDLER.as_bytes().to_vec(), None, ""), terms, posting).await.unwrap()
}

async fn ended(jobs: &Jobs, job: &Job) -> Job {
    loop {
        let job = jobs.job(job.id).await.unwrap();
        if job.state.is_final() {
            return job;
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_in_a_job_fails_that_job_alone() {
    // No other test of this program has a worker in its own process.
    let _ = tracing::subscriber::set_global_default(tracing_subscriber::registry().with(Panicking));
    let data = TempDir::new().unwrap();
    let shutdown = CancellationToken::new();
    let jobs = Jobs::open(ServiceOptions::new(data.path().to_owned()), shutdown.clone()).await.unwrap();
    let (broken, next) = (post(&jobs).await, post(&jobs).await);
    let folder = data.path().join("jobs").join(broken.id.to_string());
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("checkpoint.json"), "{").unwrap();
    start(&jobs, &Handle::current()).unwrap();

    let broken = ended(&jobs, &broken).await;
    assert_eq!(broken.state.name(), "failed");
    let error = broken.error.unwrap();
    assert!(error.contains("the program broke off: a defect on purpose"), "{error}");
    assert_eq!(broken.attempts, 1, "it is not tried again");
    // The same worker goes on with the next, and with those that come.
    for other in [next, post(&jobs).await] {
        let other = ended(&jobs, &other).await;
        assert!(!other.error.unwrap_or_default().contains("broke off"));
        assert_eq!(other.progress.generations, 1);
    }
    assert_eq!(jobs.workers(), 1);
    shutdown.cancel();
    while jobs.workers() > 0 {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    jobs.close().await;
}
