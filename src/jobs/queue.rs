//! The queue as clients see it: posting, looking, cancelling, trying again, deleting.

use std::sync::Arc;

use uuid::Uuid;

use super::error::ServiceError;
use super::figures;
use super::job::{CharacterName, Job, JobState};
use super::once::{IdempotencyKey, Posting};
use super::order::Order;
use super::request::{CharacterChoice, JobTerms};
use super::service::{Jobs, uninterrupted};
use super::store::{Amendment, StoreError, StoredJob};
use super::study::StudyRequest;
use gaitwright_physics::character::Source;
use gaitwright_physics::fault::InputError;

impl Jobs {
    /// The job that was posted under `key` before, where there is one.
    ///
    /// # Errors
    ///
    /// [`ServiceError::KeyReused`] when it was another request.
    pub async fn posted(&self, key: &IdempotencyKey) -> Result<Option<Job>, ServiceError> {
        match self.shared().store.posted(key).await? {
            Some((_, false)) => Err(ServiceError::KeyReused),
            Some((job, true)) => Ok(Some(job)),
            None => Ok(None),
        }
    }

    /// Queues a job; with a key that has come before, it gives the job of that time.
    ///
    /// # Errors
    ///
    /// [`ServiceError::Input`] with every fault of the character and of what is wanted of it;
    /// [`ServiceError::KeyReused`]; [`ServiceError::Full`]; [`ServiceError::ShuttingDown`].
    pub async fn submit(
        &self,
        character: CharacterChoice,
        terms: JobTerms,
        posting: Posting,
    ) -> Result<Job, ServiceError> {
        let (bytes, source, place) = match character {
            CharacterChoice::Urdf(text) => (text.into_bytes(), Some(Source::Urdf), "/character/urdf"),
            CharacterChoice::Json(fields) => {
                let bytes = serde_json::to_vec(&fields).map_err(StoreError::Document)?;
                (bytes, Some(Source::Json), "/character/json")
            }
            CharacterChoice::Id(id) => {
                let unknown =
                    || InputError::impossible("/character/id", format!("there is no character {id}"));
                let kept = self.shared().store.character(id).await?.ok_or_else(unknown);
                let bytes = InputError::beside(terms.settings.faults(), kept)?;
                self.shared().store.use_character(id).await?;
                (bytes, None, "")
            }
        };
        self.submit_bytes((bytes, source, place), terms, posting).await
    }

    /// Queues a job for a character: its bytes, their form where it is known, and from where on faults of the document
    /// are named.
    ///
    /// # Errors
    ///
    /// As [`Jobs::submit`].
    pub async fn submit_bytes(
        &self,
        (bytes, source, place): (Vec<u8>, Option<Source>, &'static str),
        terms: JobTerms,
        posting: Posting,
    ) -> Result<Job, ServiceError> {
        self.check_not_shutting_down()?;
        let JobTerms { settings, priority } = terms;
        let bytes = Arc::new(bytes);
        let name = {
            let (bytes, settings) = (Arc::clone(&bytes), settings.clone());
            let (threads, budget) = (self.shared().threads(), self.shared().job_memory);
            self.compute(move |given_up| {
                let document = (&bytes[..], source, place);
                let order = Order::read_posted(document, settings, (threads, budget), given_up)?
                    .ok_or(ServiceError::GivenUp)?;
                let character = &order.reading.character;
                Ok(CharacterName { name: character.name.clone(), digest: character.digest.clone() })
            })
            .await?
        };
        let Posting { caller, key } = posting;
        self.queue(Job::queued(name, settings, (caller, priority)), bytes, key).await
    }

    /// Queues a study of what accuracy costs.
    ///
    /// # Errors
    ///
    /// [`ServiceError::Input`] with every fault of the request; [`ServiceError::Full`];
    /// [`ServiceError::ShuttingDown`].
    pub async fn submit_study(&self, bytes: Vec<u8>, posting: Posting) -> Result<Job, ServiceError> {
        self.check_not_shutting_down()?;
        let bytes = Arc::new(bytes);
        let (name, request) = {
            let (bytes, budget) = (Arc::clone(&bytes), self.shared().job_memory);
            self.compute(move |_| {
                let (request, setup) = StudyRequest::parse(&bytes, budget)?;
                let character = &setup.model.character;
                let name = CharacterName { name: character.name.clone(), digest: character.digest.clone() };
                Ok((name, request))
            })
            .await?
        };
        let Posting { caller, key } = posting;
        let whose = (caller, request.priority);
        self.queue(Job::queued(name, request, whose), bytes, key).await
    }

    /// Puts a job that works on `input` into the queue.
    async fn queue(
        &self,
        job: Job,
        input: Arc<Vec<u8>>,
        key: Option<IdempotencyKey>,
    ) -> Result<Job, ServiceError> {
        let jobs = self.clone();
        uninterrupted(async move {
            let room = jobs.shared().room;
            match jobs.shared().store.post(&job, &input, key.as_ref(), room).await? {
                None => {}
                Some((known, true)) => return Ok(known),
                Some((_, false)) => return Err(ServiceError::KeyReused),
            }
            jobs.shared().posted.notify_one();
            figures::posted();
            tracing::info!(job_id = %job.id, character = job.character.name, "queued");
            Ok(job)
        })
        .await
    }

    /// The job called `id`.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`].
    pub async fn job(&self, id: Uuid) -> Result<Job, ServiceError> {
        let mut job = self.shared().store.job(id).await?.ok_or_else(|| ServiceError::UnknownJob(id))?;
        // The record of a running job is written now and then.
        if let Some(live) = self.live(id).filter(|_| job.state == JobState::Running) {
            job.progress.evaluations = live.tried();
        }
        Ok(job)
    }

    /// At most `limit` jobs, the newest first: those older than `after`, in the given state.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn list(
        &self,
        state: Option<JobState>,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<StoredJob>, ServiceError> {
        Ok(self.shared().store.jobs(state, after, limit).await?)
    }

    /// Number of jobs in a state.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn count(&self, state: JobState) -> Result<u64, ServiceError> {
        Ok(self.shared().store.count(state, None).await?)
    }

    /// Cancels a job that waits or runs, and gives it as it then is; the same again changes nothing. A running job
    /// ends within a second of this, on another machine within two, and is not taken up again even if the process ends first.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::WrongState`] when it has ended otherwise.
    pub async fn cancel(&self, id: Uuid) -> Result<Job, ServiceError> {
        let jobs = self.clone();
        uninterrupted(async move {
            let change = |job: &mut Job| match job.state {
                JobState::Queued => {
                    job.call_off();
                    Ok(Amendment::Record)
                }
                JobState::Running => Ok(Amendment::Abandon),
                JobState::Cancelled => Ok(Amendment::Nothing),
                state @ (JobState::Succeeded | JobState::Failed) => {
                    let needs = "only a job that waits or runs can be cancelled";
                    Err(ServiceError::WrongState { id, state, needs })
                }
            };
            let job = jobs.amend(id, change).await?;
            // A worker that has just begun, or is on another machine, learns of it from the store.
            if let Some(live) = jobs.shared().running.get(id) {
                live.abandon();
            }
            jobs.shared().changed(id);
            Ok(job)
        })
        .await
    }

    /// Queues a failed or cancelled job again; it goes on from its last checkpoint.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::WrongState`] when it has neither failed nor been cancelled;
    /// [`ServiceError::Full`]; [`ServiceError::ShuttingDown`].
    pub async fn retry(&self, id: Uuid) -> Result<Job, ServiceError> {
        self.check_not_shutting_down()?;
        let jobs = self.clone();
        uninterrupted(async move {
            let change = |job: &mut Job| {
                check_retriable(job)?;
                job.reopen();
                Ok(Amendment::Requeue(jobs.shared().room))
            };
            let job = jobs.amend(id, change).await?;
            jobs.shared().posted.notify_one();
            jobs.shared().changed(id);
            Ok(job)
        })
        .await
    }

    async fn amend(
        &self,
        id: Uuid,
        change: impl FnOnce(&mut Job) -> Result<Amendment, ServiceError>,
    ) -> Result<Job, ServiceError> {
        self.shared().store.amend(id, change).await?.ok_or_else(|| ServiceError::UnknownJob(id))
    }

    /// Deletes a job that has ended, with its files.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::WrongState`] unless it has ended; [`StoreError::Unreadable`] where a worker
    /// holds it and this version cannot read its record.
    pub async fn delete(&self, id: Uuid) -> Result<(), ServiceError> {
        let jobs = self.clone();
        uninterrupted(async move {
            let may = |job, held| match job {
                StoredJob::Readable(job) if !job.state.is_final() => {
                    let needs = "only a job that has ended can be deleted; cancel it first";
                    Err(ServiceError::WrongState { id, state: job.state, needs })
                }
                // A worker of a version that can read it is at it.
                StoredJob::Unreadable { id, reason } if held => {
                    Err(StoreError::Unreadable { id, reason }.into())
                }
                StoredJob::Readable(_) | StoredJob::Unreadable { .. } => Ok(()),
            };
            if !jobs.shared().store.delete(id, may).await? {
                return Err(ServiceError::UnknownJob(id));
            }
            // Its deletion holds from here on: what cannot be removed now is at the next start.
            if let Err(error) = jobs.shared().files.remove(id).await {
                tracing::warn!(%id, %error, "the files of a deleted job are left over");
            }
            Ok(())
        })
        .await
    }
}

fn check_retriable(job: &Job) -> Result<(), ServiceError> {
    if matches!(job.state, JobState::Failed | JobState::Cancelled) {
        return Ok(());
    }
    let needs = "only a job that failed or was cancelled can be tried again";
    Err(ServiceError::WrongState { id: job.id, state: job.state, needs })
}
