//! A run of CMA-ES on leg programs.

use gaitwright_physics::fault::InputError;
use rayon::ThreadPoolBuilder;

use super::arena::StudyArena;
use super::trail::{Found, Trail};
use crate::learn::{Cancel, LearnError, Stop, Trunk};
use crate::program::refine::{PAIRED, Refinement};
use crate::program::rollout::STRIDES;
use crate::program::starts::Starts;

/// Searches until `seconds` have been simulated; the generation in which they are is the last.
///
/// One gait is searched for: the first of those that are used at the speed asked for and have their usual speed there.
pub(super) fn run(arena: &StudyArena, seed: u64, seconds: f64) -> Result<Trail, LearnError> {
    let none = || InputError::impossible("", "no gait is used at this speed");
    let off = |froude: f64| (froude / super::arena::FROUDE).ln().abs();
    let gaits = arena.gaits();
    let gait =
        gaits.into_iter().min_by(|a, b| off(a.froude[1]).total_cmp(&off(b.froude[1]))).ok_or_else(none)?;
    let wanted = arena.wanted(gait);
    let trials = arena.arena(Trunk::Free)?;
    let pool = ThreadPoolBuilder::new().num_threads(1).build()?;
    let stop = Stop::new(&Cancel::default(), None);
    let subject = &arena.subject;
    let starts = subject.seeds(&wanted.gait);
    let chances = (STRIDES, PAIRED, seed);
    let starts = Starts::new((&pool, &stop), subject, &trials, &wanted, &starts, STRIDES);
    // Nothing stops it.
    let Ok(starts) = starts else { return Ok(Trail::default()) };
    let mut search = Refinement::new(subject, &wanted, (&starts, 0), chances);
    // What the starts took is part of the budget.
    search.seconds += starts.seconds;
    let mut trail = Trail::default();
    let mut least = f64::INFINITY;
    loop {
        let best = search.best();
        if best.cost < least {
            least = best.cost;
            let behaviour = best.ring.behaviour(-least, 0);
            trail.found.push(Found { at: search.seconds, behaviour, gains: best.gains.clone() });
        }
        trail.simulated = search.seconds;
        if search.seconds >= seconds || search.generation((&pool, &stop), subject, &trials, &wanted).is_err()
        {
            return Ok(trail);
        }
    }
}
