//! QDSEGA: Q-learning with dynamic structuring of the exploration space by a genetic algorithm.
//!
//! A state of the learner is an angle and an angular velocity for every joint, out of a grid that is far too large to
//! be searched. A genetic algorithm ([`ga`]) chooses small subsets of it ([`genome`]). In each subset, Q-learning
//! ([`qlearning`]) finds the best behaviour ([`policy`]), and the fitness of that behaviour in one continuous
//! simulation ([`trial`]) is the fitness of the subset (Tokizaki & Hasegawa section 2.2; Ito & Matsuno 2002).
//! Transitions that were simulated once are cached ([`cache`]). What is changed in the algorithm as published is listed,
//! and can be left out, in [`Repairs`].
//!
//! | in the order of use | |
//! |---|---|
//! | [`Task`], [`Learning`], [`Parameters`] | what is asked for, and what is decided |
//! | [`Objective`], [`Terms`] | the task as a score |
//! | [`grid`], [`genome`] | all states, and subsets of them |
//! | [`transition`], [`evaluation`], [`cache`] | from one state to the next in the simulator |
//! | [`symmetry`], [`subset`] | a subset with its mirror image, as an environment |
//! | [`qlearning`], [`policy`], [`ratio`] | the best behaviour in a subset |
//! | [`trial`] | its continuous check |
//! | [`ga`], [`population`], [`search`] | the next subsets, the loop over generations |
//! | [`Observer`], [`Stop`], [`Clock`], [`Checkpoint`] | who is informed, when to stop, by which time, how to resume |
//!
//! The result depends on the setup and the seed alone, bit for bit, whatever the number of threads; unless a limit of seconds ended the
//! search, which the result then says ([`StopReason::Seconds`]).

mod behaviour;
mod breeding;
mod budget;
pub mod cache;
mod chance;
mod checkpoint;
mod clock;
pub mod evaluation;
pub mod ga;
mod generation;
pub mod genome;
pub mod grid;
mod learned;
mod levels;
pub mod limb;
mod objective;
mod observer;
mod parameters;
pub mod policy;
pub mod population;
pub mod qlearning;
pub mod ratio;
mod repairs;
pub mod search;
mod stop;
pub mod subset;
pub mod symmetry;
mod task;
pub mod transition;
pub mod trial;
mod trunk;

use std::sync::Arc;

use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::stance::Stance;

pub use behaviour::{Behaviour, Posture};
pub use breeding::{Crossover, Mutation};
pub use budget::Budget;
pub use checkpoint::Checkpoint;
pub(crate) use checkpoint::faults_of_origin;
pub use clock::Clock;
pub use generation::Generation;
pub use learned::Learned;
pub use objective::{Earnings, Objective, Terms, reference_gravity};
pub use observer::Observer;
pub use parameters::{Coding, Learning, Parameters, SearchMethod, Seeds};
pub use repairs::{Repair, Repairs};
pub use stop::{Cancel, Interrupted, Stop, StopReason};
pub use task::{ANY_GAIT, AskedSpeed, GREATEST_FROUDE, LEAST_FROUDE, Pace, SpeedWord, Task, Weights};
pub use trunk::Trunk;

/// Everything that [`learn`] needs.
#[derive(Debug, Clone)]
pub struct LearningSetup {
    /// The character.
    pub model: Arc<Model>,
    /// Its standing pose, from which every episode starts, and the gains of its drives.
    pub stance: Arc<Stance>,
    /// The world around it, with the effects that the parameters ask for ([`Trunk::in_scene`]).
    pub scene: Scene,
    /// How finely that is simulated.
    pub accuracy: Accuracy,
    /// What its motion is rewarded for.
    pub task: Task,
    /// Parameters of the learner.
    pub parameters: Parameters,
    /// Seed of all randomness.
    pub seed: u64,
    /// Worker threads, at least 1; the result does not depend on it.
    pub threads: usize,
}

/// Why a learner could not start.
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
    setup: &LearningSetup,
    observer: &mut dyn Observer,
    cancel: &Cancel,
    resume: Option<Checkpoint>,
) -> Result<Learned, LearnError> {
    let LearningSetup { model, stance, scene, accuracy, task, parameters, seed, threads } = setup;
    let objective = Objective::new(task, model, stance, reference_gravity(scene))
        .map_err(|error| error.under("/task"))?;
    let natural = parameters.repairs.has(Repair::NaturalCost);
    let objective = if natural { objective } else { objective.as_published() };
    let grid = grid::Grid::new(model, stance, task.direction, parameters);
    if let Some(checkpoint) = &resume {
        let fits = checkpoint.fits(*seed, &Learning::from(parameters), task, &grid);
        fits.map_err(|error| error.under("/checkpoint"))?;
    }
    let mirror = grid.symmetry.as_ref().map(|symmetry| symmetry.mirror().sources());
    let around = (scene, accuracy, task.direction);
    let world = evaluation::SimulatedWorld::new(model, stance, around, mirror, parameters)?;
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
