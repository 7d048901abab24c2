//! What jobs leave behind, and how they are while they run.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use uuid::Uuid;

use super::error::ServiceError;
use super::files::{Artefact, Shelf};
use super::live::Live;
use super::order::read_character;
use super::repertoire::Repertoire;
use super::service::Jobs;
use crate::export::{ExportFormat, ExportOptions, export};
use gaitwright_learning::learn::Generation;
use gaitwright_physics::character::Options;
use gaitwright_physics::motion::Motion;

impl Jobs {
    /// A job's learning curve so far.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn curve(&self, id: Uuid) -> Result<Vec<Generation>, ServiceError> {
        match self.live(id) {
            Some(live) => Ok(live.curve_from(0)),
            None => Ok(self.shared().store.curve(id).await?),
        }
    }

    /// The job called `id` as it runs, when it does.
    pub fn live(&self, id: Uuid) -> Option<Arc<Live>> {
        self.shared().running.get(id)
    }

    /// Where an artefact of the job called `id` lies, whether or not it is there yet.
    pub fn artefact(&self, id: Uuid, artefact: Artefact) -> PathBuf {
        artefact.path(&self.folder(id))
    }

    /// Where a file with this name of the job called `id` lies on a shelf, whether or not it is there.
    pub fn shelved(&self, id: Uuid, shelf: Shelf, name: &str) -> PathBuf {
        shelf.path(&self.folder(id), name)
    }

    /// The motions that the job called `id` has learned; `None` when there are none (yet).
    ///
    /// # Errors
    ///
    /// When the file that is there cannot be read.
    pub async fn repertoire(&self, id: Uuid) -> Result<Option<Repertoire>, ServiceError> {
        match tokio::fs::read(self.artefact(id, Artefact::Motions)).await {
            Ok(bytes) => Ok(Some(serde_json::from_slice(&bytes).map_err(io::Error::from)?)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// The motion document at `path`, of the job called `id`, in a format that other programs open; `None` when there
    /// is none (yet).
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::Input`] when the format cannot hold what is asked for.
    pub async fn exported(
        &self,
        id: Uuid,
        path: PathBuf,
        format: ExportFormat,
        options: ExportOptions,
    ) -> Result<Option<Vec<u8>>, ServiceError> {
        let motion = match tokio::fs::read(path).await {
            Ok(motion) => motion,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error.into()),
        };
        let character = self.shared().store.job_input(id).await?;
        self.compute(move |_| {
            let motion = Motion::parse(&motion)?;
            let reading = read_character(&character, None, Options::default())?;
            Ok(Some(export(&motion, &reading.character, format, &options)?))
        })
        .await
    }
}
