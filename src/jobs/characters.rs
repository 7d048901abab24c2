//! Characters kept for later jobs.

use std::sync::Arc;

use uuid::Uuid;

use super::check::{Findings, check_until};
use super::error::ServiceError;
use super::memory::MemoryEstimate;
use super::order::read_character;
use super::service::{Jobs, uninterrupted};
use super::store::{CharacterDeletion, StoredCharacter};
use gaitwright_physics::character::{Options, Source};
use gaitwright_physics::scene::{AskedAccuracy, Scene};

impl Jobs {
    /// Keeps a character for later jobs, and gives its id and what was found in it.
    ///
    /// # Errors
    ///
    /// [`ServiceError::Input`] with every fault of the character.
    pub async fn add_character(
        &self,
        bytes: Vec<u8>,
        source: Option<Source>,
    ) -> Result<(Uuid, Findings), ServiceError> {
        self.check_not_shutting_down()?;
        let bytes = Arc::new(bytes);
        let findings = {
            let (bytes, budget) = (Arc::clone(&bytes), self.shared().job_memory);
            self.compute(move |given_up| {
                let reading = read_character(&bytes, source, Options::default())?;
                let (character, scene) = (&reading.character, Scene::default());
                MemoryEstimate::of_simulation(character, &scene, &AskedAccuracy::default()).check(budget)?;
                let findings = check_until(&reading, &Scene::default(), given_up);
                if given_up() { Err(ServiceError::GivenUp) } else { Ok(findings) }
            })
            .await?
        };
        let id = self.shared().store.keep_character(&findings, &bytes).await?;
        Ok((id, findings))
    }

    /// What was found in the character called `id`.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownCharacter`].
    pub async fn findings(&self, id: Uuid) -> Result<Findings, ServiceError> {
        self.shared().store.findings(id).await?.ok_or_else(|| ServiceError::UnknownCharacter(id))
    }

    /// At most `limit` characters, the newest first: those older than `after`.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn characters(
        &self,
        after: Option<Uuid>,
        limit: u32,
    ) -> Result<Vec<StoredCharacter>, ServiceError> {
        Ok(self.shared().store.characters(after, limit).await?)
    }

    /// Deletes a character. Jobs that have ended keep what they were posted with.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownCharacter`]; [`ServiceError::CharacterNeeded`].
    pub async fn delete_character(&self, id: Uuid) -> Result<(), ServiceError> {
        let jobs = self.clone();
        uninterrupted(async move {
            match jobs.shared().store.delete_character(id).await? {
                CharacterDeletion::Deleted => Ok(()),
                CharacterDeletion::Unknown => Err(ServiceError::UnknownCharacter(id)),
                CharacterDeletion::Needed(job) => Err(ServiceError::CharacterNeeded { id, job }),
            }
        })
        .await
    }
}
