//! Characters as the service has them: kept for later jobs as they were posted, and as they stand.

use std::io;
use std::sync::Arc;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde_json::{Value, json};
use uuid::Uuid;

use super::check::{Findings, check_until};
use super::error::ServiceError;
use super::memory::MemoryEstimate;
use super::order::read_character;
use super::service::{Jobs, uninterrupted};
use super::store::{CharacterDeletion, StoredCharacter};
use super::work::Work;
use crate::export::export_pose;
use gaitwright_physics::character::{Options, Source, without_byte_order_mark};
use gaitwright_physics::fault::InputError;
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
        let findings = self.check_character(Arc::clone(&bytes), source).await?;
        let id = self.shared().store.keep_character(&findings, &bytes).await?;
        Ok((id, findings))
    }

    /// What is found in a posted character.
    async fn check_character(
        &self,
        bytes: Arc<Vec<u8>>,
        source: Option<Source>,
    ) -> Result<Findings, ServiceError> {
        let budget = self.shared().job_memory;
        self.compute(move |given_up| {
            let reading = read_character(&bytes, source, Options::default())?;
            let (character, scene) = (&reading.character, Scene::default());
            MemoryEstimate::of_simulation(character, &scene, &AskedAccuracy::default()).check(budget)?;
            let findings = check_until(&reading, &scene, given_up);
            if given_up() { Err(ServiceError::GivenUp) } else { Ok(findings) }
        })
        .await
    }

    /// What was found in the character called `id`; what another version of this program has noted in a way that this one cannot read
    /// is found anew.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownCharacter`].
    pub async fn findings(&self, id: Uuid) -> Result<Findings, ServiceError> {
        let noted = self.shared().store.findings(id).await?;
        match serde_json::from_str(&noted.ok_or(ServiceError::UnknownCharacter(id))?) {
            Ok(findings) => Ok(findings),
            Err(_) => self.check_character(Arc::new(self.character_file(id).await?), None).await,
        }
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

    /// The bytes of the character called `id`, as they were posted.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownCharacter`].
    pub async fn character_file(&self, id: Uuid) -> Result<Vec<u8>, ServiceError> {
        let kept = self.shared().store.character(id).await?;
        kept.ok_or_else(|| ServiceError::UnknownCharacter(id))
    }

    /// A JSON document with the character in full that it names by an id, as `{"id": "…"}` at `pointer`. Any other is
    /// given back as it is, whatever it holds.
    ///
    /// # Errors
    ///
    /// [`ServiceError::Input`] for an id that is none of a character.
    pub async fn with_character(&self, document: Vec<u8>, pointer: &str) -> Result<Vec<u8>, ServiceError> {
        let place = pointer.to_owned();
        let parsed = self.compute(move |_| Ok(WithNamed::parse(document, &place))).await?;
        let WithNamed { document, whole, id } = parsed;
        let (Some(mut whole), Some(id)) = (whole, id) else { return Ok(document) };
        let unknown =
            || InputError::impossible(format!("{pointer}/id"), format!("there is no character {id}"));
        let id = Uuid::parse_str(&id).map_err(|_| unknown())?;
        let bytes = self.shared().store.character(id).await?.ok_or_else(unknown)?;
        self.shared().store.use_character(id).await?;
        let pointer = pointer.to_owned();
        self.compute(move |_| {
            if let Some(character) = whole.pointer_mut(&pointer) {
                *character = in_full(&bytes)?;
            }
            Ok(serde_json::to_vec(&whole).map_err(io::Error::from)?)
        })
        .await
    }

    /// The bytes of the character that the job called `id` works on; `None` of a study, whose character is part of a
    /// scenario.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`].
    pub async fn job_character(&self, id: Uuid) -> Result<Option<Vec<u8>>, ServiceError> {
        match self.job(id).await?.work {
            Work::Learning(_) => {
                self.shared().store.job_input(id).await?.map(Some).ok_or(ServiceError::UnknownJob(id))
            }
            Work::Accuracy(_) => Ok(None),
        }
    }

    /// The character called `id` in its standing pose, as glTF binary.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownCharacter`]; [`ServiceError::Input`] when it is too large for the format.
    pub async fn standing_character(&self, id: Uuid) -> Result<Vec<u8>, ServiceError> {
        let standing = self.findings(id).await?.standing;
        let bytes = self.character_file(id).await?;
        self.compute(move |_| {
            let reading = read_character(&bytes, None, Options::default())?;
            let [w, x, y, z] = standing.root_orientation;
            let root = Isometry3::from_parts(
                Translation3::new(0.0, 0.0, standing.root_height),
                UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)),
            );
            // What was found by a version that did not tell the settled angles is shown as it was held.
            let angles = if standing.settled.is_empty() { &standing.joints } else { &standing.settled };
            Ok(export_pose(&reading.character, &root, angles)?)
        })
        .await
    }
}

/// A document in which a character may stand by its id alone.
struct WithNamed {
    document: Vec<u8>,
    /// The same, where it is JSON.
    whole: Option<Value>,
    /// What is called the character's id, where it is nothing else.
    id: Option<String>,
}

impl WithNamed {
    /// Reads `document`, whose character is at `pointer`.
    fn parse(document: Vec<u8>, pointer: &str) -> Self {
        let whole: Option<Value> = serde_json::from_slice(&document).ok();
        let character = whole.as_ref().and_then(|whole| whole.pointer(pointer)).and_then(Value::as_object);
        let id = character.filter(|fields| fields.len() == 1).and_then(|fields| fields.get("id"));
        let id = id.and_then(Value::as_str).map(str::to_owned);
        Self { document, whole, id }
    }
}

/// A posted character, as a document holds one.
fn in_full(bytes: &[u8]) -> Result<Value, ServiceError> {
    Ok(match Source::detect(bytes) {
        Some(Source::Json) => {
            let document = without_byte_order_mark(bytes);
            json!({ "json": serde_json::from_slice::<Value>(document).map_err(io::Error::from)? })
        }
        Some(Source::Zip) => json!({ "zip": BASE64_STANDARD.encode(bytes) }),
        Some(Source::Urdf) | None => json!({ "urdf": String::from_utf8_lossy(bytes) }),
    })
}
