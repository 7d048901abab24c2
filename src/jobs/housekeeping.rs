//! Housekeeping: what is kept too long, too often or too large goes, and says so before.

use std::collections::BTreeMap;
use std::time::Duration;

use jiff::Timestamp;
use uuid::Uuid;

use super::error::ServiceError;
use super::files::Run;
use super::job::Job;
use super::retention::{Expiry, KeptThing, Upkeep};
use super::service::{Jobs, Shared};
use super::store::{Amendment, StoredJob};

/// Longest time between two rounds.
const LONGEST_PAUSE: Duration = Duration::from_secs(60);

/// Shortest time between two rounds, however much happens.
const SHORTEST_PAUSE: Duration = Duration::from_secs(1);

/// Things read at once.
const PAGE: u32 = 500;

/// Keeps house until the service shuts down.
pub(super) async fn keep_house(jobs: Jobs) {
    if let Err(error) = jobs.sweep().await {
        tracing::error!(%error, "files of jobs that are gone could not be removed");
    }
    let mut changes = jobs.changes();
    let limits = jobs.shared().retention;
    if ![limits.jobs, limits.recordings, limits.characters].iter().any(|limits| limits.is_limited()) {
        return;
    }
    loop {
        if let Err(error) = jobs.tidy(Timestamp::now()).await {
            tracing::error!(%error, "housekeeping broke off");
        }
        tokio::select! {
            () = jobs.shutdown().cancelled() => return,
            () = tokio::time::sleep(SHORTEST_PAUSE) => {}
        }
        tokio::select! {
            () = jobs.shutdown().cancelled() => return,
            () = changes.any() => {}
            () = tokio::time::sleep(LONGEST_PAUSE) => {}
        }
    }
}

impl Jobs {
    /// Goes through everything that is kept, once.
    ///
    /// # Errors
    ///
    /// When the store fails. What was done by then stays done.
    pub async fn tidy(&self, now: Timestamp) -> Result<(), ServiceError> {
        let limits = self.shared().retention;
        if limits.jobs.is_limited() || limits.recordings.is_limited() {
            self.tidy_jobs(now).await?;
        }
        if limits.characters.is_limited() {
            self.tidy_characters(now).await?;
        }
        Ok(())
    }

    /// Removes the files of jobs that were deleted and have some left. Those of jobs that the store has never heard of stay: the store
    /// may be another than the one that they were made with.
    async fn sweep(&self) -> Result<(), ServiceError> {
        let Shared { files, store, .. } = &**self.shared();
        for id in store.deleted().await? {
            // One that cannot be removed now is no reason to leave the others; it is tried again at the next start.
            match files.remove(id).await {
                Ok(()) => store.forget(id).await?,
                Err(error) => {
                    tracing::error!(%id, %error, "files of a job that is gone could not be removed")
                }
            }
        }
        // In this order: a job is known before it has files.
        let with_files = files.jobs().await?;
        let known = store.ids().await?;
        // Others may have deleted jobs in the meantime.
        let deleted = store.deleted().await?;
        let count = with_files.iter().filter(|id| !known.contains(id) && !deleted.contains(id)).count();
        if count > 0 {
            tracing::warn!(
                count,
                "there are files of jobs that this store does not know; they stay as they are"
            );
        }
        Ok(())
    }

    async fn tidy_jobs(&self, now: Timestamp) -> Result<(), ServiceError> {
        let limits = self.shared().retention;
        let mut ended = BTreeMap::new();
        let mut after = None;
        loop {
            let page = self.list(None, after, PAGE).await?;
            let Some(last) = page.last() else { break };
            after = Some(last.id());
            for job in page {
                if let StoredJob::Readable(job) = job
                    && job.state.is_final()
                {
                    ended.insert(job.id, self.measured(*job).await?);
                }
            }
        }
        let thing = |job: &Job, bytes: u64, told: &Option<Expiry>| KeptThing {
            id: job.id,
            since: job.timings.ended.unwrap_or(job.timings.created),
            bytes,
            told: told.clone(),
        };
        let all = ended.values().map(|job| thing(job, job.storage.bytes, &job.storage.expires));
        for upkeep in limits.jobs.plan(all.collect(), limits.notice, now) {
            match upkeep {
                Upkeep::Remove(id) => {
                    tracing::info!(%id, "removed, as it was told");
                    gone(self.delete(id).await)?;
                    ended.remove(&id);
                }
                Upkeep::Tell(id, expiry) => {
                    self.tell(&mut ended, id, |job| job.storage.expires = expiry).await?;
                }
            }
        }
        let recorded = ended.values().filter(|job| job.storage.recording_bytes > 0);
        let (removed, kept): (Vec<&Job>, Vec<&Job>) =
            recorded.partition(|job| job.storage.recording_removed.is_some());
        let recordings = kept
            .into_iter()
            .map(|job| thing(job, job.storage.recording_bytes, &job.storage.recording_expires))
            .collect();
        // A round before broke off.
        for id in removed.into_iter().map(|job| job.id).collect::<Vec<_>>() {
            let run = self.run(id).await?;
            self.remove_recording(&mut ended, run).await?;
        }
        for upkeep in limits.recordings.plan(recordings, limits.notice, now) {
            match upkeep {
                Upkeep::Remove(id) => {
                    tracing::info!(%id, "its recording is removed, as it was told");
                    let told = |job: &mut Job| {
                        job.storage.recording_expires = None;
                        job.storage.recording_removed = Some(now);
                    };
                    // Which one it is, before it is known that no other run has begun.
                    let run = self.run(id).await?;
                    if self.tell(&mut ended, id, told).await? {
                        self.remove_recording(&mut ended, run).await?;
                    }
                }
                Upkeep::Tell(id, expiry) => {
                    self.tell(&mut ended, id, |job| job.storage.recording_expires = expiry).await?;
                }
            }
        }
        Ok(())
    }

    async fn tidy_characters(&self, now: Timestamp) -> Result<(), ServiceError> {
        let limits = self.shared().retention;
        let mut things = Vec::new();
        let mut after = None;
        loop {
            let page = self.characters(after, PAGE).await?;
            let Some(last) = page.last() else { break };
            after = Some(last.id);
            things.extend(page.into_iter().map(|character| KeptThing {
                id: character.id,
                since: character.used,
                bytes: character.bytes,
                told: character.expires,
            }));
        }
        for upkeep in limits.characters.plan(things, limits.notice, now) {
            match upkeep {
                Upkeep::Remove(id) => match self.delete_character(id).await {
                    // It goes in a later round.
                    Err(ServiceError::CharacterNeeded { .. }) => {}
                    other => {
                        tracing::info!(%id, "the character is removed, as it was told");
                        gone(other)?;
                    }
                },
                Upkeep::Tell(id, expiry) => {
                    self.shared().store.tell_character(id, expiry.as_ref()).await?;
                }
            }
        }
        Ok(())
    }

    /// Removes a recording whose record says that it is, and then the bytes from the record: a job never has less than it says, and as
    /// long as bytes stand there, the next round tries again.
    async fn remove_recording(&self, ended: &mut BTreeMap<Uuid, Job>, run: Run) -> Result<(), ServiceError> {
        self.shared().files.remove_recording(run).await?;
        let told = |job: &mut Job| {
            let storage = &mut job.storage;
            storage.bytes = storage.bytes.saturating_sub(storage.recording_bytes);
            storage.recording_bytes = 0;
        };
        self.tell(ended, run.id, told).await?;
        Ok(())
    }

    /// Writes a change of the record of a job that has ended, unless it has been tried again in the meantime; whether it did.
    async fn tell(
        &self,
        ended: &mut BTreeMap<Uuid, Job>,
        id: Uuid,
        change: impl FnOnce(&mut Job),
    ) -> Result<bool, ServiceError> {
        let measured = ended.get(&id).map(|job| job.storage.clone());
        let change = |job: &mut Job| {
            if !job.state.is_final() {
                return Ok::<_, ServiceError>(Amendment::Nothing);
            }
            if let Some(measured) = measured.filter(|_| job.storage.bytes == 0) {
                job.storage = measured;
            }
            change(job);
            Ok(Amendment::Record)
        };
        match self.shared().store.amend(id, change).await? {
            Some(job) if job.state.is_final() => {
                ended.insert(id, job);
                Ok(true)
            }
            _ => {
                ended.remove(&id);
                Ok(false)
            }
        }
    }

    /// A job with the size of its files, which older versions have not noted, nor workers that were lost. One that never began has none.
    async fn measured(&self, mut job: Job) -> Result<Job, ServiceError> {
        if job.storage.bytes == 0 && job.timings.started.is_some() {
            let measured = self.shared().files.storage(self.run(job.id).await?).await?;
            job.storage.bytes = measured.bytes;
            job.storage.recording_bytes = measured.recording_bytes;
        }
        Ok(job)
    }
}

/// Takes what somebody else has deleted in the meantime as deleted.
fn gone(outcome: Result<(), ServiceError>) -> Result<(), ServiceError> {
    match outcome {
        Err(
            ServiceError::UnknownJob(_) | ServiceError::UnknownCharacter(_) | ServiceError::WrongState { .. },
        ) => Ok(()),
        other => other,
    }
}
