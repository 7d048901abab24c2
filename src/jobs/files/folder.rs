//! Where a job's files lie, and how they come to be there whole.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use uuid::Uuid;

use crate::jobs::job::JobStorage;
use crate::jobs::repertoire::Repertoire;

/// Folder of the jobs' folders.
const JOBS: &str = "jobs";

/// How the names of files begin that have no lasting name yet.
const UNFINISHED: &str = ".gaitwright-unfinished";

/// How the names of files begin that are written to see whether files can be.
const PROBE: &str = ".gaitwright-probe";

/// What a job leaves behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Artefact {
    /// The recording, which grows while the job runs.
    Recording,
    /// The motion document.
    Motion,
    /// Everything about the job and what came of it.
    Report,
    /// The gait report.
    Gait,
    /// The learning curve.
    Curve,
    /// The gait diagram.
    Diagram,
    /// The table of a study, as JSON.
    Table,
    /// The table of a study, as comma-separated values.
    TableCsv,
    /// The work-precision diagram of a study.
    Front,
    /// Every motion that was learned, in figures.
    Motions,
    /// What a stopped job is resumed from.
    Checkpoint,
}

/// Folders with one file for each motion that was learned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shelf {
    /// Motion documents.
    Motions,
    /// Gait reports.
    Gaits,
}

impl Shelf {
    const ALL: [Self; 2] = [Self::Motions, Self::Gaits];

    fn name(self) -> &'static str {
        match self {
            Self::Motions => "motions",
            Self::Gaits => "gaits",
        }
    }

    /// Name from the job's folder on of the file called `name` there.
    pub fn file_name(self, name: &str) -> String {
        format!("{}/{name}", self.name())
    }

    /// Path in `folder` of the file called `name` there.
    pub fn path(self, folder: &Path, name: &str) -> PathBuf {
        folder.join(self.name()).join(name)
    }

    /// Writes the file called `name` there: it appears whole or not at all.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub fn publish(self, folder: &Path, name: &str, contents: &[u8]) -> io::Result<()> {
        let shelf = folder.join(self.name());
        if !shelf.is_dir() {
            std::fs::create_dir_all(&shelf).map_err(|error| about(&shelf, &error))?;
            sync(folder)?;
        }
        write_whole(&self.path(folder, name), contents)
    }

    /// Removes the file called `name` there, where it is there.
    ///
    /// # Errors
    ///
    /// When it cannot be removed.
    fn remove(self, folder: &Path, name: &str) -> io::Result<()> {
        remove(&self.path(folder, name))
    }
}

/// What a job that learns leaves when it has ended, served as its results.
const LEARNED: [Artefact; 6] = [
    Artefact::Motion,
    Artefact::Motions,
    Artefact::Report,
    Artefact::Gait,
    Artefact::Curve,
    Artefact::Diagram,
];

/// What a study leaves.
const STUDIED: [Artefact; 3] = [Artefact::Table, Artefact::TableCsv, Artefact::Front];

impl Artefact {
    /// Its name in the job's folder.
    pub fn file_name(self) -> &'static str {
        match self {
            Self::Recording => "recording.rrd",
            Self::Motion => "motion.json",
            Self::Report => "report.json",
            Self::Gait => "gait.json",
            Self::Curve => "curve.csv",
            Self::Diagram => "gait.svg",
            Self::Table => "table.json",
            Self::TableCsv => "table.csv",
            Self::Front => "front.svg",
            Self::Motions => "motions.json",
            Self::Checkpoint => "checkpoint.json",
        }
    }

    /// Its path in `folder`.
    pub fn path(self, folder: &Path) -> PathBuf {
        folder.join(self.file_name())
    }

    /// Writes it into `folder`: it appears there whole or not at all.
    ///
    /// # Errors
    ///
    /// When it cannot be written.
    pub fn publish(self, folder: &Path, contents: &[u8]) -> io::Result<()> {
        write_whole(&self.path(folder), contents)
    }

    /// Removes it from `folder`, where it is there.
    ///
    /// # Errors
    ///
    /// When it cannot be removed.
    pub fn remove(self, folder: &Path) -> io::Result<()> {
        remove(&self.path(folder))
    }
}

/// Removes a file, where it is there.
fn remove(path: &Path) -> io::Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(about(path, &error)),
        _ => Ok(()),
    }
}

/// Removes the results of an earlier run of a job that has ended without new ones.
///
/// # Errors
///
/// When a file that is there cannot be removed.
pub(in crate::jobs) fn withdraw(folder: &Path) -> io::Result<()> {
    withdraw_learned(folder)?;
    STUDIED.into_iter().try_for_each(|artefact| artefact.remove(folder))
}

/// Removes what was learned in an earlier run, and nothing else: the folder may be a user's own. Which files there are motions, the list
/// of motions says.
///
/// # Errors
///
/// When a file that is there cannot be removed.
pub(in crate::jobs) fn withdraw_learned(folder: &Path) -> io::Result<()> {
    for file in listed_motions(folder) {
        Shelf::ALL.into_iter().try_for_each(|shelf| shelf.remove(folder, &file))?;
    }
    LEARNED.into_iter().try_for_each(|artefact| artefact.remove(folder))
}

/// Names of the files of the motions that the list in `folder` names; none where there is no such list.
fn listed_motions(folder: &Path) -> Vec<String> {
    let list = std::fs::read(Artefact::Motions.path(folder)).unwrap_or_default();
    let repertoire: Repertoire = serde_json::from_slice(&list).unwrap_or_default();
    let files = repertoire.motions.into_iter().map(|motion| motion.file);
    // Only what lies in the shelf itself.
    files.filter(|file| Path::new(file).file_name() == Some(file.as_ref())).collect()
}

/// The folders in which a job has files, each with what the names of its files begin with.
pub(super) fn with_shelves(folder: &Path) -> Vec<(String, PathBuf)> {
    let shelves = Shelf::ALL.map(|shelf| (shelf.file_name(""), folder.join(shelf.name())));
    std::iter::once((String::new(), folder.to_owned())).chain(shelves).collect()
}

/// Makes the folder of the jobs' folders under the folder `data`.
///
/// # Errors
///
/// When it cannot be made.
pub(super) fn make(data: &Path) -> io::Result<()> {
    std::fs::create_dir_all(data.join(JOBS))
}

/// The folder of the job called `id` under the folder `data`.
pub(super) fn folder(data: &Path, id: Uuid) -> PathBuf {
    data.join(JOBS).join(id.to_string())
}

/// Writes a file that appears whole or not at all.
fn write_whole(path: &Path, contents: &[u8]) -> io::Result<()> {
    let write = || {
        let mut unfinished = Unfinished::new(path.parent().unwrap_or(Path::new(".")))?;
        unfinished.file.write_all(contents)?;
        unfinished.appear(path)
    };
    write().map_err(|error| about(path, &error))
}

/// The error with the path that it is about.
fn about(path: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}", path.display()))
}

/// A file without a lasting name yet, readable by others as far as the user's mask allows. It goes when it is dropped.
#[derive(Debug)]
pub(in crate::jobs) struct Unfinished {
    file: NamedTempFile,
}

impl Unfinished {
    /// An empty one in `folder`.
    ///
    /// # Errors
    ///
    /// When it cannot be made.
    pub(in crate::jobs) fn new(folder: &Path) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        Ok(Self { file: builder.prefix(UNFINISHED).tempfile_in(folder)? })
    }

    /// Where it is.
    pub(in crate::jobs) fn path(&self) -> &Path {
        self.file.path()
    }

    /// Gives it its lasting name, in place of a file that has that name. It stays there, with what is in it by now,
    /// even if the power fails.
    ///
    /// # Errors
    ///
    /// When it cannot be written or named.
    pub(in crate::jobs) fn appear(self, path: &Path) -> io::Result<()> {
        self.file.as_file().sync_all()?;
        self.file.persist(path)?;
        sync(path.parent().unwrap_or(Path::new(".")))
    }
}

/// Has what was written into a file, or the names in a folder, last.
///
/// # Errors
///
/// When it cannot be opened or written.
pub(in crate::jobs) fn sync(path: &Path) -> io::Result<()> {
    File::open(path).and_then(|file| file.sync_all()).map_err(|error| about(path, &error))
}

/// The folder of the job called `id` under the folder `data`, made if it is not there.
///
/// # Errors
///
/// When it cannot be made.
pub(super) fn make_folder(data: &Path, id: Uuid) -> io::Result<PathBuf> {
    let folder = folder(data, id);
    if !folder.is_dir() {
        std::fs::create_dir_all(&folder)?;
        sync(&data.join(JOBS))?;
    }
    Ok(folder)
}

/// A file that is written to see whether files can be. It goes when it is dropped.
///
/// # Errors
///
/// When it cannot be made.
pub(super) fn probe(data: &Path) -> io::Result<NamedTempFile> {
    tempfile::Builder::new().prefix(PROBE).tempfile_in(data.join(JOBS))
}

/// What the files in a job's folder take up, as far as that can be read.
pub(in crate::jobs) fn storage(folder: &Path) -> JobStorage {
    let recording = std::fs::metadata(Artefact::Recording.path(folder));
    JobStorage {
        bytes: size(folder).unwrap_or_default(),
        recording_bytes: recording.map_or(0, |about| about.len()),
        ..JobStorage::default()
    }
}

/// Size of all files under `folder`, bytes; 0 where there is none.
///
/// # Errors
///
/// When it cannot be read.
fn size(folder: &Path) -> io::Result<u64> {
    let entries = match std::fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(0),
        entries => entries?,
    };
    let mut bytes = 0;
    for entry in entries {
        let entry = entry?;
        let about = entry.metadata()?;
        bytes += if about.is_dir() { size(&entry.path())? } else { about.len() };
    }
    Ok(bytes)
}

/// The jobs that have a folder under `data`.
///
/// # Errors
///
/// When the folder cannot be read.
pub(super) fn jobs(data: &Path) -> io::Result<BTreeSet<Uuid>> {
    let mut jobs = BTreeSet::new();
    for entry in std::fs::read_dir(data.join(JOBS))? {
        jobs.extend(entry?.file_name().to_str().and_then(|name| Uuid::parse_str(name).ok()));
    }
    Ok(jobs)
}

/// Removes what processes that were killed have left under the folder `data`: files without a lasting name. What cannot be removed
/// stays, and is told in the log.
///
/// # Errors
///
/// When the folder cannot be read.
pub(super) fn sweep(data: &Path) -> io::Result<()> {
    sweep_files(&data.join(JOBS))?;
    jobs(data)?.into_iter().try_for_each(|id| sweep_folder(&folder(data, id)))
}

/// Removes the files without a lasting name in the folder of a job, into which nobody else writes.
///
/// # Errors
///
/// When the folder cannot be read.
pub(in crate::jobs) fn sweep_folder(folder: &Path) -> io::Result<()> {
    sweep_files(folder)?;
    Shelf::ALL.into_iter().try_for_each(|shelf| sweep_files(&folder.join(shelf.name())))
}

fn sweep_files(folder: &Path) -> io::Result<()> {
    let entries = match std::fs::read_dir(folder) {
        Err(error) if matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory) => {
            return Ok(());
        }
        entries => entries?,
    };
    for entry in entries {
        let path = entry?.path();
        if is_leftover(&path) {
            swept(&path, std::fs::remove_file(&path));
        }
    }
    Ok(())
}

pub(super) fn is_leftover(path: &Path) -> bool {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    name.starts_with(UNFINISHED) || name.starts_with(PROBE)
}

fn swept(path: &Path, outcome: io::Result<()>) {
    match outcome {
        Ok(()) => tracing::info!(path = %path.display(), "removed what was left over"),
        Err(error) => tracing::warn!(path = %path.display(), %error, "what was left over stays"),
    }
}
