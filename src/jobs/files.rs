//! Where a job's files lie, and how they come to be there whole.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

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
    /// What a stopped job is resumed from.
    Checkpoint,
}

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
        let unfinished = folder.join(format!(".{}.unfinished", self.file_name()));
        let mut file = File::create(&unfinished)?;
        file.write_all(contents)?;
        file.sync_all()?;
        std::fs::rename(unfinished, self.path(folder))
    }
}

/// The folder of the job called `id` under the folder `data`.
pub fn folder(data: &Path, id: Uuid) -> PathBuf {
    data.join("jobs").join(id.to_string())
}
