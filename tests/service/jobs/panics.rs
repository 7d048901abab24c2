//! A panic in a job fails that job alone.

use std::fmt::Debug;
use std::time::Duration;

use gaitwright::jobs::{Job, JobTerms, Jobs, Posting, ServiceOptions, Stage, Work, start};
use serde_json::{Value, json};
use tempfile::TempDir;
use tokio::runtime::Handle;
use tokio_util::sync::CancellationToken;
use tracing::field::{Field, Visit};
use tracing::{Event, Subscriber};
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

use crate::http::client::{PADDLER, QUADRUPED};

/// What a worker logs in the middle of a job whose checkpoint is damaged, and of one whose checkpoint has no place, once it has learned
/// a gait.
const DEFECTS: [&str; 2] = ["the checkpoint cannot be read", "the checkpoint could not be written"];

/// A log that panics when one of them is logged, on the thread and in the place that logs it.
struct Panicking;

struct Message(bool);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        let message = format!("{value:?}");
        self.0 |= field.name() == "message" && DEFECTS.iter().any(|defect| message.starts_with(defect));
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
    post_of(jobs, PADDLER, &terms).await
}

async fn post_of(jobs: &Jobs, urdf: &str, terms: &Value) -> Job {
    let terms = JobTerms::parse(terms.to_string().as_bytes()).unwrap();
    let posting = Posting { caller: String::new(), key: None };
    jobs.submit_bytes((urdf.as_bytes().to_vec(), None, ""), terms, posting).await.unwrap()
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
    // What was learned before the defect stays.
    let terms = json!({ "seed": 2, "task": { "speed": 0.9 },
        "learning": { "generations": 24, "gait_generations": 12 } });
    let learned = post_of(&jobs, QUADRUPED, &terms).await;
    let folder = data.path().join("jobs").join(learned.id.to_string());
    // Not before it has been looked for a checkpoint to go on from.
    while jobs.job(learned.id).await.unwrap().stage != Some(Stage::Learning) {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    std::fs::create_dir_all(folder.join("checkpoint.json/in the way")).unwrap();
    let learned = ended(&jobs, &learned).await;
    assert!(learned.error.as_ref().unwrap().contains("broke off"), "{:?}", learned.error);
    let Work::Learning(found) = &learned.work else { panic!("not one that learns") };
    assert_eq!(found.motions.len(), 1);
    assert!(found.metrics.is_some() && found.outcome.is_some(), "{found:?}");
    assert_eq!(std::fs::read_dir(folder.join("motions")).unwrap().count(), 1);
    assert!(folder.join("motions.json").exists());
    assert_eq!(jobs.workers(), 1);
    shutdown.cancel();
    while jobs.workers() > 0 {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    jobs.close().await;
}
