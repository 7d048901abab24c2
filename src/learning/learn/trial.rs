//! How an individual is evaluated: Q-learning in its subset, then the continuous check of the behaviour it learned.

use rand::Rng;

use super::behaviour::{Behaviour, Posture};
use super::cache::{Additions, Cache, SimulationTotals};
use super::evaluation::World;
use super::genome::Genome;
use super::objective::Terms;
use super::parameters::SearchMethod;
use super::policy::{ActionPath, best_path, greedy_path};
use super::qlearning::{Environment, QTable, Rates, learn};
use super::stop::Interrupted;
use super::subset::{SearchContext, Subset};
use gaitwright_physics::motion::Player;

/// The result of evaluating an individual.
#[derive(Debug)]
pub struct IndividualVerdict<S> {
    /// m/s: that of its better behaviour in the continuous check, see [`run_check`].
    pub fitness: f64,
    /// That behaviour, if it stayed upright over the whole check.
    pub accepted: Option<AcceptedBehaviour>,
    /// Transitions it simulated, to be merged into the shared cache.
    pub additions: Additions<S>,
    /// How much was simulated for it.
    pub totals: SimulationTotals,
}

/// A behaviour that stayed upright over the whole continuous check.
#[derive(Debug, Clone, PartialEq)]
pub struct AcceptedBehaviour {
    /// The behaviour, with its fitness in the check.
    pub behaviour: Behaviour,
    /// Its fitness at every inspection of the check, m/s.
    pub inspections: Vec<f64>,
}

/// Learns in the subset `genome` and checks what was learned: the behaviour of the greedy policy, and the cycle of
/// greatest mean reward among the transitions that were tried, where the two differ.
///
/// `incumbent` is the fitness of the island's best behaviour at each inspection (see [`run_check`]).
///
/// # Errors
/// The reason of `stop` to break off.
pub fn judge<W: World>(
    context: SearchContext<'_>,
    world: &mut W,
    shared: &Cache<W::State>,
    genome: &Genome,
    (generation, incumbent): (u32, Option<&[f64]>),
    rng: &mut impl Rng,
) -> Result<IndividualVerdict<W::State>, Interrupted> {
    let mut subset = Subset::new(context, world, shared, genome);
    let mut table = QTable::new(&subset);
    learn(&mut subset, &mut table, &Rates::from(context.parameters), rng)?;
    let greedy = greedy_path(&mut subset, &table)?;
    let exact = match context.parameters.search {
        SearchMethod::Natural => best_path(subset.situations(), &subset.edges(), subset.start_situation()),
        SearchMethod::Paper => None,
    };
    let postures = subset.postures().to_vec();
    let (additions, mut totals) = subset.into_parts();

    let transition_time = context.parameters.transition_time;
    let stood = greedy.entry.len() as f64 * transition_time;
    let check_seconds = context.parameters.check_seconds;
    let mut fitness = context.objective.fallen(&Terms::default(), stood, check_seconds);
    let mut accepted = None;
    let exact = exact.filter(|path| !path.same_cycle(&greedy));
    let cyclic = [Some(greedy), exact].into_iter().flatten().filter(|path| !path.cycle.is_empty());
    for (place, path) in cyclic.enumerate() {
        let behaviour = compose(&path, &postures, transition_time, generation);
        let incumbent =
            accepted.as_ref().map_or(incumbent, |accepted: &AcceptedBehaviour| Some(&accepted.inspections));
        let run = run_check(context, world, &behaviour, incumbent)?;
        totals.seconds += run.seconds;
        if place == 0 || run.fitness > fitness {
            fitness = run.fitness;
            let behaviour = Behaviour { fitness, ..behaviour };
            accepted = run.inspections.map(|inspections| AcceptedBehaviour { behaviour, inspections });
        }
    }
    Ok(IndividualVerdict { fitness, accepted, additions, totals })
}

/// The behaviour that visits the postures of a path.
fn compose(path: &ActionPath, postures: &[Posture], transition_time: f64, generation: u32) -> Behaviour {
    let visit = |actions: &[usize]| actions.iter().map(|&action| postures[action].clone()).collect();
    let (entry, cycle) = (visit(&path.entry), visit(&path.cycle));
    Behaviour { fitness: 0.0, generation, transition_time, entry, cycle }
}

/// The result of a continuous check.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckResult {
    /// m/s.
    pub fitness: f64,
    /// Simulated time, s.
    pub seconds: f64,
    /// Fitness at every inspection, m/s, if the character stayed upright over the whole check.
    pub inspections: Option<Vec<f64>>,
}

/// The continuous check: plays a behaviour from the standing pose in one continuous simulation, without the cache.
/// Its fitness is inspected after the trial's time and each time that has doubled, until the check's time is over. A
/// behaviour that stays upright so far is also played from the world's disturbed starts, and its fitness is the least
/// of all: a motion that a small push ends is not robust.
///
/// `incumbent` holds the fitness of the best behaviour so far at each inspection. A behaviour that does not exceed it
/// at an inspection ends there, with a fitness as far below the incumbent's final one as it was below at that
/// inspection. Behaviours that are still accelerating or already drifting are thus compared at the same time since
/// the start, and none that was not fully checked ranks above the incumbent.
///
/// # Errors
/// The reason of `stop` to break off.
pub fn run_check<W: World>(
    context: SearchContext<'_>,
    world: &mut W,
    behaviour: &Behaviour,
    incumbent: Option<&[f64]>,
) -> Result<CheckResult, Interrupted> {
    let player = player(context, behaviour);
    let standing = world.standing().clone();
    let mut run = play(context, world, &player, standing, incumbent)?;
    for start in world.disturbed().to_vec() {
        let Some(inspections) = &mut run.inspections else { break };
        let again = play(context, world, &player, start, None)?;
        run.seconds += again.seconds;
        run.fitness = run.fitness.min(again.fitness);
        match (again.inspections, inspections.last_mut()) {
            (Some(_), Some(last)) => *last = run.fitness,
            _ => run.inspections = None,
        }
    }
    Ok(run)
}

/// One continuous simulation from `start`, inspected as [`run_check`] describes.
fn play<W: World>(
    context: SearchContext<'_>,
    world: &mut W,
    player: &Player,
    start: W::State,
    incumbent: Option<&[f64]>,
) -> Result<CheckResult, Interrupted> {
    let parameters = &context.parameters;
    let targets = |t: f64, angles: &mut [f64]| player.targets(t, angles);
    let (length, duration) = (context.parameters.transition_steps, context.parameters.transition_time);
    // Whole transitions are counted, so that rounding of times cannot shift an inspection.
    let transitions = |seconds: f64| (seconds / duration - 1e-9).ceil() as u64;
    let last = transitions(parameters.check_seconds);
    let mut next_inspection = transitions(parameters.trial_seconds);
    let (mut state, mut terms, mut inspections) = (start, Terms::default(), Vec::new());
    let mut done = 0;
    loop {
        context.stop.check()?;
        let outcome = world.track(&state, &targets, done * length..(done + 1) * length, context.stop)?;
        terms += outcome.terms;
        let Some(after) = outcome.after else {
            let seconds = done as f64 * duration + outcome.seconds;
            let fitness = context.objective.fallen(&terms, seconds, parameters.check_seconds);
            return Ok(CheckResult { fitness, seconds, inspections: None });
        };
        state = after;
        done += 1;
        if done == next_inspection {
            let seconds = done as f64 * duration;
            let fitness = context.objective.fitness(&terms, seconds);
            let best = incumbent
                .and_then(|incumbent| Some((*incumbent.get(inspections.len())?, *incumbent.last()?)));
            inspections.push(fitness);
            if next_inspection == last {
                return Ok(CheckResult { fitness, seconds, inspections: Some(inspections) });
            }
            if let Some((now, finally)) = best
                && fitness <= now
            {
                return Ok(CheckResult { fitness: finally + fitness - now, seconds, inspections: None });
            }
            next_inspection = (2 * next_inspection).min(last);
        }
    }
}

/// The joint targets of a behaviour over time, as a finished motion plays them.
fn player(context: SearchContext<'_>, behaviour: &Behaviour) -> Player {
    Player::from_postures(
        &context.grid.standing().angles,
        behaviour.entry.iter().map(Posture::parts),
        behaviour.cycle.iter().map(Posture::parts),
        behaviour.transition_time,
    )
}
