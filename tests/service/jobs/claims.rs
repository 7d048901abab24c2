//! A worker's hold on its job: lease, number, attempts.

use std::sync::Arc;
use std::time::Duration;

use gaitwright::jobs::{Amendment, Holding, Job, JobState, MOST_ATTEMPTS, Reclaimed, Store, StoreError};
use gaitwright_learning::learn::Generation;

use super::{Place, ROOM, post};

const LONG: Duration = Duration::from_secs(3600);

/// A lease that is over as soon as it has begun.
const NONE: Duration = Duration::ZERO;

on_both_databases! {
    an_old_claim_changes_nothing,
    many_workers_take_each_job_once,
    a_job_is_tried_three_times_again,
    only_attempts_in_vain_count,
    an_acknowledged_end_holds,
    an_end_told_twice_undoes_no_retry,
    a_long_curve_is_written_whole,
}

async fn lapse(store: &Store) -> Vec<Job> {
    // A lease of no length is over in the millisecond after its beginning.
    tokio::time::sleep(Duration::from_millis(2)).await;
    store.reclaim(Reclaimed::Lapsed, "no sign of life").await.unwrap()
}

fn point(generation: u32) -> Generation {
    Generation {
        generation,
        gait: None,
        best: 1.0,
        mean: 0.5,
        spread: 0.1,
        cache_hit_rate: 0.0,
        simulated_seconds: 1.0,
        saved_seconds: 0.0,
        elapsed: 1.0,
    }
}

async fn an_old_claim_changes_nothing(place: Place) {
    let store = place.open().await;
    let id = post(&store, "", 0).await.id;
    let mut old = store.claim("first", NONE).await.unwrap().unwrap();
    assert_eq!((old.job.state, old.job.attempts), (JobState::Running, 1));
    assert!(store.record(old.claim, &old.job, &[point(0)]).await.unwrap());
    let back = lapse(&store).await;
    assert_eq!((back.len(), back[0].id, back[0].state), (1, id, JobState::Queued));

    // Before anybody else has it, and after.
    for taken in [false, true] {
        let new = if taken { store.claim("second", LONG).await.unwrap() } else { None };
        assert_eq!(new.is_some(), taken);
        let before = store.job(id).await.unwrap().unwrap();
        assert_eq!(store.renew(old.claim, LONG).await.unwrap(), Holding::Lost);
        old.job.end(JobState::Succeeded);
        assert!(!store.record(old.claim, &old.job, &[point(1)]).await.unwrap());
        assert!(!store.record_afresh(old.claim, &old.job, &[]).await.unwrap());
        assert!(!store.settle(old.claim, &mut old.job).await.unwrap());
        assert_eq!(store.job(id).await.unwrap().unwrap(), before);
        assert_eq!(store.curve(id, 0).await.unwrap(), [point(0)]);
        if let Some(new) = new {
            assert_eq!(new.job.attempts, 2);
            assert_eq!(store.renew(new.claim, LONG).await.unwrap(), Holding::Held);
        }
    }
    assert!(lapse(&store).await.is_empty(), "the new lease is long");
}

/// A worker that does not hear that the end of its job was recorded tells it again.
async fn an_end_told_twice_undoes_no_retry(place: Place) {
    let store = place.open().await;
    let id = post(&store, "", 0).await.id;
    let mut claimed = store.claim("worker", LONG).await.unwrap().unwrap();
    claimed.job.end(JobState::Failed);
    assert!(store.settle(claimed.claim, &mut claimed.job).await.unwrap());
    let reopen = |job: &mut Job| -> Result<Amendment, StoreError> {
        job.reopen();
        Ok(Amendment::Requeue(ROOM))
    };
    store.amend(id, reopen).await.unwrap();
    assert!(!store.settle(claimed.claim, &mut claimed.job).await.unwrap());
    assert_eq!(store.job(id).await.unwrap().unwrap().state, JobState::Queued);
}

/// In several statements, each with many points; what goes on from a checkpoint writes it all.
async fn a_long_curve_is_written_whole(place: Place) {
    let store = place.open().await;
    let id = post(&store, "", 0).await.id;
    let claimed = store.claim("worker", LONG).await.unwrap().unwrap();
    let curve: Vec<Generation> = (0..1203).map(point).collect();
    assert!(store.record(claimed.claim, &claimed.job, &curve).await.unwrap());
    assert_eq!(store.curve(id, 0).await.unwrap(), curve);
    // A point that is there already is replaced.
    let changed = Generation { best: 2.0, ..point(1202) };
    assert!(store.record(claimed.claim, &claimed.job, &[changed.clone(), point(1203)]).await.unwrap());
    assert_eq!(store.curve(id, 1202).await.unwrap(), [changed, point(1203)]);
    assert!(store.record_afresh(claimed.claim, &claimed.job, &curve[..700]).await.unwrap());
    assert_eq!(store.curve(id, 0).await.unwrap(), curve[..700]);
}

async fn many_workers_take_each_job_once(place: Place) {
    let store = Arc::new(place.open().await);
    for number in 0..30 {
        post(&store, &format!("caller {}", number % 3), 0).await;
    }
    // Another process has a connection of its own.
    let other = Arc::new(place.open().await);
    let workers: Vec<_> = (0..8)
        .map(|number| {
            let store = Arc::clone(if number % 2 == 0 { &store } else { &other });
            tokio::spawn(async move {
                let mut taken = Vec::new();
                while let Some(claimed) = store.claim("worker", LONG).await.unwrap() {
                    taken.push(claimed.job.id);
                }
                taken
            })
        })
        .collect();
    let mut taken = Vec::new();
    for worker in workers {
        taken.extend(worker.await.unwrap());
    }
    taken.sort();
    taken.dedup();
    assert_eq!(taken.len(), 30);
    assert_eq!(store.count(JobState::Running, None).await.unwrap(), 30);
}

async fn a_job_is_tried_three_times_again(place: Place) {
    let store = place.open().await;
    let harmful = post(&store, "", 1).await.id;
    let other = post(&store, "", 0).await.id;
    for attempt in 1..=MOST_ATTEMPTS {
        let claimed = store.claim("worker", NONE).await.unwrap().unwrap();
        assert_eq!((claimed.job.id, claimed.job.attempts), (harmful, attempt));
        assert_eq!(lapse(&store).await.len(), 1);
    }
    assert_eq!(MOST_ATTEMPTS, 1 + 3);
    let job = store.job(harmful).await.unwrap().unwrap();
    assert_eq!(job.state, JobState::Failed);
    let error = job.error.unwrap();
    assert!(error.contains("no sign of life") && error.contains("4 times"), "{error}");
    assert!(job.timings.ended.is_some());
    assert_eq!(store.claim("worker", LONG).await.unwrap().unwrap().job.id, other, "the others go on");

    // Tried again by somebody, it has all its attempts again.
    let reopen = |job: &mut Job| -> Result<Amendment, StoreError> {
        job.reopen();
        Ok(Amendment::Requeue(ROOM))
    };
    let job = store.amend(harmful, reopen).await.unwrap().unwrap();
    assert_eq!((job.state, job.attempts, job.error), (JobState::Queued, 0, None));
}

/// An attempt that got further, and a worker that put its job back in order, count for nothing.
async fn only_attempts_in_vain_count(place: Place) {
    let store = place.open().await;
    let id = post(&store, "", 0).await.id;
    for _ in 0..3 * MOST_ATTEMPTS {
        let mut claimed = store.claim("worker", NONE).await.unwrap().unwrap();
        claimed.job.get_further();
        assert!(store.record(claimed.claim, &claimed.job, &[]).await.unwrap());
        lapse(&store).await;
    }
    assert_eq!(store.job(id).await.unwrap().unwrap().attempts, 1);
    for _ in 0..3 * MOST_ATTEMPTS {
        let mut claimed = store.claim("worker", LONG).await.unwrap().unwrap();
        claimed.job.put_back();
        assert!(store.settle(claimed.claim, &mut claimed.job).await.unwrap());
    }
    let job = store.job(id).await.unwrap().unwrap();
    assert_eq!((job.state, job.attempts), (JobState::Queued, 1));
}

/// That somebody has asked for the end of a job holds whatever becomes of its worker.
async fn an_acknowledged_end_holds(place: Place) {
    let store = place.open().await;
    let abandon = |_: &mut Job| -> Result<Amendment, StoreError> { Ok(Amendment::Abandon) };
    for settled in [true, false] {
        let id = post(&store, "", 0).await.id;
        let mut claimed = store.claim("worker", NONE).await.unwrap().unwrap();
        let job = store.amend(id, abandon).await.unwrap().unwrap();
        assert_eq!(job, claimed.job, "the record is the worker's to write");
        if settled {
            assert_eq!(store.renew(claimed.claim, LONG).await.unwrap(), Holding::Unwanted);
            claimed.job.end(JobState::Succeeded);
            assert!(store.settle(claimed.claim, &mut claimed.job).await.unwrap());
            assert_eq!(claimed.job.state, JobState::Cancelled);
        } else {
            assert_eq!(lapse(&store).await[0].state, JobState::Cancelled);
        }
        assert_eq!(store.job(id).await.unwrap().unwrap().state, JobState::Cancelled);
    }
}
