//! Training by QDSEGA: one motion, driven with the gains of the stance.

use super::checkpoint::{Earlier, TrainingCheckpoint};
use super::motion::Trained;
use super::observer::TrainingObserver;
use super::unnamed::{UnnamedMotions, in_speed};
use gaitwright_physics::fault::InputError;

use crate::learn::{
    Behaviour, Cancel, Checkpoint, Generation, LearnError, Learned, LearningSetup, Observer, Parameters,
    learn,
};

/// Trains by QDSEGA after what was learned `earlier`: with what that has left of the budget.
///
/// # Errors
/// As [`learn`], and for a checkpoint of another search.
pub(super) fn run(
    setup: &LearningSetup,
    observer: &mut dyn TrainingObserver,
    cancel: &Cancel,
    resume: Option<TrainingCheckpoint>,
    earlier: Earlier,
) -> Result<Trained, LearnError> {
    let (learner, earlier) = match resume {
        None => (None, earlier),
        Some(TrainingCheckpoint::Qdsega { learner, before, shown, spent, by_the_clock }) => {
            (Some(*learner), Earlier { curve: before, milestones: shown, spent, by_the_clock })
        }
        Some(TrainingCheckpoint::Gaits { .. }) => {
            let reason = "the checkpoint was made by another search";
            return Err(InputError::impossible("/checkpoint/search", reason).into());
        }
    };
    let unnamed = UnnamedMotions::of(setup);
    let budget = setup.parameters.budget.after(earlier.curve.len() as u32, earlier.spent);
    let parameters = Parameters { budget, ..setup.parameters.clone() };
    let left = LearningSetup { parameters, task: in_speed(setup), ..setup.clone() };
    let mut adapter = Adapter { observer, unnamed: unnamed.clone(), earlier };
    let Learned { ended, best, curve, .. } = learn(&left, &mut adapter, cancel, learner)?;
    let Adapter { observer, earlier: Earlier { curve: before, by_the_clock, .. }, .. } = adapter;
    let best = best.map(|best| unnamed.motion(best, before.len() as u32));
    if let Some(best) = &best {
        observer.finished(best);
    }
    let later: Vec<Generation> = curve.iter().map(|figures| figures.after(&before)).collect();
    let curve = before.into_iter().chain(later).collect();
    let trained = Trained { ended, motions: best.into_iter().collect(), curve };
    Ok(trained.decided_by_the_clock(by_the_clock))
}

/// Passes on what the learner reports.
struct Adapter<'a> {
    observer: &'a mut dyn TrainingObserver,
    unnamed: UnnamedMotions,
    earlier: Earlier,
}

impl Observer for Adapter<'_> {
    fn generation(&mut self, figures: &Generation) {
        self.observer.generation(&figures.after(&self.earlier.curve));
    }

    fn improved(&mut self, best: &Behaviour) {
        self.observer.improved(&self.unnamed.motion(best.clone(), self.earlier.curve.len() as u32));
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) {
        let Earlier { curve: before, milestones: shown, spent, by_the_clock } = self.earlier.clone();
        let learner = Box::new(checkpoint.clone());
        let checkpoint = TrainingCheckpoint::Qdsega { learner, before, shown, spent, by_the_clock };
        self.observer.checkpoint(&checkpoint);
    }
}
