//! Inputs named on the command line, and standard output.

use std::io::{self, BufWriter, Read, StdoutLock, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use gaitwright::jobs;
use gaitwright_learning::learn::Learning;
use gaitwright_physics::character::{self, Options, Reading};
use gaitwright_physics::fault::{Fault, InputError};
use serde::Serialize;

use super::failure::CommandError;

/// Greatest size of standard input, bytes.
const MAX_STDIN: u64 = 128 << 20;

/// The contents of the file at `path`; of standard input when it is `-`.
pub fn read(path: &Path) -> Result<Vec<u8>, CommandError> {
    let unreadable = |error: std::io::Error| CommandError::Input {
        name: name(path),
        error: InputError::Malformed(Fault::new("", format!("cannot be read: {error}"))),
    };
    if path.as_os_str() != "-" {
        return std::fs::read(path).map_err(unreadable);
    }
    let mut bytes = Vec::new();
    std::io::stdin().lock().take(MAX_STDIN + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_STDIN {
        let error = InputError::TooLarge(Fault::new("", format!("more than {MAX_STDIN} bytes")));
        return Err(CommandError::Input { name: name(path), error });
    }
    Ok(bytes)
}

/// Checks that no two of the inputs, each with its name on the command line, are standard input, which can be read once.
///
/// # Errors
/// With the names of those that are.
pub fn check_once<'a>(inputs: impl IntoIterator<Item = (&'a str, &'a PathBuf)>) -> Result<(), CommandError> {
    let from_it = inputs.into_iter().filter(|(_, path)| path.as_os_str() == "-");
    let names: Vec<&str> = from_it.map(|(name, _)| name).collect();
    if names.len() < 2 {
        return Ok(());
    }
    let reason = format!("can be read once, and {} are to be read from it", names.join(" and "));
    Err(CommandError::input(name(Path::new("-")))(InputError::impossible("", reason)))
}

/// Checks the budget of a learning that options of the command line give.
///
/// # Errors
/// Names the first option that is at fault.
pub fn check_budget(generations: Option<u32>, seconds: Option<f64>) -> Result<(), CommandError> {
    let faults = Learning { generations, seconds, ..Learning::default() }.faults();
    let Some(Fault { pointer, reason }) = faults.into_iter().next() else { return Ok(()) };
    let option = pointer.replacen('/', "--", 1);
    Err(CommandError::input(option)(InputError::impossible("", reason)))
}

/// The character in the file at `path`; on standard input when it is `-`. With `strict`, notes about its
/// physics are faults.
pub fn read_character(path: &Path, strict: bool) -> Result<Reading, CommandError> {
    let options = Options { strict };
    let reading = if path.as_os_str() == "-" {
        jobs::read_character(&read(path)?, None, options)
    } else {
        // A URDF's meshes lie beside it.
        character::read_file(path, options)
    };
    reading.map_err(CommandError::input(name(path)))
}

/// The value of an option that is a whole number; clap's own parser of such says no more than "invalid digit".
pub fn whole<const LEAST: u64>(text: &str) -> Result<u64, String> {
    match text.parse() {
        Ok(number) if number >= LEAST => Ok(number),
        _ => Err(format!("must be a whole number from {LEAST} to {}", u64::MAX)),
    }
}

/// An input as messages name it.
pub fn name(path: &Path) -> String {
    if path.as_os_str() == "-" { "standard input".to_owned() } else { path.display().to_string() }
}

/// Prints a document to standard output.
pub fn print<T: Serialize>(document: &T) -> Result<(), CommandError> {
    Ok(to_stdout(|out| {
        // Through `io::Error`, so that a closed pipe can be told apart from a document that cannot be written.
        serde_json::to_writer_pretty(&mut *out, document).map_err(io::Error::from)?;
        out.write_all(b"\n")
    })?)
}

/// Writes to standard output, all of it before this returns; what fails says where.
pub fn to_stdout<T>(
    write: impl FnOnce(&mut BufWriter<StdoutLock<'static>>) -> io::Result<T>,
) -> anyhow::Result<T> {
    let mut out = BufWriter::new(io::stdout().lock());
    let written = write(&mut out).and_then(|written| out.flush().map(|()| written));
    written.context("standard output cannot be written")
}
