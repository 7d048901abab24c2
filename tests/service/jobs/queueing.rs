//! How jobs come into the queue: no more than there is room for, and once for every key, whoever posts them at once.

use std::collections::BTreeSet;

use gaitwright::jobs::{Amendment, CharacterDeletion, IdempotencyKey, Job, JobState, QueueRoom, StoreError};

use super::{Place, ROOM, post, waiting};

on_both_databases! {
    no_more_wait_than_there_is_room_for,
    one_key_is_one_job,
    a_job_is_tried_again_where_there_is_room,
    jobs_are_listed_and_counted,
    characters_are_kept,
}

async fn no_more_wait_than_there_is_room_for(place: Place) {
    let stores = [place.open().await, place.open().await];
    let room = QueueRoom { all: 10, caller: 4 };
    let posts: Vec<_> = (0..60)
        .map(|number| {
            let store = stores[number % 2].clone();
            tokio::spawn(async move {
                let caller = format!("caller {}", number % 3);
                store.post(&waiting(&caller, 0), b"input", None, room).await
            })
        })
        .collect();
    let (mut accepted, mut full) = (0, 0);
    for posted in posts {
        match posted.await.unwrap() {
            Ok(None) => accepted += 1,
            Err(StoreError::Full(10) | StoreError::FullForCaller(4)) => full += 1,
            // One at a time writes into a file, and who waits too long is told so.
            Err(StoreError::Busy) => full += 1,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!((accepted, accepted + full), (10, 60));
    for caller in 0..3 {
        let waiting = stores[0].count(JobState::Queued, Some(&format!("caller {caller}"))).await.unwrap();
        assert!(waiting <= 4, "{waiting}");
    }
}

async fn one_key_is_one_job(place: Place) {
    let stores = [place.open().await, place.open().await];
    let key = |request: &[u8]| IdempotencyKey::new(b"key", &[request]).unwrap();
    let posts: Vec<_> = (0..12)
        .map(|number| {
            let (store, key) = (stores[number % 2].clone(), key(b"one"));
            tokio::spawn(async move {
                let job = waiting("", 0);
                match store.post(&job, b"input", Some(&key), ROOM).await.unwrap() {
                    None => job.id,
                    Some((known, same)) => {
                        assert!(same);
                        known.id
                    }
                }
            })
        })
        .collect();
    let mut ids = BTreeSet::new();
    for posted in posts {
        ids.insert(posted.await.unwrap());
    }
    assert_eq!(ids.len(), 1);
    let other = stores[0].post(&waiting("", 0), b"input", Some(&key(b"two")), ROOM).await.unwrap();
    assert_eq!(other.map(|(job, same)| (ids.contains(&job.id), same)), Some((true, false)));
    // A full queue does not hide it.
    let none = QueueRoom { all: 0, caller: 0 };
    assert!(stores[1].post(&waiting("", 0), b"input", Some(&key(b"one")), none).await.unwrap().is_some());
    assert_eq!(stores[1].count(JobState::Queued, None).await.unwrap(), 1);
}

async fn a_job_is_tried_again_where_there_is_room(place: Place) {
    let store = place.open().await;
    let job = post(&store, "somebody", 0).await;
    let call_off = |job: &mut Job| -> Result<Amendment, StoreError> {
        job.call_off();
        Ok(Amendment::Record)
    };
    store.amend(job.id, call_off).await.unwrap();
    let reopen = |room| {
        move |job: &mut Job| -> Result<Amendment, StoreError> {
            job.reopen();
            Ok(Amendment::Requeue(room))
        }
    };
    let full = store.amend(job.id, reopen(QueueRoom { all: 5, caller: 0 })).await;
    assert!(matches!(full, Err(StoreError::FullForCaller(0))), "{full:?}");
    assert_eq!(store.job(job.id).await.unwrap().unwrap().state, JobState::Cancelled);
    let again = store.amend(job.id, reopen(ROOM)).await.unwrap().unwrap();
    assert_eq!((again.state, store.count(JobState::Queued, None).await.unwrap()), (JobState::Queued, 1));
}

async fn jobs_are_listed_and_counted(place: Place) {
    let store = place.open().await;
    let mut ids = Vec::new();
    for number in 0..7 {
        ids.push(post(&store, "", number % 3 - 1).await.id);
    }
    let lease = std::time::Duration::from_secs(60);
    let running = store.claim("worker", lease).await.unwrap().unwrap().job.id;
    assert_eq!(running, ids[2], "the first of the most urgent");
    let listed = |state, after, limit| {
        let store = &store;
        async move {
            let jobs = store.jobs(state, after, limit).await.unwrap();
            jobs.iter().map(|job| job.id()).collect::<Vec<_>>()
        }
    };
    let newest: Vec<_> = ids.iter().rev().copied().collect();
    assert_eq!(listed(None, None, 3).await, newest[..3]);
    assert_eq!(listed(None, Some(newest[2]), 100).await, newest[3..]);
    assert_eq!(listed(Some(JobState::Running), None, 100).await, [running]);
    assert_eq!(listed(Some(JobState::Queued), Some(running), 100).await, [ids[1], ids[0]]);
    assert_eq!(store.count(JobState::Queued, None).await.unwrap(), 6);
    assert_eq!(store.ids().await.unwrap(), ids.iter().copied().collect());
    assert_eq!(store.job_input(ids[0]).await.unwrap().unwrap(), b"input");
    let may = |_: gaitwright::jobs::StoredJob, _: bool| Ok::<_, StoreError>(());
    assert!(store.delete(ids[0], may).await.unwrap());
    assert!(!store.delete(ids[0], may).await.unwrap());
    assert!(store.job(ids[0]).await.unwrap().is_none());
}

async fn characters_are_kept(place: Place) {
    let store = place.open().await;
    let text = include_bytes!("../paddler.urdf");
    let reading = gaitwright::jobs::read_character(text, None, Default::default()).unwrap();
    let findings = gaitwright::jobs::check(&reading, &Default::default());
    let id = store.keep_character(&findings, text).await.unwrap();
    assert_eq!(store.keep_character(&findings, text).await.unwrap(), id, "the same bytes keep their id");
    assert_eq!(store.character(id).await.unwrap().unwrap(), text);
    let noted = store.findings(id).await.unwrap().unwrap();
    assert_eq!(serde_json::from_str::<gaitwright::jobs::Findings>(&noted).unwrap(), findings);
    let kept = &store.characters(None, 10).await.unwrap()[0];
    assert_eq!((kept.bytes, kept.name.as_deref()), (text.len() as u64, Some(findings.name.as_str())));
    assert!(kept.used <= jiff::Timestamp::now() && kept.expires.is_none());
    // One that a job needs stays.
    let mut job = waiting("", 0);
    job.character.digest.clone_from(&findings.digest);
    assert!(store.post(&job, text, None, ROOM).await.unwrap().is_none());
    assert_eq!(store.delete_character(id).await.unwrap(), CharacterDeletion::Needed(job.id));
    let may = |_: gaitwright::jobs::StoredJob, _: bool| Ok::<_, StoreError>(());
    store.delete(job.id, may).await.unwrap();
    assert_eq!(store.delete_character(id).await.unwrap(), CharacterDeletion::Deleted);
    assert_eq!(store.delete_character(id).await.unwrap(), CharacterDeletion::Unknown);
}
