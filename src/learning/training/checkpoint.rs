//! The state from which a training can be resumed.

use serde::{Deserialize, Serialize};

use gaitwright_physics::fault::{Fault, InputError};

use super::motion::LearnedMotion;
use super::unnamed::UnnamedMotions;
use crate::learn::{Behaviour, Checkpoint, Generation, Learning, LearningSetup, Task, faults_of_origin};

/// Everything a resumed training needs besides its setup.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "search", rename_all = "snake_case")]
pub enum TrainingCheckpoint {
    /// Of QDSEGA.
    Qdsega {
        /// The learner's own.
        learner: Box<Checkpoint>,
        /// The curve of the gaits that were searched for before, in vain.
        before: Vec<Generation>,
        /// The motions that were shown of them.
        #[serde(default)]
        shown: Vec<Milestone>,
        /// s of the wall clock that they took.
        #[serde(default)]
        spent: f64,
        /// Whether the clock decided what of them was searched for.
        #[serde(default)]
        by_the_clock: bool,
    },
    /// Of the search gait by gait; handed out when one is done.
    Gaits {
        /// Seed of the training.
        seed: u64,
        /// Its parameters, as used.
        learning: Box<Learning>,
        /// Its task.
        task: Task,
        /// Niches that are done.
        done: usize,
        /// What was found so far, in the order in which it was.
        milestones: Vec<Milestone>,
        /// The learning curve so far.
        curve: Vec<Generation>,
        /// Simulated time so far, s.
        simulated: f64,
        /// s of the wall clock spent so far.
        elapsed: f64,
        /// Whether the clock decided what was searched for.
        #[serde(default)]
        by_the_clock: bool,
    },
}

/// A motion that was shown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Milestone {
    /// The motion.
    pub motion: LearnedMotion,
    /// Whether it stays as it is.
    pub finished: bool,
}

/// What was learned by the search gait by gait before QDSEGA took over.
#[derive(Debug, Clone, Default)]
pub(super) struct Earlier {
    /// Its learning curve.
    pub(super) curve: Vec<Generation>,
    /// The motions that it showed, in order.
    pub(super) milestones: Vec<Milestone>,
    /// s of the wall clock that it took: more than the curve says, which ends with the last generation.
    pub(super) spent: f64,
    /// Whether the clock decided what was searched for.
    pub(super) by_the_clock: bool,
}

impl TrainingCheckpoint {
    /// The learning curve so far.
    pub fn curve(&self) -> Vec<Generation> {
        match self {
            Self::Qdsega { learner, before, .. } => {
                let later = learner.curve.iter().map(|figures| figures.after(before));
                before.iter().cloned().chain(later).collect()
            }
            Self::Gaits { curve, .. } => curve.clone(),
        }
    }

    /// Every motion shown so far of the training of `setup`, in order.
    pub fn milestones(&self, setup: &LearningSetup) -> Vec<Milestone> {
        match self {
            Self::Qdsega { learner, before, shown, .. } => {
                let unnamed = UnnamedMotions::of(setup);
                let improved = |best: &Behaviour| Milestone {
                    motion: unnamed.motion(best.clone(), before.len() as u32),
                    finished: false,
                };
                shown.iter().cloned().chain(learner.improved.iter().map(improved)).collect()
            }
            Self::Gaits { milestones, .. } => milestones.clone(),
        }
    }

    /// Whether it is one of the search gait by gait for the training of `setup`; budgets may differ.
    ///
    /// # Errors
    /// What belongs to a different training, with JSON pointers into the checkpoint.
    pub(super) fn fits_gaits(&self, setup: &LearningSetup, niches: usize) -> Result<(), InputError> {
        let Self::Gaits { seed, learning, task, done, .. } = self else {
            return Err(InputError::impossible("/search", "the checkpoint was made by another search"));
        };
        let job = (setup.seed, &Learning::from(&setup.parameters), &setup.task);
        let mut faults = faults_of_origin((*seed, learning, task), job);
        if *done > niches {
            faults.push(Fault::new("/done", format!("there are not {done} gaits to be learned")));
        }
        if faults.is_empty() { Ok(()) } else { Err(InputError::Impossible(faults)) }
    }
}
