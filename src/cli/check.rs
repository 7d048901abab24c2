//! `check`: what is understood of a character.

use std::path::PathBuf;

use gaitwright::jobs::check;
use gaitwright_physics::scene::Scene;

use super::failure::CommandError;
use super::input::{print, read_character};

/// Reports name, mass, links, movable joints with limits, shapes, the standing pose found, and
/// everything repaired, approximated or ignored.
#[derive(Debug, clap::Args)]
pub struct CheckCommand {
    /// URDF, character JSON, or zip of a URDF with its meshes; `-` is standard input
    character: PathBuf,
    /// Refuse a character whose physics had to be repaired or approximated
    #[arg(long)]
    strict: bool,
}

impl CheckCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let reading = read_character(&self.character, self.strict)?;
        print(&check(&reading, &Scene::default()))
    }
}
