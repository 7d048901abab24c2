//! The log, on standard error.

use std::io::{IsTerminal, stderr};

use serde::{Deserialize, Serialize};
use tracing_subscriber::EnvFilter;
use tracing_subscriber::filter::{LevelFilter, ParseError};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// How the log is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LogFormat {
    /// Lines for people.
    Text,
    /// A JSON object a line.
    Json,
}

/// Logs from here on what `filter` lets through; warnings where it is empty. What cannot be written, to a full disk for
/// one, is left out.
///
/// # Errors
///
/// When `filter` cannot be read.
pub fn start(filter: &str, format: LogFormat) -> Result<(), ParseError> {
    let log = tracing_subscriber::registry()
        .with(EnvFilter::builder().with_default_directive(LevelFilter::WARN.into()).parse(filter)?);
    match format {
        LogFormat::Text => {
            // A failure to write the log would be written to the same place, in a way that ends the thread if that fails.
            let lines = tracing_subscriber::fmt::layer()
                .with_ansi(stderr().is_terminal())
                .with_writer(stderr)
                .log_internal_errors(false);
            log.with(lines).init();
        }
        LogFormat::Json => {
            // The ids of request and job stand beside the message, whatever spans they come from.
            let objects = json_subscriber::layer()
                .with_writer(stderr)
                .log_internal_errors(false)
                .with_current_span(false)
                .with_span_list(false)
                .flatten_span_list_on_top_level(true)
                .flatten_event(true);
            log.with(objects).init();
        }
    }
    Ok(())
}
