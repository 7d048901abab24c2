//! `export`: a motion in the form that other programs open.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use gaitwright::export::{DEFAULT_FPS, ExportFormat, ExportOptions, export};
use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::motion::Motion;

use super::failure::CommandError;
use super::input::{name, read, read_character};

/// Writes a motion for another program: glTF binary, BVH, CSV, a ROS 2 JointTrajectory, or a MuJoCo model with
/// keyframes. The guide describes each.
#[derive(Debug, clap::Args)]
pub struct ExportCommand {
    /// Motion document; `-` is standard input
    motion: PathBuf,
    /// The character it was made for: URDF, character JSON, or zip
    #[arg(long)]
    character: PathBuf,
    /// What to write
    #[arg(long, value_parser = formats())]
    format: ExportFormat,
    /// Frames per second; the nearest rate at which the loop is a whole number of frames is used
    #[arg(long, default_value_t = DEFAULT_FPS)]
    fps: f64,
    /// Let the root stay where the loop starts instead of travelling
    #[arg(long)]
    in_place: bool,
    /// Where to write it; `-` is standard output
    #[arg(long)]
    out: PathBuf,
}

fn formats() -> impl TypedValueParser<Value = ExportFormat> {
    PossibleValuesParser::new(ExportFormat::ALL.map(ExportFormat::name))
        .try_map(|name| name.parse::<ExportFormat>())
}

impl ExportCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let motion = Motion::parse(&read(&self.motion)?).map_err(CommandError::input(name(&self.motion)))?;
        let reading = read_character(&self.character, false)?;
        let options = ExportOptions { fps: self.fps, in_place: self.in_place };
        let file = export(&motion, &reading.character, self.format, &options).map_err(|error| {
            // What is wrong with an option is named as the option is.
            let fault = error.faults().first().map_or("", |fault: &Fault| &fault.pointer);
            let place = match fault {
                "fps" => "--fps".to_owned(),
                "in_place" => "--in-place".to_owned(),
                _ => name(&self.motion),
            };
            CommandError::Input { name: place, error: without_option(error) }
        })?;
        if self.out.as_os_str() == "-" {
            let mut out = std::io::stdout().lock();
            out.write_all(&file)?;
            return Ok(out.flush()?);
        }
        std::fs::write(&self.out, file)
            .with_context(|| format!("{} cannot be written", self.out.display()))?;
        Ok(())
    }
}

/// The error without the place of a fault that is an option.
fn without_option(error: InputError) -> InputError {
    match error.faults() {
        [fault] if ["fps", "in_place"].contains(&&*fault.pointer) => {
            InputError::impossible("", &*fault.reason)
        }
        _ => error,
    }
}
