//! Records of other versions, and damaged ones.

use std::path::Path;

use gaitwright::jobs::{
    Holding, JobState, Jobs, Reclaimed, ServiceError, ServiceOptions, Store, StoreError, StoredJob,
};
use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, SqliteConnection};
use tempfile::TempDir;
use tokio_util::sync::CancellationToken;

use super::post;

/// What `gaitwright serve` had left before there were claims: jobs in every state and a character, by `sqlite3 .dump`.
const OLD: &str = include_str!("store_before_claims.sql");

async fn database(data: &Path) -> SqliteConnection {
    let options = SqliteConnectOptions::new().filename(data.join("gaitwright.db")).create_if_missing(true);
    options.connect().await.unwrap()
}

async fn execute(data: &Path, statements: &'static str) {
    let mut connection = database(data).await;
    sqlx::raw_sql(statements).execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
}

async fn open(data: &Path) -> Jobs {
    Jobs::open(ServiceOptions::new(data.to_owned()), CancellationToken::new()).await.unwrap()
}

#[tokio::test]
async fn a_data_folder_of_an_older_version_opens() {
    let data = TempDir::new().unwrap();
    execute(data.path(), OLD).await;
    let jobs = open(data.path()).await;
    let list = jobs.list(None, None, 100).await.unwrap();
    let mut states = Vec::new();
    for job in &list {
        let StoredJob::Readable(job) = job else { panic!("{job:?}") };
        assert_eq!((job.caller.as_str(), job.attempts), ("", 0));
        assert_eq!(job.priority, gaitwright::jobs::Priority::default());
        states.push(job.state);
    }
    // The newest first; the second has been running, and waits again.
    assert_eq!(
        states,
        [JobState::Cancelled, JobState::Queued, JobState::Queued, JobState::Failed, JobState::Succeeded]
    );
    let StoredJob::Readable(succeeded) = &list[4] else { unreachable!() };
    assert_eq!(jobs.curve(succeeded.id, 0).await.unwrap().len(), 2);
    let gaitwright::jobs::Work::Learning(learned) = &succeeded.work else { panic!("{succeeded:?}") };
    assert!(learned.metrics.as_ref().unwrap().speed > 0.0);
    let text =
        std::fs::read_to_string(crate::common::repository().join("tests/service/paddler.urdf")).unwrap();
    let (id, _) = jobs.add_character(text.into_bytes(), None).await.unwrap();
    assert!(OLD.contains(&id.to_string()), "the character is known by its old id");
    jobs.close().await;

    // The one that was running comes first.
    let store = Store::open(data.path()).await.unwrap();
    let claimed = store.claim("worker", std::time::Duration::from_secs(60)).await.unwrap().unwrap();
    let StoredJob::Readable(oldest) = &list[2] else { unreachable!() };
    assert_eq!(claimed.job.id, oldest.id);
    assert_eq!(store.renew(claimed.claim, std::time::Duration::from_secs(60)).await.unwrap(), Holding::Held);
}

#[tokio::test]
async fn an_unreadable_record_harms_itself_alone() {
    let data = TempDir::new().unwrap();
    let store = Store::open(data.path()).await.unwrap();
    let mut ids = Vec::new();
    for _ in 0..5 {
        ids.push(post(&store, "", 0).await.id);
    }
    store.close().await;
    let mut connection = database(data.path()).await;
    for (id, change) in [
        // Of a newer version, of a kind that is not known here, and damaged.
        (ids[0], r#"json_set(record, '$.format', 'gaitwright/job@2', '$.state', 'running')"#),
        (ids[1], r#"json_set(record, '$.kind', 'weaving')"#),
        (ids[3], r#"json_remove(record, '$.timings')"#),
    ] {
        let statement = format!("UPDATE jobs SET record = {change} WHERE id = ?");
        let change = sqlx::query(sqlx::AssertSqlSafe(statement)).bind(id.to_string());
        assert_eq!(change.execute(&mut connection).await.unwrap().rows_affected(), 1);
    }
    connection.close().await.unwrap();

    let jobs = open(data.path()).await;
    // A worker of that version is at it.
    execute(data.path(), "UPDATE jobs SET lease_until = 1e15 WHERE state = 'running'").await;
    let list = jobs.list(None, None, 100).await.unwrap();
    let unreadable: Vec<_> = list
        .iter()
        .filter_map(|job| match job {
            StoredJob::Readable(_) => None,
            StoredJob::Unreadable { id, reason } => Some((*id, reason.as_str())),
        })
        .collect();
    assert_eq!(unreadable.iter().map(|(id, _)| *id).collect::<Vec<_>>(), [ids[3], ids[1], ids[0]]);
    assert!(unreadable[0].1.contains("timings") && unreadable[1].1.contains("weaving"));
    assert!(unreadable[2].1.contains("gaitwright/job@2"));
    for id in [ids[0], ids[1], ids[3]] {
        for refused in [jobs.job(id).await, jobs.cancel(id).await, jobs.retry(id).await] {
            let error = refused.unwrap_err();
            assert!(matches!(error, ServiceError::Store(StoreError::Unreadable { .. })), "{error:?}");
        }
    }
    let error = jobs.delete(ids[0]).await.unwrap_err();
    assert!(matches!(error, ServiceError::Store(StoreError::Unreadable { .. })), "{error:?}");
    // Until its lease is over.
    execute(data.path(), "UPDATE jobs SET lease_until = 0 WHERE state = 'running'").await;
    jobs.delete(ids[0]).await.unwrap();
    jobs.cancel(ids[2]).await.unwrap();
    std::fs::create_dir_all(data.path().join("jobs").join(ids[3].to_string())).unwrap();
    jobs.delete(ids[3]).await.unwrap();
    assert!(matches!(jobs.job(ids[3]).await, Err(ServiceError::UnknownJob(_))));
    jobs.close().await;

    // The queue goes on.
    let store = Store::open(data.path()).await.unwrap();
    let claimed = store.claim("worker", std::time::Duration::ZERO).await.unwrap().unwrap();
    assert_eq!(claimed.job.id, ids[4]);
    assert!(store.claim("worker", std::time::Duration::ZERO).await.unwrap().is_none());
    assert_eq!(store.reclaim(Reclaimed::All, "gone").await.unwrap().len(), 1);
}

#[tokio::test]
async fn a_database_of_a_newer_version_is_refused() {
    let data = TempDir::new().unwrap();
    Store::open(data.path()).await.unwrap().close().await;
    execute(
        data.path(),
        "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time)
         VALUES (9999, 'from the future', 1, x'00', 0)",
    )
    .await;
    let error = Store::open(data.path()).await.unwrap_err().to_string();
    assert!(error.contains("9999"), "{error}");
}
