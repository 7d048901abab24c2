//! The search gait by gait: one niche after the other.

use rayon::ThreadPoolBuilder;

use super::checkpoint::{Earlier, TrainingCheckpoint};
use super::motion::Trained;
use super::niche::Niche;
use super::niche_search::NicheSearch;
use super::observer::TrainingObserver;
use super::shared::{Progress, Shared};
use crate::learn::{Cancel, Interrupted, LearnError, Learning, LearningSetup, Stop, StopReason};
use crate::program::legs::Legs;
use crate::program::rollout::Arena;
use crate::program::subject::Subject;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::scene::{Accuracy, SolverChoice, SolverKind};

/// Longest step of the coarse part of the search, in √(h / g).
const COARSEST: f64 = 0.025;

/// Sweeps of the solver where a body without legs is searched for waves.
const SWEEPS: u32 = 100;
/// Residual at which the solver then ends, in √(g h): a hundredth of a per cent of usual speeds.
const ROUGH: f64 = 5e-5;

/// Searches for the motion of each of `niches`; with what was learned comes what another search after it has to know.
///
/// # Errors
/// [`LearnError`], before anything is simulated.
pub(super) fn run(
    setup: &LearningSetup,
    subject: &Subject,
    niches: &[Niche],
    observer: &mut dyn TrainingObserver,
    cancel: &Cancel,
    resume: Option<TrainingCheckpoint>,
) -> Result<(Trained, Earlier), LearnError> {
    let mut progress = Progress::new(cancel.clock());
    let mut next = 0;
    if let Some(checkpoint) = resume {
        checkpoint.fits_gaits(setup, niches.len()).map_err(|error| error.under("/checkpoint"))?;
        if let TrainingCheckpoint::Gaits {
            done, milestones, curve, simulated, elapsed, by_the_clock, ..
        } = checkpoint
        {
            next = done;
            progress =
                Progress::resumed(cancel.clock(), milestones, curve, simulated, (elapsed, by_the_clock));
        }
    }
    let seconds = setup.parameters.budget.seconds();
    let stop = Stop::new(cancel, seconds.map(|seconds| seconds - progress.spent));
    let shared = Shared {
        setup,
        subject,
        fine: at(subject, searched(setup.accuracy, subject))?.until(&stop),
        coarse: at(subject, searched(coarse(setup, subject), subject))?.until(&stop),
        pool: ThreadPoolBuilder::new().num_threads(setup.threads.max(1)).build()?,
        stop,
    };
    let mut ended = StopReason::Complete;
    for index in next..niches.len() {
        if let Some(reason) = shared.used_up(&progress) {
            ended = reason;
            break;
        }
        let search = NicheSearch::new(&shared, (index, niches), &mut progress, observer);
        let (motion, outcome) = search.run();
        if let Some(motion) = motion {
            progress.show(motion, true, observer);
        }
        if let Err(Interrupted(reason)) = outcome {
            ended = reason;
            break;
        }
        observer.checkpoint(&checkpoint(setup, index + 1, &progress));
    }
    if ended == StopReason::Complete
        && let Some(reason) = shared.used_up(&progress)
    {
        ended = reason;
    }
    let spent = progress.elapsed();
    let Progress { milestones, curve, by_the_clock, .. } = progress;
    let finished = milestones.iter().filter(|milestone| milestone.finished);
    let motions = finished.map(|milestone| milestone.motion.clone()).collect();
    let earlier = Earlier { curve: curve.clone(), milestones, spent, by_the_clock };
    Ok((Trained { ended, motions, curve }, earlier))
}

/// Where `subject` is tried with another accuracy.
fn at(subject: &Subject, accuracy: Accuracy) -> Result<Arena, InputError> {
    Subject { accuracy, ..subject.clone() }.arena()
}

/// `accuracy` as it serves the search. Feet with soles have more contacts than they need to stand, so that the last digits of their
/// forces take the solver most of its time; a body that lies on the ground has so many that a few sweeps are best. Rough forces move
/// both as far, and what is found is checked with exact ones.
fn searched(accuracy: Accuracy, subject: &Subject) -> Accuracy {
    let Legs { spine, legs, hip_height, .. } = &*subject.legs;
    let rough = ROUGH * (subject.gravity() * hip_height).sqrt();
    let roughly = SolverChoice { tolerance: accuracy.solver.tolerance.max(rough), ..accuracy.solver };
    let solver = if spine.is_some() {
        SolverChoice { kind: SolverKind::Pgs, iterations: SWEEPS, ..roughly }
    } else if legs.iter().any(|leg| leg.keeps_level()) {
        roughly
    } else {
        accuracy.solver
    };
    Accuracy { solver, ..accuracy }
}

/// The accuracy of the coarse part of the search: twice the step, where that is short beside the character's own time.
fn coarse(setup: &LearningSetup, subject: &Subject) -> Accuracy {
    let step = setup.accuracy.step;
    let longest = COARSEST * (subject.legs.hip_height / subject.gravity()).sqrt();
    Accuracy { step: (2.0 * step).min(longest).max(step), ..setup.accuracy }
}

fn checkpoint(setup: &LearningSetup, done: usize, progress: &Progress) -> TrainingCheckpoint {
    TrainingCheckpoint::Gaits {
        seed: setup.seed,
        learning: Box::new(Learning::from(&setup.parameters)),
        task: setup.task.clone(),
        done,
        milestones: progress.milestones.clone(),
        curve: progress.curve.clone(),
        simulated: progress.simulated,
        elapsed: progress.elapsed(),
        by_the_clock: progress.by_the_clock || progress.hurried,
    }
}
