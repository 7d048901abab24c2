//! A service that is killed again and again, at moments drawn by chance, loses nothing and comes to the same results.
//!
//! `GAITWRIGHT_KILLS` is how often it is killed (100), `GAITWRIGHT_KILL_SEED` draws other moments.

use std::collections::{BTreeMap, BTreeSet};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use super::client::Service;
use super::whole::{Left, sound_messages, tiny_job};

const SEEDS: [u64; 3] = [1, 2, 3];

/// Jobs that are posted in the course of a hundred kills.
const POSTED: usize = 8;

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap_or_else(|_| panic!("{name}: {text}")))
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
    let kills = number("GAITWRIGHT_KILLS", 100);
    let seed = number("GAITWRIGHT_KILL_SEED", 1);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let data = TempDir::new().unwrap();
    // By path: what was posted, and what was acknowledged.
    let mut accepted: BTreeMap<String, u64> = BTreeMap::new();
    let (mut cancelled, mut deleted) = (BTreeSet::new(), BTreeSet::new());
    let mut followed = 0;
    for kill in 0..kills {
        let mut service = Service::on(data.path(), &[]);
        let posted = accepted.len() + deleted.len();
        if posted < POSTED * (kill as usize / 100 + 1) && (posted == 0 || rng.random_bool(0.15)) {
            let job = SEEDS[posted % SEEDS.len()];
            let answer = service.post_json("/v1/jobs", &tiny_job(job));
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
        // Mostly while a job is being taken up, now and then when it is far.
        let longest = if rng.random_bool(0.1) { 3000 } else { 300 };
        std::thread::sleep(Duration::from_millis(rng.random_range(0..longest)));
        service.signal("KILL");
        assert!(!service.wait_for_exit());
        followed += follower.map_or(0, Follower::finish);
    }

    let undisturbed = Service::start();
    let expected: BTreeMap<u64, Left> = SEEDS
        .into_iter()
        .map(|job| {
            let path = undisturbed.post_json("/v1/jobs", &tiny_job(job)).headers["location"].clone();
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
        assert_eq!(Left::by(&service, path), expected[job], "{path}, seed {job}");
    }
    for path in &deleted {
        service.curl(path, &[]).problem(404);
        assert!(!service.folder(path).exists());
    }
    eprintln!(
        "{kills} kills (seed {seed}): {} jobs whole, {tried_again} of them tried again, {} cancelled, {} deleted, \
         {followed} messages followed",
        accepted.len() - cancelled.len(),
        cancelled.len(),
        deleted.len(),
    );
    assert!(accepted.len() > cancelled.len(), "nothing was left to be compared");
}
