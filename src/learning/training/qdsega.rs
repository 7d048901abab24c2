//! Training by QDSEGA: one motion, driven with the gains of the stance.

use super::Trained;
use super::checkpoint::TrainingCheckpoint;
use super::motion::LearnedMotion;
use super::observer::TrainingObserver;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::scene::Gains;

use crate::learn::{
    Behaviour, Cancel, Checkpoint, Generation, LearnError, Learned, LearningSetup, Observer, learn,
};

/// Trains by QDSEGA.
///
/// # Errors
/// As [`learn`], and for a checkpoint of another search.
pub(super) fn run(
    setup: &LearningSetup,
    observer: &mut dyn TrainingObserver,
    cancel: &Cancel,
    resume: Option<TrainingCheckpoint>,
) -> Result<Trained, LearnError> {
    let learner = match resume {
        None => None,
        Some(TrainingCheckpoint::Qdsega { learner }) => Some(*learner),
        Some(TrainingCheckpoint::Gaits { .. }) => {
            let reason = "the checkpoint was made by another search";
            return Err(InputError::impossible("/checkpoint/search", reason).into());
        }
    };
    let gains = &setup.stance.gains;
    let mut adapter = Adapter { observer, gains };
    let Learned { ended, best, curve, .. } = learn(setup, &mut adapter, cancel, learner)?;
    let best = best.map(|best| LearnedMotion::unnamed(best, gains));
    if let Some(best) = &best {
        adapter.observer.finished(best);
    }
    Ok(Trained { ended, motions: best.into_iter().collect(), curve })
}

/// Passes on what the learner reports.
struct Adapter<'a> {
    observer: &'a mut dyn TrainingObserver,
    gains: &'a Gains,
}

impl Observer for Adapter<'_> {
    fn generation(&mut self, figures: &Generation) {
        self.observer.generation(figures);
    }

    fn improved(&mut self, best: &Behaviour) {
        self.observer.improved(&LearnedMotion::unnamed(best.clone(), self.gains));
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) {
        self.observer.checkpoint(&TrainingCheckpoint::Qdsega { learner: Box::new(checkpoint.clone()) });
    }
}
