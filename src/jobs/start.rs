//! What a process does for jobs beside answering questions about them.

use std::io;

use tokio::runtime::Handle;

use super::hearing::hear;
use super::housekeeping::keep_house;
use super::keeper;
use super::service::Jobs;

/// Starts the workers of `jobs`, hears what others do, and keeps house until the service shuts down. The workers end then
/// too.
///
/// # Errors
///
/// When a thread cannot be started.
pub fn start(jobs: &Jobs, runtime: &Handle) -> io::Result<()> {
    start_workers(jobs, runtime)?;
    runtime.spawn(keep_house(jobs.clone()));
    Ok(())
}

/// The same without keeping house, which is the servers' to do.
///
/// # Errors
///
/// When a thread cannot be started.
pub fn start_workers(jobs: &Jobs, runtime: &Handle) -> io::Result<()> {
    keeper::start(jobs.shared(), runtime)?;
    runtime.spawn(hear(jobs.clone()));
    Ok(())
}
