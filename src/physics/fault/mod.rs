//! What is wrong with an input, and where.
//!
//! Every reader of outside input (URDF, JSON, archives, scenarios, jobs) answers with an
//! [`InputError`], so that the command line and the HTTP service can name the place the same way.

mod json;
mod strict;
mod tree;
mod words;

use std::borrow::Cow;
use std::fmt;

pub use json::{Parts, from_json, member};
pub use strict::object;

/// One thing wrong with an input.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Fault {
    /// Where: a JSON pointer (`/links/3/mass`), or line and element of a URDF
    /// (`line 12, joint "FL_knee"`). Empty when the fault is about the whole input.
    pub pointer: String,
    /// What is wrong there, in one sentence without a final stop.
    pub reason: String,
}

impl Fault {
    /// A fault at `pointer` for `reason`.
    pub fn new(pointer: impl Into<String>, reason: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), reason: reason.into() }
    }

    /// The same fault seen from the document that holds the faulty one at `prefix`. A place that is
    /// no JSON pointer follows after a colon: `/character/urdf: line 12, joint "FL_knee"`.
    #[must_use]
    pub fn under(mut self, prefix: &str) -> Self {
        let pointer = self.pointer.as_str();
        let between =
            if prefix.is_empty() || pointer.is_empty() || pointer.starts_with('/') { "" } else { ": " };
        self.pointer = format!("{prefix}{between}{pointer}");
        self
    }
}

/// On one line, whatever names the document gives its parts.
impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.pointer.is_empty() {
            write!(f, "{}: ", one_line(&self.pointer))?;
        }
        f.write_str(&one_line(&self.reason))
    }
}

/// `text` with its line breaks and other control characters escaped.
pub fn one_line(text: &str) -> Cow<'_, str> {
    if !text.contains(char::is_control) {
        return text.into();
    }
    let escaped = |c: char| if c.is_control() { c.escape_default().to_string() } else { c.to_string() };
    text.chars().map(escaped).collect()
}

/// An input that cannot be used, with everything found wrong with it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InputError {
    /// It cannot be parsed at all (HTTP 400).
    #[error("malformed: {0}")]
    Malformed(Fault),
    /// It exceeds a bound on size, depth or count (HTTP 413).
    #[error("too large: {0}")]
    TooLarge(Fault),
    /// It is well-formed, but describes something impossible or unknown; every fault found (HTTP 422).
    #[error("{}", join(.0))]
    Impossible(Vec<Fault>),
}

impl InputError {
    /// A well-formed input with a single fault.
    pub fn impossible(pointer: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Impossible(vec![Fault::new(pointer, reason)])
    }

    /// What is left of `result` where `faults` were found beside it: an error that has them all. One that is not about single faults
    /// stays as it is.
    ///
    /// # Errors
    ///
    /// That, or the error of `result`.
    pub fn beside<T>(mut faults: Vec<Fault>, result: Result<T, Self>) -> Result<T, Self> {
        match result {
            result if faults.is_empty() => result,
            Ok(_) => Err(Self::Impossible(faults)),
            Err(Self::Impossible(others)) => {
                faults.extend(others);
                Err(Self::Impossible(faults))
            }
            error => error,
        }
    }

    /// Every fault, in the order in which they were found.
    pub fn faults(&self) -> &[Fault] {
        match self {
            Self::Malformed(fault) | Self::TooLarge(fault) => std::slice::from_ref(fault),
            Self::Impossible(faults) => faults,
        }
    }

    /// The same error seen from the document that holds the faulty one at `prefix`.
    #[must_use]
    pub fn under(self, prefix: &str) -> Self {
        match self {
            Self::Malformed(fault) => Self::Malformed(fault.under(prefix)),
            Self::TooLarge(fault) => Self::TooLarge(fault.under(prefix)),
            Self::Impossible(faults) => {
                Self::Impossible(faults.into_iter().map(|fault| fault.under(prefix)).collect())
            }
        }
    }

    /// The same error seen from the document that stands at `prefix` in the faulty one: what [`under`](Self::under) undoes. `None` where
    /// a fault lies outside.
    pub fn within(&self, prefix: &str) -> Option<Self> {
        let inner = |fault: &Fault| {
            let rest = fault.pointer.strip_prefix(prefix)?;
            let rest =
                rest.strip_prefix(": ").or((rest.is_empty() || rest.starts_with('/')).then_some(rest))?;
            Some(Fault::new(rest, fault.reason.clone()))
        };
        Some(match self {
            Self::Malformed(fault) => Self::Malformed(inner(fault)?),
            Self::TooLarge(fault) => Self::TooLarge(inner(fault)?),
            Self::Impossible(faults) => Self::Impossible(faults.iter().map(inner).collect::<Option<_>>()?),
        })
    }
}

fn join(faults: &[Fault]) -> String {
    faults.iter().map(Fault::to_string).collect::<Vec<_>>().join("; ")
}
