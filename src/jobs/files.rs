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
    /// What a stopped job is resumed from.
    Checkpoint,
}

/// What is left by a job that has ended, and served as its results.
const RESULTS: [Artefact; 8] = [
    Artefact::Motion,
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
        let mut unfinished = unfinished(folder)?;
        unfinished.write_all(contents)?;
        unfinished.as_file().sync_all()?;
        unfinished.persist(self.path(folder))?;
        Ok(())
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
    Ok(())
}

/// The folder of the job called `id` under the folder `data`.
pub fn folder(data: &Path, id: Uuid) -> PathBuf {
    data.join("jobs").join(id.to_string())
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
