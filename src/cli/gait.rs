//! `gait`: the gait of a motion.

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use gaitwright::export::gait_diagram;
use gaitwright::jobs::{ReplayError, replay};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::{Metrics, Motion};
use serde::Serialize;

use super::failure::CommandError;
use super::input::{check_once, name, print, read, read_character};
use super::message::tell;

/// Plays a motion with its character in one continuous simulation and reports its gait. Without the
/// character, reports what the document itself states about its gait.
#[derive(Debug, clap::Args)]
pub struct GaitCommand {
    /// Motion document; `-` is standard input
    motion: PathBuf,
    /// The character it was made for: URDF, character JSON, or zip
    #[arg(long)]
    character: Option<PathBuf>,
    /// Where to write the gait diagram
    #[arg(long, requires = "character")]
    svg: Option<PathBuf>,
}

/// What is printed of a motion without its character.
#[derive(Serialize)]
struct StatedMetrics<'a> {
    format: &'static str,
    #[serde(flatten)]
    metrics: &'a Metrics,
}

impl GaitCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let character = self.character.iter().map(|character| ("--character", character));
        check_once(character.chain([("MOTION", &self.motion)]))?;
        let motion = Motion::parse(&read(&self.motion)?).map_err(CommandError::input(name(&self.motion)))?;
        let Some(path) = &self.character else {
            return print(&StatedMetrics { format: "gaitwright/metrics@1", metrics: &motion.metrics });
        };
        let reading = read_character(path, false)?;
        if !reading.character.has_digest(&motion.character.digest) {
            let reason = format!(
                "the motion was made for \"{}\" ({}), not for this character ({})",
                motion.character.name, motion.character.digest, reading.character.digest
            );
            return Err(CommandError::input(name(path))(InputError::impossible("", reason)));
        }
        let file = name(&self.motion);
        let report = replay(&motion, &reading).map_err(|error| match error {
            ReplayError::Input(error) => CommandError::Input { name: file.clone(), error },
            error => CommandError::Work(anyhow!("{file}: {error}")),
        })?;
        if let Some(time) = report.fell_at {
            tell(format_args!(
                "{file}: the character fell after {time:.3} s; the gait is that of the time until then"
            ));
        }
        if let Some(svg) = &self.svg {
            std::fs::write(svg, gait_diagram(&report)?)
                .with_context(|| format!("{} cannot be written", svg.display()))?;
        }
        print(&report)
    }
}
