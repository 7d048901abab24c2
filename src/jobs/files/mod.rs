//! The files of jobs: where they are kept, and how a worker's become the job's.
//!
//! | file | holds |
//! |---|---|
//! | `folder` | what a job leaves, and how it comes to be whole in a folder |
//! | `objects` | the same in an object store, for any number of processes |
//! | `upload` | how it gets there from a worker's folder while the job runs |
//! | `scratch` | the folder of a process for files on their way |
//!
//! A worker writes into a folder. In the data folder that is the job's own, and what is written there is the job's; with
//! an object store it is a scratch folder, from which everything is brought over.

mod folder;
mod objects;
mod scratch;
mod upload;

use std::collections::BTreeSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use tokio::runtime::Handle;
use uuid::Uuid;

use super::job::JobStorage;
use super::places::FilesPlace;
use super::store::Claim;
pub use folder::{Artefact, Shelf};
pub(super) use folder::{Unfinished, storage, sweep_folder, sync, withdraw, withdraw_learned};
use objects::Objects;
pub use objects::{Joined, choose_cryptography};
pub use upload::Upload;

/// Bytes written to see whether files can be: as many as the recording of a short job has.
const PROBE_SIZE: usize = 1 << 20;

/// Where the files of jobs are kept; clones mean the same place.
#[derive(Debug, Clone)]
pub enum JobFiles {
    /// In this data folder.
    Folder(PathBuf),
    /// In an object store.
    Objects(Objects),
}

/// Which run of a job is meant, where runs are kept apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// The job.
    pub id: Uuid,
    /// The number of its worker's claim.
    pub number: i64,
}

impl From<Claim> for Run {
    fn from(claim: Claim) -> Self {
        Self { id: claim.id, number: claim.number() }
    }
}

/// The recording of a job.
#[derive(Debug, Clone)]
pub enum Recorded {
    /// A file.
    File(PathBuf),
    /// In an object store.
    Joined(Joined),
}

impl JobFiles {
    /// The files at `place`, those in the data folder in the folder `data`.
    ///
    /// # Errors
    ///
    /// When a folder cannot be made, or the URL names no store.
    pub(super) fn open(place: &FilesPlace, data: &Path) -> io::Result<Self> {
        match place {
            FilesPlace::Folder => {
                folder::make(data)?;
                Ok(Self::Folder(data.to_owned()))
            }
            FilesPlace::Objects(url) => Ok(Self::Objects(Objects::open(url, data)?)),
        }
    }

    /// The folder that a worker writes a run's files into, and what brings them from there to where they are kept.
    ///
    /// # Errors
    ///
    /// When it cannot be made.
    pub(super) fn work_folder(
        &self,
        run: Run,
        runtime: &Handle,
    ) -> io::Result<(PathBuf, Option<Arc<Upload>>)> {
        match self {
            Self::Folder(data) => Ok((folder::make_folder(data, run.id)?, None)),
            Self::Objects(objects) => {
                let folder = objects.work_folder(run.id, run.number)?;
                let upload = Upload::start(objects.clone(), (run.id, run.number), folder.clone(), runtime);
                Ok((folder, Some(upload)))
            }
        }
    }

    /// A file of a run, by its name and that of the folder it is in; `None` where there is none.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    pub(super) async fn read(&self, run: Run, name: &str) -> io::Result<Option<Vec<u8>>> {
        match self {
            Self::Folder(data) => match tokio::fs::read(folder::folder(data, run.id).join(name)).await {
                Ok(bytes) => Ok(Some(bytes)),
                Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
                Err(error) => Err(error),
            },
            Self::Objects(objects) => objects.read(run.id, run.number, name).await,
        }
    }

    /// The newest checkpoint of a job, whichever run has written it.
    ///
    /// # Errors
    ///
    /// When it cannot be read.
    pub(super) async fn checkpoint(&self, id: Uuid) -> io::Result<Option<Vec<u8>>> {
        match self {
            Self::Folder(_) => self.read(Run { id, number: 0 }, Artefact::Checkpoint.file_name()).await,
            Self::Objects(objects) => objects.checkpoint(id).await,
        }
    }

    /// Where the recording of a job lies, or will lie, if it is a file.
    pub(super) fn recording_file(&self, id: Uuid) -> Option<PathBuf> {
        match self {
            Self::Folder(data) => Some(Artefact::Recording.path(&folder::folder(data, id))),
            Self::Objects(_) => None,
        }
    }

    /// The recording of a run, as far as it is there; `None` where there is none.
    ///
    /// # Errors
    ///
    /// When it cannot be looked for.
    pub(super) async fn recording(&self, run: Run) -> io::Result<Option<Recorded>> {
        match self {
            Self::Folder(data) => {
                let path = Artefact::Recording.path(&folder::folder(data, run.id));
                let there = tokio::fs::try_exists(&path).await.unwrap_or(false);
                Ok(there.then_some(Recorded::File(path)))
            }
            Self::Objects(objects) => Ok(objects.recording(run.id, run.number).await?.map(Recorded::Joined)),
        }
    }

    /// What the files of a run take up.
    ///
    /// # Errors
    ///
    /// When they cannot be looked for.
    pub(super) async fn storage(&self, run: Run) -> io::Result<JobStorage> {
        match self {
            Self::Folder(data) => Ok(storage(&folder::folder(data, run.id))),
            Self::Objects(objects) => objects.storage(run.id, run.number).await,
        }
    }

    /// Removes every file of a job.
    ///
    /// # Errors
    ///
    /// When one cannot be removed.
    pub(super) async fn remove(&self, id: Uuid) -> io::Result<()> {
        match self {
            Self::Folder(data) => match tokio::fs::remove_dir_all(folder::folder(data, id)).await {
                Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
                _ => Ok(()),
            },
            Self::Objects(objects) => objects.remove(id).await,
        }
    }

    /// Removes the recording of a run, with those of the runs before it.
    ///
    /// # Errors
    ///
    /// When it cannot be removed.
    pub(super) async fn remove_recording(&self, run: Run) -> io::Result<()> {
        match self {
            Self::Folder(data) => Artefact::Recording.remove(&folder::folder(data, run.id)),
            Self::Objects(objects) => objects.remove_recordings(run.id, run.number).await,
        }
    }

    /// Sees whether files can be written, by writing one.
    ///
    /// # Errors
    ///
    /// When they cannot.
    pub(super) async fn probe(&self) -> io::Result<()> {
        match self {
            Self::Folder(data) => {
                let data = data.clone();
                let write = move || {
                    let mut file = folder::probe(&data)?;
                    file.write_all(&vec![0; PROBE_SIZE])?;
                    file.as_file().sync_all()
                };
                tokio::task::spawn_blocking(write).await?
            }
            Self::Objects(objects) => objects.probe().await,
        }
    }

    /// The jobs that have files.
    ///
    /// # Errors
    ///
    /// When they cannot be looked for.
    pub(super) async fn jobs(&self) -> io::Result<BTreeSet<Uuid>> {
        match self {
            Self::Folder(data) => folder::jobs(data),
            Self::Objects(objects) => objects.jobs().await,
        }
    }

    /// Removes what processes that were killed have left in the data folder: files without a lasting name.
    ///
    /// # Errors
    ///
    /// When the folder cannot be read.
    pub(super) fn sweep(&self) -> io::Result<()> {
        match self {
            Self::Folder(data) => folder::sweep(data),
            Self::Objects(_) => Ok(()),
        }
    }
}
