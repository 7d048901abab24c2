//! Training by QDSEGA: one motion, driven with the gains of the stance.

use super::checkpoint::TrainingCheckpoint;
use super::motion::Trained;
use super::observer::TrainingObserver;
use super::unnamed::{UnnamedMotions, in_speed};
use gaitwright_physics::fault::InputError;

use crate::learn::{
    Behaviour, Cancel, Checkpoint, Generation, LearnError, Learned, LearningSetup, Observer, Parameters,
    learn,
};

/// Trains by QDSEGA, after a search whose curve is `before`: with what that has left of the budget.
///
/// # Errors
/// As [`learn`], and for a checkpoint of another search.
pub(super) fn run(
    setup: &LearningSetup,
    observer: &mut dyn TrainingObserver,
    cancel: &Cancel,
    resume: Option<TrainingCheckpoint>,
    before: Vec<Generation>,
) -> Result<Trained, LearnError> {
    let (learner, before) = match resume {
        None => (None, before),
        Some(TrainingCheckpoint::Qdsega { learner, before }) => (Some(*learner), before),
        Some(TrainingCheckpoint::Gaits { .. }) => {
            let reason = "the checkpoint was made by another search";
            return Err(InputError::impossible("/checkpoint/search", reason).into());
        }
    };
    let unnamed = UnnamedMotions::of(setup);
    let spent = before.last().map_or(0.0, |figures| figures.elapsed);
    let budget = setup.parameters.budget.after(before.len() as u32, spent);
    let parameters = Parameters { budget, ..setup.parameters.clone() };
    let left = LearningSetup { parameters, task: in_speed(setup), ..setup.clone() };
    let mut adapter = Adapter { observer, unnamed: unnamed.clone(), before };
    let Learned { ended, best, curve, .. } = learn(&left, &mut adapter, cancel, learner)?;
    let Adapter { observer, before, .. } = adapter;
    let best = best.map(|best| unnamed.motion(best, before.len() as u32));
    if let Some(best) = &best {
        observer.finished(best);
    }
    let later: Vec<Generation> = curve.iter().map(|figures| figures.after(&before)).collect();
    let curve = before.into_iter().chain(later).collect();
    Ok(Trained { ended, motions: best.into_iter().collect(), curve })
}

/// Passes on what the learner reports.
struct Adapter<'a> {
    observer: &'a mut dyn TrainingObserver,
    unnamed: UnnamedMotions,
    /// The curve of the search before.
    before: Vec<Generation>,
}

impl Observer for Adapter<'_> {
    fn generation(&mut self, figures: &Generation) {
        self.observer.generation(&figures.after(&self.before));
    }

    fn improved(&mut self, best: &Behaviour) {
        self.observer.improved(&self.unnamed.motion(best.clone(), self.before.len() as u32));
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) {
        let (learner, before) = (Box::new(checkpoint.clone()), self.before.clone());
        self.observer.checkpoint(&TrainingCheckpoint::Qdsega { learner, before });
    }
}
