//! How large a request may be, and how long one may take.

use std::time::Duration;

/// Greatest size of a request's body, bytes.
pub(super) const MAX_BODY: usize = 32 << 20;

/// Greatest size of a body that is not counted as large, bytes.
pub(super) const SMALL_BODY: u64 = 256 << 10;

/// Large bodies that are in memory at once, and how many of them of one caller; others wait.
pub(super) const BODIES: usize = 16;
pub(super) const CALLER_BODIES: usize = 8;

/// Longest time from a request's head to its answer's head.
pub(super) const TIMEOUT: Duration = Duration::from_secs(60);

/// Longest silence while a request's body is sent.
pub(super) const BODY_TIMEOUT: Duration = Duration::from_secs(15);
