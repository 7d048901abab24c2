//! Training: what a task asks of a character, by the search that suits both.
//!
//! A character with legs in pairs, or a body whose joints are a row, is taught gait by gait ([`program`](crate::program)): every way of going that the
//! task calls for is a niche of its own, in which candidates compete with their like only, so that a fast hop cannot
//! crowd out a walk. What comes out is a repertoire. Any other character, any that none of its gaits keeps up, and any task that asks
//! for it, is taught by QDSEGA ([`learn`](crate::learn)), which gives one motion.
//!
//! | in the order of use | |
//! |---|---|
//! | [`niche`] | the gaits and speeds that a task calls for |
//! | `repertoire`, `niche_search` | one niche after the other: seeds, the speed that costs least, refinement, a longer comparison, proof |
//! | `qdsega` | the search without legs |
//! | [`LearnedMotion`], [`Trained`] | what comes out |
//! | [`TrainingObserver`], [`TrainingCheckpoint`] | who is informed, how to resume |
//!
//! The result depends on the setup and the seed alone, bit for bit, whatever the number of threads; unless the limit of seconds ended
//! the search or decided what was searched for: the result then says so ([`StopReason::Seconds`]).

mod checkpoint;
mod motion;
pub mod niche;
mod niche_search;
mod observer;
mod qdsega;
mod repertoire;
mod shared;
mod task_check;
mod unnamed;

use gaitwright_physics::fault::InputError;

use crate::learn::{Cancel, LearnError, LearningSetup, StopReason};
use crate::program::subject::Subject;

use checkpoint::Earlier;
pub use checkpoint::{Milestone, TrainingCheckpoint};
pub use motion::{LearnedMotion, Trained};
pub use observer::TrainingObserver;
pub use task_check::check_task;

/// Trains until everything that the task calls for is learned, the budget of the parameters is used up or `cancel` asks
/// to stop, from `resume` if given.
///
/// # Errors
/// [`LearnError`], before anything is simulated.
pub fn train(
    setup: &LearningSetup,
    observer: &mut dyn TrainingObserver,
    cancel: &Cancel,
    resume: Option<TrainingCheckpoint>,
) -> Result<Trained, LearnError> {
    if let Some(subject) = subject(setup)?
        && !matches!(resume, Some(TrainingCheckpoint::Qdsega { .. }))
    {
        let niches = niche::niches(&setup.task, &subject);
        let (trained, earlier) = repertoire::run(setup, &subject, &niches, observer, cancel, resume)?;
        if !trained.motions.is_empty() || trained.ended != StopReason::Complete {
            return Ok(trained.decided_by_the_clock(earlier.by_the_clock));
        }
        // None of its gaits keeps this character up: it is taught as one without legs, with what is left of the budget.
        return qdsega::run(setup, observer, cancel, None, earlier);
    }
    qdsega::run(setup, observer, cancel, resume, Earlier::default())
}

/// The character with its legs or its spine, where gaits are searched for one by one; `None` where QDSEGA is to search.
fn subject(setup: &LearningSetup) -> Result<Option<Subject>, InputError> {
    let LearningSetup { model, stance, scene, accuracy, task, parameters, .. } = setup;
    check_task(task, model, stance, scene)?;
    let walker = Subject::new(model, stance, scene, accuracy, task.direction).ok();
    Ok(walker.filter(|_| parameters.gait_by_gait()))
}
