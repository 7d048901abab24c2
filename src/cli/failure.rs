//! How a command fails: one line on standard error, and the exit status.

use std::io;
use std::process::ExitCode;

use anyhow::anyhow;
use gaitwright_learning::accuracy::StudyError;
use gaitwright_physics::fault::{InputError, one_line};

use super::message::tell;

/// Why a command did not succeed.
#[derive(Debug)]
pub enum CommandError {
    /// The input cannot be used (status 2).
    Input {
        /// The input, as named on the command line.
        name: String,
        /// Everything wrong with it.
        error: InputError,
    },
    /// The command failed at work (status 1).
    Work(anyhow::Error),
    /// The reader of the output closed it, which is no failure (status 0).
    ClosedPipe,
}

impl CommandError {
    /// A faulty input called `name`.
    pub fn input(name: impl Into<String>) -> impl FnOnce(InputError) -> Self {
        let name = name.into();
        move |error| Self::Input { name, error }
    }

    /// A study of the input called `name` that could not be made.
    pub fn study(name: impl Into<String>) -> impl FnOnce(StudyError) -> Self {
        let name = name.into();
        move |error| match error {
            StudyError::Input(error) => Self::Input { name, error },
            error => Self::Work(anyhow!("{name}: {error}")),
        }
    }

    /// Prints the reason, and returns the exit status.
    pub fn exit(self) -> ExitCode {
        match self {
            Self::Input { name, error } => {
                let faults: Vec<String> = error.faults().iter().map(ToString::to_string).collect();
                tell(format_args!("{name}: {}", faults.join("; ")));
                ExitCode::from(2)
            }
            Self::Work(error) => {
                tell(format_args!("{}", one_line(&reasons(&error))));
                ExitCode::FAILURE
            }
            Self::ClosedPipe => ExitCode::SUCCESS,
        }
    }
}

/// An error and its causes, but for those that it tells of itself.
fn reasons(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string).filter(|cause| !cause.is_empty()) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

impl<E: Into<anyhow::Error>> From<E> for CommandError {
    fn from(error: E) -> Self {
        let error = error.into();
        match error.downcast_ref::<io::Error>() {
            Some(cause) if cause.kind() == io::ErrorKind::BrokenPipe => Self::ClosedPipe,
            _ => Self::Work(error),
        }
    }
}
