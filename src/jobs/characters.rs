//! Characters as the service has them: as they were posted, and as they stand.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use uuid::Uuid;

use super::order::read_character;
use super::service::{Jobs, ServiceError};
use super::work::Work;
use crate::export::export_pose;
use gaitwright_physics::character::Options;

impl Jobs {
    /// The bytes of the character called `id`, as they were posted.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownCharacter`].
    pub async fn character_file(&self, id: Uuid) -> Result<Vec<u8>, ServiceError> {
        let kept = self.shared().store.character(id).await?;
        kept.ok_or_else(|| ServiceError::UnknownCharacter(id))
    }

    /// The bytes of the character that the job called `id` works on; `None` of a study, whose character is part of a
    /// scenario.
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`].
    pub async fn job_character(&self, id: Uuid) -> Result<Option<Vec<u8>>, ServiceError> {
        match self.job(id).await?.work {
            Work::Learning(_) => Ok(Some(self.shared().store.job_input(id).await?)),
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
