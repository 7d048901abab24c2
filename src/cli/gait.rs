//! `gait`: the gait of a motion.

use std::path::PathBuf;

use anyhow::Context;
use gaitwright::export::gait_diagram;
use gaitwright::fault::InputError;
use gaitwright::jobs::replay;
use gaitwright::motion::Motion;

use super::failure::Failure;
use super::input::{name, print, read, read_character};

/// Plays a motion with its character in one continuous simulation and tells its gait. Without the
/// character, what the document itself says of its gait is told.
#[derive(Debug, clap::Args)]
pub struct Gait {
    /// Motion document; `-` is standard input
    motion: PathBuf,
    /// The character it was made for: URDF, character JSON, or zip
    #[arg(long)]
    character: Option<PathBuf>,
    /// Where to write the gait diagram
    #[arg(long, requires = "character")]
    svg: Option<PathBuf>,
}

impl Gait {
    pub fn run(self) -> Result<(), Failure> {
        let motion = Motion::parse(&read(&self.motion)?).map_err(Failure::input(name(&self.motion)))?;
        let Some(path) = &self.character else {
            return print(&motion.metrics);
        };
        let reading = read_character(path, false)?;
        if reading.character.digest != motion.character.digest {
            let reason = format!(
                "the motion was made for \"{}\" ({}), not for this character ({})",
                motion.character.name, motion.character.digest, reading.character.digest
            );
            return Err(Failure::input(name(path))(InputError::impossible("", reason)));
        }
        let report = replay(&motion, &reading).map_err(Failure::input(name(&self.motion)))?;
        if let Some(svg) = &self.svg {
            std::fs::write(svg, gait_diagram(&report)?)
                .with_context(|| format!("{} cannot be written", svg.display()))?;
        }
        print(&report)
    }
}
