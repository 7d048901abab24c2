//! The commands: each calls the library and prints. Results go to standard output, messages to standard error.

mod accuracy;
mod check;
mod demo;
mod export;
mod failure;
mod gait;
mod input;
mod log;
mod message;
mod output;
mod schema;
mod serve;
mod settings;
mod simulate;
mod study;
mod train;
mod work;

use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Parser, Subcommand};
use gaitwright::jobs::without_password;
use gaitwright_physics::fault::InputError;

use failure::CommandError;
use log::LogFormat;

/// Learns physically valid motion for any articulated character, and serves it over HTTP.
///
/// CHARACTER is a URDF file, a character JSON file, or a zip of a URDF with its meshes; `-` is
/// standard input. Exit status: 0 on success, 1 for a failure at work, 2 for a usage or input error.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Start the service and have it train the bundled quadruped
    Demo(demo::DemoCommand),
    /// Run the service
    Serve(Box<serve::ServeCommand>),
    /// Work at the jobs of servers, on this machine or another
    Work(Box<work::WorkCommand>),
    /// Learn a motion without a service
    Train(train::TrainCommand),
    /// Report what is understood of a character, as JSON
    Check(check::CheckCommand),
    /// Run one simulation, as JSON lines
    Simulate(simulate::SimulateCommand),
    /// Measure what accuracy costs, and recommend a setting
    Accuracy(accuracy::AccuracyCommand),
    /// Answer the open questions about the learning, beside rival searches
    Study(study::StudyCommand),
    /// Report the gait of a motion, as JSON
    Gait(gait::GaitCommand),
    /// Write a motion in the form that another program opens
    Export(export::ExportCommand),
    /// Print the JSON Schema of character documents
    Schema,
}

/// Runs the command line's command.
pub fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return explain(without_secrets(error)),
    };
    // Service and workers log as their settings say; the other commands print their own messages.
    if !matches!(arguments.command, Command::Serve(_) | Command::Work(_)) {
        let filter = std::env::var("RUST_LOG").unwrap_or_default();
        // What cannot be read may be meant for another program.
        if log::start(&filter, LogFormat::Text).is_err() {
            let _ = log::start("warn", LogFormat::Text);
        }
    }
    let done = match arguments.command {
        Command::Demo(demo) => demo.run(),
        Command::Serve(serve) => serve.run(),
        Command::Work(work) => work.run(),
        Command::Train(train) => train.run(),
        Command::Check(check) => check.run(),
        Command::Simulate(simulate) => simulate.run(),
        Command::Accuracy(accuracy) => accuracy.run(),
        Command::Study(study) => study.run(),
        Command::Gait(gait) => gait.run(),
        Command::Export(export) => export.run(),
        Command::Schema => schema::run(),
    };
    done.map_or_else(CommandError::exit, |()| ExitCode::SUCCESS)
}

/// Prints the help that was asked for, or in one line why the command line cannot be used; the exit status.
fn explain(error: clap::Error) -> ExitCode {
    let help = error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand;
    if help || !error.use_stderr() {
        error.exit();
    }
    let text = error.to_string();
    let lines = text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage:"));
    let told: Vec<&str> = lines.filter(|line| !line.is_empty() && !line.starts_with("For more")).collect();
    let told = told.join(" ");
    let reason = format!("{}; --help lists the options", told.trim_start_matches("error: "));
    CommandError::input("the command line")(InputError::impossible("", reason)).exit()
}

/// An error that tells of a value that cannot be read, without the password in it.
fn without_secrets(mut error: clap::Error) -> clap::Error {
    if let Some(ContextValue::String(value)) = error.get(ContextKind::InvalidValue) {
        let value = without_password(value);
        error.insert(ContextKind::InvalidValue, ContextValue::String(value));
    }
    error
}
