//! QDSEGA: Q-learning with dynamic structuring of the exploration space by a genetic algorithm.
//!
//! A state is an angle and an angular velocity for every joint, out of a grid far too large to be
//! searched. A genetic algorithm ([`ga`]) draws small subsets of it ([`genome`]); in each, Q-learning
//! ([`qlearning`]) finds the best behaviour ([`policy`]); what that behaviour achieves in one
//! continuous simulation ([`trial`]) decides which subsets are bred on (Tokizaki & Hasegawa section
//! 2.2; Ito & Matsuno 2002). Transitions that were simulated once are remembered ([`cache`]).
//!
//! | in the order of use | |
//! |---|---|
//! | [`Task`], [`Learning`], [`Parameters`] | what is asked for, and what is decided |
//! | [`grid`], [`genome`] | all states, and subsets of them |
//! | [`transition`], [`evaluation`], [`cache`] | from one state to the next in the simulator |
//! | [`subset`], [`qlearning`], [`policy`] | the best behaviour in a subset |
//! | [`trial`], [`ga`], [`search`] | what it achieves, the next subsets, the loop |
//! | [`Observer`], [`Checkpoint`] | who watches, and where it can be taken up again |
//!
//! The result depends on the setup and the seed alone, bit for bit, whatever the number of threads.

mod behaviour;
pub mod cache;
mod chance;
mod checkpoint;
pub mod evaluation;
pub mod ga;
pub mod genome;
pub mod grid;
pub mod limb;
mod observer;
mod parameters;
pub mod policy;
pub mod qlearning;
pub mod search;
pub mod subset;
mod task;
pub mod transition;
pub mod trial;

use std::sync::Arc;

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::stance::Stance;

pub use behaviour::{Behaviour, Posture};
pub use checkpoint::Checkpoint;
pub use observer::{Cancel, Ended, Generation, Interrupted, Observer, Stop};
pub use parameters::{Budget, Coding, Crossover, Learning, Mutation, Parameters, Trunk};
pub use task::{Objective, Task, Terms, Weights};

/// A job of the learner.
#[derive(Debug, Clone)]
pub struct Setup {
    /// Who learns.
    pub model: Arc<Model>,
    /// Where it starts, and how its joints are driven.
    pub stance: Arc<Stance>,
    /// Where it learns, with the effects that the parameters ask for ([`Trunk::in_scene`]).
    pub scene: Scene,
    /// How finely that is simulated.
    pub accuracy: Accuracy,
    /// What for.
    pub task: Task,
    /// How.
    pub parameters: Parameters,
    /// Where all randomness comes from.
    pub seed: u64,
    /// Worker threads, at least 1; the result does not depend on it.
    pub threads: usize,
}

/// The outcome.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// Why it ended.
    pub ended: Ended,
    /// `None` when no behaviour was found that stays upright through the continuous check.
    pub best: Option<Behaviour>,
    /// One point a generation.
    pub curve: Vec<Generation>,
    /// The parameters as used.
    pub parameters: Parameters,
}

/// A learner that could not start.
#[derive(Debug, thiserror::Error)]
pub enum LearnError {
    /// The setup or the checkpoint is impossible; JSON pointers below `/scene`, `/accuracy`, `/drive`,
    /// `/task` and `/checkpoint`.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The worker threads could not be started.
    #[error("the worker threads could not be started: {0}")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Learns: searches until the budget of the parameters is used up or `cancel` asks to stop, from
/// `resume` if given.
///
/// # Errors
/// [`LearnError`], before anything is simulated.
pub fn learn(
    setup: &Setup,
    observer: &mut dyn Observer,
    cancel: &Cancel,
    resume: Option<Checkpoint>,
) -> Result<Learned, LearnError> {
    let Setup { model, stance, scene, accuracy, task, parameters, seed, threads } = setup;
    let objective = Objective::new(task, model, stance).map_err(|error| error.under("/task"))?;
    let world = evaluation::SimulatedWorld::new(model, stance, scene, accuracy, parameters)?;
    let grid = grid::Grid::new(model, stance, parameters);
    if let Some(checkpoint) = &resume {
        let fits = checkpoint.fits(*seed, &Learning::from(parameters), task, model.joint_count());
        fits.map_err(|error| error.under("/checkpoint"))?;
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads((*threads).max(1)).build()?;
    let spent = resume.as_ref().map_or(0.0, |checkpoint| checkpoint.elapsed);
    let stop = Stop::new(cancel, parameters.budget.seconds().map(|seconds| seconds - spent));
    let search = search::Search {
        world,
        grid,
        task: task.clone(),
        objective,
        parameters: parameters.clone(),
        seed: *seed,
    };
    Ok(search.run(&pool, observer, &stop, resume))
}
