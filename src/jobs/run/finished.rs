//! A finished motion, checked: all that is kept and shown of it.

use super::document::document;
use super::error::RunError;
use super::limit::CancelLimit;
use super::outcome::Unsuccessful;
use super::prepared::PreparedRun;
use super::shown::shown;
use super::watcher::RunWatcher;
use crate::jobs::order::Order;
use gaitwright_learning::gait::GaitReport;
use gaitwright_learning::training::{LearnedMotion, TrainingCheckpoint};
use gaitwright_physics::motion::Motion;
use gaitwright_physics::playback::Trace;

/// How long a finished motion is recorded after it has entered its loop, s.
const SHOWN_FINISHED: f64 = 6.0;

/// A finished motion, checked.
pub(super) struct Finished {
    /// Its document; `None` where it fell.
    pub(super) document: Option<Motion>,
    /// What was measured.
    pub(super) gait: GaitReport,
    /// What the recording shows of it.
    pub(super) shown: Trace,
}

/// A motion, or why it is none that a job keeps.
pub(super) type Verdict = Result<Finished, Unsuccessful>;

impl Finished {
    /// Checks `motion`, and tries it where it was not tried when it was learned.
    ///
    /// # Errors
    ///
    /// When it cannot be simulated.
    pub(super) fn check(
        (order, prepared): (&Order, &PreparedRun),
        motion: &LearnedMotion,
        limit: &CancelLimit<'_>,
        watcher: &dyn RunWatcher,
    ) -> Result<Verdict, RunError> {
        let setup = &prepared.setup;
        let player = motion.player(&setup.stance.angles);
        let check = motion.check(setup, &player);
        let mut checked = check.run(&|| limit.is_over())?;
        if limit.is_over() || watcher.is_lost() {
            return Ok(Err(Unsuccessful::NotChecked));
        }
        if !checked.travels {
            return Ok(Err(Unsuccessful::DoesNotTravel));
        }
        if !motion.trials.is_empty() {
            checked.validity.trials.clone_from(&motion.trials);
        } else if !limit.is_cancelled() {
            checked.validity.trials = check.trials(&checked, setup.threads, &|| limit.is_cancelled())?;
        }
        let document = document(order, prepared, motion, &checked);
        let shown = shown(&checked.trace, &player, SHOWN_FINISHED);
        Ok(Ok(Self { document, gait: checked.gait, shown }))
    }

    /// Checks the motions that had been finished at `checkpoint`; `None` where the run is called off before that is done.
    ///
    /// # Errors
    ///
    /// As [`Finished::check`].
    pub(super) fn check_all(
        run: (&Order, &PreparedRun),
        checkpoint: &TrainingCheckpoint,
        limit: &CancelLimit<'_>,
        watcher: &dyn RunWatcher,
    ) -> Result<Option<Vec<Verdict>>, RunError> {
        let mut verdicts = Vec::new();
        for milestone in checkpoint.milestones(&run.1.setup).iter().filter(|milestone| milestone.finished) {
            verdicts.push(Self::check(run, &milestone.motion, limit, watcher)?);
            if limit.is_cancelled() || watcher.is_lost() {
                return Ok(None);
            }
        }
        Ok(Some(verdicts))
    }
}
