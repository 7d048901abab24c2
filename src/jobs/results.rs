//! What jobs leave behind, and how they are while they run.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use uuid::Uuid;

use super::error::ServiceError;
use super::files::{Artefact, Recorded, Run, Shelf};
use super::live::Live;
use super::order::read_character;
use super::repertoire::{Repertoire, RepertoireEntry};
use super::service::Jobs;
use crate::export::{ExportFormat, ExportOptions, SampledMotion, animation_name, export, export_repertoire};
use gaitwright_learning::learn::Generation;
use gaitwright_physics::character::Options;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::Motion;

/// A file of a job, by its name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JobFile {
    /// The job.
    pub id: Uuid,
    /// Its name, with that of the folder it is in among the job's.
    name: String,
}

impl JobFile {
    /// An artefact of the job called `id`.
    pub fn artefact(id: Uuid, artefact: Artefact) -> Self {
        Self { id, name: artefact.file_name().to_owned() }
    }

    /// The file with this name of the job called `id` on a shelf.
    pub fn shelved(id: Uuid, shelf: Shelf, name: &str) -> Self {
        Self { id, name: shelf.file_name(name) }
    }

    /// Its name among the job's files.
    pub fn name(&self) -> &str {
        &self.name
    }
}

impl Jobs {
    /// A job's learning curve so far, from generation `first` on.
    ///
    /// # Errors
    ///
    /// When the store fails.
    pub async fn curve(&self, id: Uuid, first: u32) -> Result<Vec<Generation>, ServiceError> {
        match self.live(id) {
            Some(live) => Ok(live.curve_from(first)),
            None => Ok(self.shared().store.curve(id, first).await?),
        }
    }

    /// The job called `id` as it runs, when it does.
    pub fn live(&self, id: Uuid) -> Option<Arc<Live>> {
        self.shared().running.get(id)
    }

    /// A file of a job; of one that runs here also what there is of it so far in memory alone. `None` when there is none (yet).
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    pub async fn read(&self, file: &JobFile) -> Result<Option<Vec<u8>>, ServiceError> {
        let kept = self.shared().files.read(self.run(file.id).await?, &file.name).await?;
        Ok(kept.or_else(|| self.live(file.id)?.shown(&file.name)))
    }

    /// The recording of a run, as far as it is there; `None` when there is none (yet).
    ///
    /// # Errors
    ///
    /// When it cannot be looked for.
    pub async fn recording(&self, run: Run) -> Result<Option<Recorded>, ServiceError> {
        Ok(self.shared().files.recording(run).await?)
    }

    /// Where the recording of the job called `id` lies, or will lie, if it is a file.
    pub fn recording_file(&self, id: Uuid) -> Option<PathBuf> {
        self.shared().files.recording_file(id)
    }

    /// The motions that the job called `id` has learned; `None` when there are none (yet).
    ///
    /// # Errors
    ///
    /// When the file that is there cannot be read.
    pub async fn repertoire(&self, id: Uuid) -> Result<Option<Repertoire>, ServiceError> {
        match self.read(&JobFile::artefact(id, Artefact::Motions)).await? {
            Some(bytes) => Ok(Some(serde_json::from_slice(&bytes).map_err(io::Error::from)?)),
            None => Ok(None),
        }
    }

    /// The motion document `file` in a format that other programs open; `None` when there is none (yet).
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::Input`] when the format cannot hold what is asked for.
    pub async fn exported(
        &self,
        file: &JobFile,
        format: ExportFormat,
        options: ExportOptions,
    ) -> Result<Option<Vec<u8>>, ServiceError> {
        let Some(motion) = self.read(file).await? else { return Ok(None) };
        let character =
            self.shared().store.job_input(file.id).await?.ok_or(ServiceError::UnknownJob(file.id))?;
        self.compute(move |_| {
            let motion = Motion::parse(&motion)?;
            let reading = read_character(&character, None, Options::default())?;
            Ok(Some(export(&motion, &reading.character, format, &options)?.file))
        })
        .await
    }

    /// All motions of a job's repertoire in one glTF binary; `None` when there are none (yet).
    ///
    /// # Errors
    ///
    /// [`ServiceError::UnknownJob`]; [`ServiceError::Input`] when the rate of frames cannot be used.
    pub async fn exported_repertoire(
        &self,
        id: Uuid,
        options: ExportOptions,
    ) -> Result<Option<Vec<u8>>, ServiceError> {
        let Some(repertoire) = self.repertoire(id).await? else { return Ok(None) };
        if repertoire.motions.is_empty() {
            return Ok(None);
        }
        let mut motions = Vec::with_capacity(repertoire.motions.len());
        for RepertoireEntry { file, .. } in repertoire.motions {
            let Some(motion) = self.read(&JobFile::shelved(id, Shelf::Motions, &file)).await? else {
                return Ok(None);
            };
            motions.push((animation_name(&file), motion));
        }
        let character = self.shared().store.job_input(id).await?.ok_or(ServiceError::UnknownJob(id))?;
        self.compute(move |_| {
            let reading = read_character(&character, None, Options::default())?;
            let sampled = motions.into_iter().map(|(name, motion)| {
                let motion = Motion::parse(&motion)?;
                Ok(SampledMotion::new(&motion, &reading.character, options.fps)?.named(name))
            });
            let sampled = sampled.collect::<Result<Vec<_>, InputError>>()?;
            Ok(Some(export_repertoire(&sampled, options.in_place)?))
        })
        .await
    }
}
