//! The way of the data through a job: character → model → standing pose → learning → check → files.
//!
//! The service's workers and the command `train` both go it.

mod describe;
mod document;
mod error;
mod finished;
mod limit;
mod observe;
mod outcome;
mod prepared;
mod report;
mod shelve;
mod shown;
mod watcher;

use std::path::Path;
use std::time::{Duration, Instant};

use super::files::{self, Artefact};
use super::job::Stage;
use super::order::Order;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::learn::{Cancel, StopReason};
use gaitwright_learning::training::{TrainingCheckpoint, train};
use gaitwright_physics::character::Reading;
use gaitwright_physics::motion::Motion;

use crate::export::{Curve, Replay};
use describe::describe;
pub use error::{ReplayError, RunError};
use finished::Finished;
use gaitwright_learning::check::CheckedMotion;
use limit::CancelLimit;
use observe::{EarlierRun, Recorder};
pub use outcome::{RunOutcome, Unsuccessful};
pub use prepared::PreparedRun;
pub use report::TrainingReport;
use report::{Reached, report};
use shelve::json;
pub use watcher::{RunTimes, RunWatcher};

/// Plays a motion document with its character for a long stretch, and measures its gait. Of a character that falls
/// it is the gait until then.
///
/// # Errors
///
/// When the motion is not of this character, when its scene cannot be simulated, or not to the end, and when the
/// character falls before it has gone round its loop.
pub fn replay(motion: &Motion, reading: &Reading) -> Result<GaitReport, ReplayError> {
    let played = Replay::new(motion, &reading.character)?;
    let player = played.player();
    let CheckedMotion { trace, gait, .. } = played.check().run(&|| false)?;
    let once = player.lead() + player.period();
    match (trace.failure, trace.fell_at) {
        (Some(failure), _) => Err(ReplayError::BrokenOff(failure)),
        (None, Some(time)) if time < once => Err(ReplayError::Fallen(time)),
        (None, _) => Ok(gait),
    }
}

/// Does the whole of `order` on `threads` threads, on from `checkpoint` when there is one, and
/// leaves what comes of it in `folder`: the recording grows while it runs, each motion appears whole when it is
/// finished and checked, everything else at the end. A run that is cancelled writes what was found by then, if it
/// takes no longer than the given time to check it.
///
/// # Errors
///
/// When the character or what is wanted of it turns out impossible, or a file cannot be written.
pub fn run(
    order: &Order,
    threads: usize,
    folder: &Path,
    (cancel, check_limit): (&Cancel, Duration),
    checkpoint: Option<TrainingCheckpoint>,
    watcher: &mut dyn RunWatcher,
) -> Result<RunOutcome, RunError> {
    // An earlier attempt may have broken off, or be stuck, in the middle of a file.
    files::sweep_folder(folder)?;
    watcher.stage(Stage::Standing);
    // A run that is called off by now leaves what an earlier one has left.
    let prepared = PreparedRun::new(order, threads, cancel)?.filter(|_| !cancel.is_cancelled());
    let Some(prepared) = prepared else { return Ok(not_begun()) };
    watcher.prepared(&prepared);

    let limit = CancelLimit::new(cancel, check_limit);
    // Before the files of an earlier run go, what it had finished is ready to be written again.
    let earlier = match &checkpoint {
        None => None,
        Some(checkpoint) => {
            watcher.stage(Stage::Checking);
            let since = Instant::now();
            match Finished::check_all((order, &prepared), checkpoint, &limit, watcher)? {
                Some(verdicts) => Some(EarlierRun { checkpoint, verdicts, since }),
                None => return Ok(not_begun()),
            }
        }
    };
    // Whoever looks for a recording from now on finds that of this run, or none yet.
    files::withdraw_learned(folder)?;
    Artefact::Recording.remove(folder)?;
    watcher.stage(Stage::Learning);
    let mut recorder = Recorder::create(folder, order, &prepared, earlier, &limit, watcher)?;
    let trained = train(&prepared.setup, &mut recorder, cancel, checkpoint)?;
    let (mut recording, shelved, times) = recorder.finish()?;
    if watcher.is_lost() {
        return Ok(not_begun());
    }

    watcher.stage(Stage::Checking);
    let start = Instant::now();
    Artefact::Curve.publish(folder, Curve::new(&trained.curve).to_csv().as_bytes())?;
    let accuracy_check = match shelved.motion() {
        Some(motion) => prepared.accuracy_check(motion, &|| limit.is_over())?,
        None => None,
    };
    let reached = Reached {
        ended: Some(trained.ended),
        last: trained.curve.last(),
        accuracy_check: accuracy_check.as_ref(),
    };
    let report = report((order, &prepared), &shelved, reached);
    Artefact::Report.publish(folder, &json(&report)?)?;
    recording.job(&describe(order, &prepared, Some(&report)))?;
    recording.finish()?;
    files::sync(&Artefact::Recording.path(folder))?;
    watcher.spent(RunTimes { checking: times.checking + start.elapsed(), ..times });
    Ok(RunOutcome { ended: trained.ended, motion: shelved.outcome(), accuracy_check })
}

/// What comes of a run that leaves nothing.
fn not_begun() -> RunOutcome {
    RunOutcome { ended: StopReason::Cancelled, motion: Err(Unsuccessful::NotBegun), accuracy_check: None }
}
