//! Whose turn it is, against a model that looks at every job that waits.

use std::collections::BTreeMap;
use std::time::Duration;

use gaitwright::jobs::{Claimed, Job, JobState};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uuid::Uuid;

use super::{Place, post};

const LEASE: Duration = Duration::from_secs(3600);

on_both_databases! {
    jobs_are_taken_up_by_priority_and_callers_take_turns,
    many_jobs_of_one_caller_do_not_hold_up_another,
}

/// The queue as the documentation describes it.
#[derive(Default)]
struct Model {
    waiting: Vec<Job>,
    running: Vec<Job>,
    /// Which claim was each caller's last.
    served: BTreeMap<String, usize>,
    claims: usize,
}

impl Model {
    fn claim(&mut self) -> Option<Uuid> {
        let urgent = self.waiting.iter().map(|job| job.priority).max()?;
        let running = |caller: &str| self.running.iter().filter(|job| job.caller == caller).count();
        let served = |caller: &str| self.served.get(caller).copied().unwrap_or(0);
        let mut next = 0;
        for (index, job) in self.waiting.iter().enumerate() {
            let best = &self.waiting[next];
            let rank = |job: &Job| (running(&job.caller), served(&job.caller), job.id);
            if job.priority == urgent && (best.priority < urgent || rank(job) < rank(best)) {
                next = index;
            }
        }
        let job = self.waiting.remove(next);
        self.claims += 1;
        self.served.insert(job.caller.clone(), self.claims);
        self.running.push(job);
        self.running.last().map(|job| job.id)
    }
}

async fn jobs_are_taken_up_by_priority_and_callers_take_turns(place: Place) {
    for seed in 0..12 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let place = place.another().await;
        let store = place.open().await;
        let mut model = Model::default();
        let mut held: Vec<Claimed> = Vec::new();
        let callers = ["", "10.0.0.1", "token:a", "token:b"];
        for _ in 0..60 {
            match rng.random_range(0..5) {
                0..=2 => {
                    let caller = callers[rng.random_range(0..callers.len())];
                    model.waiting.push(post(&store, caller, rng.random_range(-1..=1)).await);
                }
                3 => {
                    let claimed = store.claim("somebody", LEASE).await.unwrap();
                    assert_eq!(
                        claimed.as_ref().map(|claimed| claimed.claim.id),
                        model.claim(),
                        "seed {seed}"
                    );
                    held.extend(claimed);
                }
                _ if held.is_empty() => {}
                _ => {
                    let mut ended = held.swap_remove(rng.random_range(0..held.len()));
                    ended.job.end(JobState::Succeeded);
                    assert!(store.settle(ended.claim, &mut ended.job).await.unwrap());
                    model.running.retain(|job| job.id != ended.job.id);
                }
            }
        }
        while let Some(claimed) = store.claim("somebody", LEASE).await.unwrap() {
            assert_eq!(Some(claimed.claim.id), model.claim(), "seed {seed}");
        }
        assert!(model.waiting.is_empty());
        store.close().await;
    }
}

/// Who posts a single job waits for one job of another at most, however many that one has posted before.
async fn many_jobs_of_one_caller_do_not_hold_up_another(place: Place) {
    let store = place.open().await;
    for _ in 0..10 {
        post(&store, "busy", 0).await;
    }
    let mut first = store.claim("worker", LEASE).await.unwrap().unwrap();
    let modest = post(&store, "modest", 0).await;
    first.job.end(JobState::Succeeded);
    assert!(store.settle(first.claim, &mut first.job).await.unwrap());
    assert_eq!(store.claim("worker", LEASE).await.unwrap().unwrap().job.id, modest.id);
}
