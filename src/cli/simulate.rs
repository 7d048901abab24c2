//! `simulate`: one simulation.

use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use gaitwright::character::{Options, Reading, read_file};
use gaitwright::fault::InputError;
use gaitwright::scenario::{Ended, Files, Line, Scenario};

use super::failure::Failure;
use super::input::{name, read};

/// Runs one simulation and prints a JSON line for every sample, and a summary as the last.
#[derive(Debug, clap::Args)]
pub struct Simulate {
    /// Scenario document; `-` is standard input
    scenario: PathBuf,
}

impl Simulate {
    pub fn run(self) -> Result<(), Failure> {
        let faulty = |error| Failure::input(name(&self.scenario))(error);
        let scenario = Scenario::parse(&read(&self.scenario)?).map_err(faulty)?;
        let prepared = scenario.prepare(&Beside(&self.scenario)).map_err(faulty)?;
        let mut out = BufWriter::new(io::stdout().lock());
        let mut written = Ok(());
        let ended = prepared.run(|line| {
            written = write(&mut out, &line);
            written.is_ok()
        });
        written?;
        out.flush()?;
        match ended {
            Ended::Finished | Ended::Stopped => Ok(()),
            Ended::Failed => Err(Failure::Work(anyhow!(
                "{}: the simulation could not go on; its summary says why",
                name(&self.scenario)
            ))),
        }
    }
}

fn write(out: &mut impl Write, line: &Line) -> io::Result<()> {
    serde_json::to_writer(&mut *out, line)?;
    out.write_all(b"\n")
}

/// Files named in a scenario: relative to the scenario's own file, or to the working directory when it
/// comes from standard input.
struct Beside<'a>(&'a Path);

impl Beside<'_> {
    fn path(&self, path: &str) -> PathBuf {
        match self.0.parent() {
            Some(folder) if self.0.as_os_str() != "-" => folder.join(path),
            _ => PathBuf::from(path),
        }
    }
}

impl Files for Beside<'_> {
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
