//! `simulate`: one simulation.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use gaitwright_learning::accuracy::{catalogue, prepare};
use gaitwright_learning::scenario::{Files, Line, Scenario, ScenarioEnd};
use gaitwright_physics::character::{Options, Reading, read_file};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::scene::{Accuracy, AskedAccuracy};

use super::failure::CommandError;
use super::input::{name, read, to_stdout};

/// Runs one simulation and prints a JSON line for every sample, and a summary as the last.
#[derive(Debug, clap::Args)]
pub struct SimulateCommand {
    /// Scenario document; `-` is standard input
    #[arg(required_unless_present_any = ["scene", "list"])]
    scenario: Option<PathBuf>,
    /// A scene of the catalogue of hard cases instead of a document
    #[arg(long, value_name = "NAME", conflicts_with = "scenario")]
    scene: Option<String>,
    /// Time step instead of the scenario's own, s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    step: Option<f64>,
    /// Print the names of the catalogue's scenes and what happens in each
    #[arg(long, conflicts_with_all = ["scenario", "scene", "step"])]
    list: bool,
}

impl SimulateCommand {
    pub fn run(self) -> Result<(), CommandError> {
        if self.list {
            return list();
        }
        // A scene of the catalogue names no files.
        let path = self.scenario.unwrap_or_default();
        let (name, mut scenario) = match &self.scene {
            Some(scene) => (format!("scene {scene}"), in_catalogue(scene)?),
            None => {
                let scenario = Scenario::parse(&read(&path)?).map_err(CommandError::input(name(&path)))?;
                (name(&path), scenario)
            }
        };
        match (self.step, &scenario.accuracy) {
            (None, _) => {}
            (Some(step), AskedAccuracy::Settings(accuracy) | AskedAccuracy::StepBySize(accuracy)) => {
                scenario.accuracy = AskedAccuracy::Settings(Accuracy { step, ..*accuracy });
            }
            (Some(_), AskedAccuracy::Tolerance(_)) => {
                let reason = "`tolerance` chooses the settings: give either it or --step";
                return Err(CommandError::input(name)(InputError::impossible("/accuracy", reason)));
            }
        }
        let prepared = prepare(&scenario, &FilesBeside(&path)).map_err(CommandError::study(name.clone()))?;
        let ended = to_stdout(|out| {
            let mut written = Ok(());
            let ended = prepared.run(|line| {
                written = write(out, &line);
                written.is_ok()
            });
            written.map(|()| ended)
        })?;
        match ended {
            ScenarioEnd::Finished | ScenarioEnd::Stopped => Ok(()),
            ScenarioEnd::Failed => Err(CommandError::Work(anyhow!(
                "{name}: the simulation could not go on; its summary says why"
            ))),
        }
    }
}

/// Prints the catalogue, one scene a line.
fn list() -> Result<(), CommandError> {
    let cases = catalogue::cases();
    Ok(to_stdout(|out| cases.iter().try_for_each(|case| writeln!(out, "{:<26} {}", case.name, case.about)))?)
}

fn in_catalogue(scene: &str) -> Result<Scenario, CommandError> {
    let Some(case) = catalogue::named(scene) else {
        let error = InputError::impossible("", "there is no such scene; --list prints them all");
        return Err(CommandError::input(format!("scene {scene}"))(error));
    };
    Ok(case.scenario)
}

fn write(out: &mut impl Write, line: &Line) -> io::Result<()> {
    serde_json::to_writer(&mut *out, line)?;
    out.write_all(b"\n")
}

/// Files named in a scenario: relative to the scenario's own file, or to the working directory when it
/// comes from standard input.
pub(super) struct FilesBeside<'a>(pub(super) &'a Path);

impl FilesBeside<'_> {
    fn path(&self, path: &str) -> PathBuf {
        match self.0.parent() {
            Some(folder) if self.0.as_os_str() != "-" => folder.join(path),
            _ => PathBuf::from(path),
        }
    }
}

impl Files for FilesBeside<'_> {
    fn character(&self, path: &str) -> Result<Reading, InputError> {
        let path = self.path(path);
        std::fs::metadata(&path).map_err(unreadable(&path))?;
        read_file(&path, Options::default())
    }

    fn motion(&self, path: &str) -> Result<Vec<u8>, InputError> {
        let path = self.path(path);
        std::fs::read(&path).map_err(unreadable(&path))
    }
}

fn unreadable(path: &Path) -> impl FnOnce(io::Error) -> InputError {
    move |error| InputError::impossible("", format!("{} cannot be read: {error}", path.display()))
}
