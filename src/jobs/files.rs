//! Where a job's files lie, and how they come to be there whole.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use uuid::Uuid;

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
        std::fs::create_dir_all(folder.join(self.name()))?;
        write_whole(&self.path(folder, name), contents)
    }

    /// Removes the files there that are numbered as motions are; the folder may hold a user's own as well.
    ///
    /// # Errors
    ///
    /// When a file cannot be removed.
    fn clear(self, folder: &Path) -> io::Result<()> {
        let files = match std::fs::read_dir(folder.join(self.name())) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            files => files?,
        };
        for file in files {
            let file = file?;
            let name = file.file_name();
            let number = name.to_str().and_then(|name| name.strip_suffix(".json")?.split('-').next());
            if number.is_some_and(|number| number.parse::<u32>().is_ok()) {
                std::fs::remove_file(file.path())?;
            }
        }
        Ok(())
    }
}

/// What is left by a job that has ended, and served as its results.
const RESULTS: [Artefact; 9] = [
    Artefact::Motion,
    Artefact::Motions,
    Artefact::Report,
    Artefact::Gait,
    Artefact::Curve,
    Artefact::Diagram,
    Artefact::Table,
    Artefact::TableCsv,
    Artefact::Front,
];

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
        match std::fs::remove_file(self.path(folder)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        }
    }
}

/// Removes the results of an earlier run of a job that has ended without new ones.
///
/// # Errors
///
/// When a file that is there cannot be removed.
pub fn withdraw(folder: &Path) -> io::Result<()> {
    for artefact in RESULTS {
        artefact.remove(folder)?;
    }
    Shelf::ALL.into_iter().try_for_each(|shelf| shelf.clear(folder))
}

/// The folder of the job called `id` under the folder `data`.
pub fn folder(data: &Path, id: Uuid) -> PathBuf {
    data.join("jobs").join(id.to_string())
}

/// Writes a file that appears whole or not at all.
fn write_whole(path: &Path, contents: &[u8]) -> io::Result<()> {
    let mut unfinished = unfinished(path.parent().unwrap_or(Path::new(".")))?;
    unfinished.write_all(contents)?;
    unfinished.as_file().sync_all()?;
    unfinished.persist(path)?;
    Ok(())
}

/// A file without a lasting name yet, readable by others as far as the user's mask allows.
fn unfinished(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.prefix(".unfinished").tempfile_in(folder)
}
