//! A service that is killed again and again, at moments drawn by chance, loses nothing and comes to the same results.
//!
//! `KILLS` is how often it is killed (100), `KILL_SEED` draws other moments.

use std::collections::{BTreeMap, BTreeSet};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant, SystemTime};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;
use tempfile::TempDir;

use super::client::Service;
use super::whole::{Left, short_job, sound_messages};

/// Seeds and generations of the jobs: long ones have many checkpoints to go on from.
const KINDS: [(u64, u32); 5] = [(2, 12), (3, 2), (3, 12), (2, 2), (1, 12)];

/// Jobs that are posted in the course of a hundred kills.
const POSTED: usize = 12;

/// Longest time that is waited for a checkpoint before a kill.
const CHECKPOINT: Duration = Duration::from_secs(3);

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap_or_else(|_| panic!("{name}: {text}")))
}

/// When the running job, if there is one, has written its checkpoint last.
fn checkpoint(service: &Service) -> Option<SystemTime> {
    let running = service.json("/v1/jobs?state=running");
    let path = running["jobs"].as_array()?.first()?["links"]["self"].as_str()?.to_owned();
    std::fs::metadata(service.folder(&path).join("checkpoint.json")).ok()?.modified().ok()
}

/// Whether a job runs or waits.
fn at_work(service: &Service) -> bool {
    let some = |state: &str| service.json(&format!("/v1/jobs?limit=1&state={state}"))["jobs"] != json!([]);
    some("running") || some("queued")
}

/// Waits until the running job has written a checkpoint, in vain where none runs for long enough.
fn wait_for_checkpoint(service: &Service, before: Option<SystemTime>) {
    let since = Instant::now();
    while since.elapsed() < CHECKPOINT && at_work(service) {
        let now = checkpoint(service);
        if now.is_some() && now != before {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A reader of the growing recording of a job; what it has when the service is killed.
struct Follower {
    reader: Child,
    received: tempfile::NamedTempFile,
}

impl Follower {
    fn start(service: &Service, path: &str) -> Self {
        let received = tempfile::NamedTempFile::new().unwrap();
        let reader = Command::new("curl")
            .args(["-sN", &service.url(&format!("{path}/recording.rrd")), "-o"])
            .arg(received.path())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        Self { reader, received }
    }

    /// Messages received, after the service has been killed.
    fn finish(mut self) -> usize {
        // The connection has broken off.
        let _ = self.reader.wait();
        let bytes = std::fs::read(self.received.path()).unwrap();
        if bytes.starts_with(b"RRF2") { sound_messages(&bytes) } else { 0 }
    }
}

#[test]
fn results_are_the_same_however_often_the_service_is_killed() {
    let kills = number("KILLS", 100);
    let seed = number("KILL_SEED", 1);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let data = TempDir::new().unwrap();
    // By path: which kind was posted, and what was acknowledged.
    let mut accepted: BTreeMap<String, (u64, u32)> = BTreeMap::new();
    let (mut cancelled, mut deleted) = (BTreeSet::new(), BTreeSet::new());
    let (mut followed, mut resumable) = (0, 0);
    for kill in 0..kills {
        let mut service = Service::on(data.path(), &[]);
        let posted = accepted.len() + deleted.len();
        if posted < POSTED * (kill as usize / 100 + 1) && (posted == 0 || rng.random_bool(0.15)) {
            let job = KINDS[posted % KINDS.len()];
            let answer = service.post_json("/v1/jobs", &short_job(job.0, job.1));
            assert_eq!(answer.status, 202, "{}", answer.text());
            accepted.insert(answer.headers["location"].clone(), job);
        }
        let paths: Vec<&String> = accepted.keys().collect();
        let path = paths[rng.random_range(0..paths.len())].clone();
        let drawn = rng.random_range(0..20);
        // One that has ended otherwise refuses.
        if drawn == 0 && !cancelled.contains(&path) && service.cancel(&path).status == 202 {
            cancelled.insert(path.clone());
        }
        if drawn == 1 && cancelled.contains(&path) && service.curl(&path, &["-X", "DELETE"]).status == 204 {
            accepted.remove(&path);
            cancelled.remove(&path);
            deleted.insert(path.clone());
        }
        let follower = accepted.contains_key(&path).then(|| Follower::start(&service, &path));
        // While a job is being taken up, or somewhere in the time after it has written a checkpoint.
        if rng.random_bool(0.5) {
            let before = checkpoint(&service);
            wait_for_checkpoint(&service, before);
        }
        std::thread::sleep(Duration::from_millis(rng.random_range(0..300)));
        let left = checkpoint(&service);
        service.signal("KILL");
        assert!(!service.wait_for_exit());
        resumable += usize::from(left.is_some());
        followed += follower.map_or(0, Follower::finish);
    }

    let undisturbed = Service::start();
    let expected: BTreeMap<(u64, u32), Left> = KINDS
        .into_iter()
        .map(|job| {
            let posted = undisturbed.post_json("/v1/jobs", &short_job(job.0, job.1));
            let path = posted.headers["location"].clone();
            undisturbed.wait_for_end(&path);
            (job, Left::by(&undisturbed, &path))
        })
        .collect();
    assert!(expected.values().any(Left::has_motion) && !expected.values().all(Left::has_motion));

    let service = Service::on(data.path(), &[]);
    let mut tried_again = 0;
    for (path, job) in &accepted {
        let mut ended = service.wait_for_end(path);
        if cancelled.contains(path) {
            assert_eq!(ended["state"], "cancelled", "{ended}");
            continue;
        }
        // One that was never left alone for long enough says so, and can be tried again.
        if ended["error"].as_str().is_some_and(|error| error.contains("times in a row")) {
            assert_eq!((&ended["state"], &ended["attempts"]), (&"failed".into(), &4.into()));
            assert_eq!(service.retry(path).status, 202);
            ended = service.wait_for_end(path);
            tried_again += 1;
        }
        assert_ne!(ended["state"], "cancelled");
        assert_eq!(Left::by(&service, path), expected[job], "{path}, {job:?}");
    }
    for path in &deleted {
        service.curl(path, &[]).problem(404);
        assert!(!service.folder(path).exists());
    }
    eprintln!(
        "{kills} kills (seed {seed}): {} jobs whole, {tried_again} of them tried again, {} cancelled, {} deleted, \
         {followed} messages followed, {resumable} kills of a job with a checkpoint",
        accepted.len() - cancelled.len(),
        cancelled.len(),
        deleted.len(),
    );
    assert!(accepted.len() > cancelled.len(), "nothing was left to be compared");
    assert!(resumable as u64 >= kills / 10, "{resumable} of {kills} kills left a checkpoint to go on from");
}
