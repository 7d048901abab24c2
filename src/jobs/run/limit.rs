//! How long a cancelled run may go on.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use gaitwright_learning::learn::Cancel;

/// How long a run that is cancelled may still take to check what it found.
pub(super) struct CancelLimit<'a> {
    cancel: &'a Cancel,
    longest: Duration,
    /// When the cancellation was first noticed.
    since: OnceLock<Instant>,
}

impl<'a> CancelLimit<'a> {
    /// On `cancel`, and at most `longest`.
    pub(super) fn new(cancel: &'a Cancel, longest: Duration) -> Self {
        Self { cancel, longest, since: OnceLock::new() }
    }

    /// Calls the run off.
    pub(super) fn cancel(&self) {
        self.cancel.cancel();
    }

    /// Whether the run was cancelled.
    pub(super) fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }

    /// Whether that was too long ago.
    pub(super) fn is_over(&self) -> bool {
        self.is_cancelled() && self.since.get_or_init(Instant::now).elapsed() >= self.longest
    }
}
