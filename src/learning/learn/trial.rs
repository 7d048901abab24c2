//! How an individual is judged: it learns in its subset, and its best behaviour is tried in one
//! continuous simulation.

use rand::Rng;

use super::cache::{Account, Additions, Cache};
use super::evaluation::World;
use super::genome::Genome;
use super::observer::Interrupted;
use super::policy::{Path, best_path, greedy_path};
use super::qlearning::{Environment, QTable, Rates, learn};
use super::subset::{Rules, Subset};
use super::task::Terms;
use super::{Behaviour, Posture};
use gaitwright_physics::motion::Player;

/// What became of an individual.
#[derive(Debug)]
pub struct Verdict<S> {
    /// m/s.
    pub fitness: f64,
    /// Its behaviour, if that passed the whole continuous check upright.
    pub proven: Option<Proven>,
    /// Transitions it simulated.
    pub additions: Additions<S>,
    /// What it cost.
    pub account: Account,
}

/// A behaviour that stayed upright over the whole continuous check.
#[derive(Debug, Clone, PartialEq)]
pub struct Proven {
    /// With its fitness over the check.
    pub behaviour: Behaviour,
    /// Its fitness at every look of the check, m/s.
    pub looks: Vec<f64>,
}

/// Learns in the subset `genome` and tries what was learned: the greedy behaviour, and beside it the
/// best cycle among the transitions it came to know, where that is another.
///
/// `bar` is what a behaviour has to exceed to be checked for longer than a trial (see [`race`]).
///
/// # Errors
/// The reason to break off.
pub fn judge<W: World>(
    rules: Rules<'_>,
    world: &mut W,
    shared: &Cache<W::State>,
    genome: &Genome,
    (generation, bar): (u32, Option<&[f64]>),
    rng: &mut impl Rng,
) -> Result<Verdict<W::State>, Interrupted> {
    let mut subset = Subset::new(rules, world, shared, genome);
    let mut table = QTable::new(&subset);
    learn(&mut subset, &mut table, &Rates::from(rules.parameters), rng)?;
    let greedy = greedy_path(&mut subset, &table)?;
    let exact = best_path(subset.situations(), &subset.edges(), subset.start_situation());
    let postures = subset.postures().to_vec();
    let (additions, mut account) = subset.into_parts();

    let transition_time = rules.parameters.transition_time;
    let stood = greedy.entry.len() as f64 * transition_time;
    let check_seconds = rules.parameters.check_seconds;
    let mut fitness = rules.objective.fallen(&Terms::default(), stood, check_seconds);
    let mut proven = None;
    let exact = exact.filter(|path| !path.same_cycle(&greedy));
    let cyclic = [Some(greedy), exact].into_iter().flatten().filter(|path| !path.cycle.is_empty());
    for (place, path) in cyclic.enumerate() {
        let behaviour = compose(&path, &postures, transition_time, generation);
        let bar = proven.as_ref().map_or(bar, |proven: &Proven| Some(&proven.looks));
        let run = race(rules, world, &behaviour, bar)?;
        account.seconds += run.seconds;
        if place == 0 || run.fitness > fitness {
            fitness = run.fitness;
            let behaviour = Behaviour { fitness, ..behaviour };
            proven = run.looks.map(|looks| Proven { behaviour, looks });
        }
    }
    Ok(Verdict { fitness, proven, additions, account })
}

/// The behaviour that takes a path through postures.
fn compose(path: &Path, postures: &[Posture], transition_time: f64, generation: u32) -> Behaviour {
    let visit = |actions: &[usize]| actions.iter().map(|&action| postures[action].clone()).collect();
    let (entry, cycle) = (visit(&path.entry), visit(&path.cycle));
    Behaviour { fitness: 0.0, generation, transition_time, entry, cycle }
}

/// How a behaviour fared in a continuous simulation.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// m/s.
    pub fitness: f64,
    /// s simulated.
    pub seconds: f64,
    /// Fitness at every look, m/s, if it stayed upright over the whole check.
    pub looks: Option<Vec<f64>>,
}

/// Plays a behaviour from the standing pose in one continuous simulation, without the cache. It is
/// looked at after the trial's time and whenever the time has doubled since, until the check's time
/// is over. What comes so far is then played from the world's disturbed starts too, and has the least
/// of its fitnesses: a motion that a breath upsets has not learned to walk.
///
/// `bar` holds the fitness that the best behaviour so far had at each look. One that is not above it
/// at some look ends there, with a fitness as far below the best's final one as it was below at that
/// look: behaviours of which one is still gathering speed, or has already turned aside, are compared
/// at the same age, and nothing unproven ranks above what is proven.
///
/// # Errors
/// The reason to break off.
pub fn race<W: World>(
    rules: Rules<'_>,
    world: &mut W,
    behaviour: &Behaviour,
    bar: Option<&[f64]>,
) -> Result<Run, Interrupted> {
    let player = player(rules, behaviour);
    let standing = world.standing().clone();
    let mut run = play(rules, world, &player, standing, bar)?;
    for start in world.disturbed().to_vec() {
        let Some(looks) = &mut run.looks else { break };
        let again = play(rules, world, &player, start, None)?;
        run.seconds += again.seconds;
        run.fitness = run.fitness.min(again.fitness);
        match (again.looks, looks.last_mut()) {
            (Some(_), Some(last)) => *last = run.fitness,
            _ => run.looks = None,
        }
    }
    Ok(run)
}

/// One continuous simulation from `start`, looked at as [`race`] says.
fn play<W: World>(
    rules: Rules<'_>,
    world: &mut W,
    player: &Player,
    start: W::State,
    bar: Option<&[f64]>,
) -> Result<Run, Interrupted> {
    let targets = |t: f64, angles: &mut [f64]| player.targets(t, angles);
    let (length, duration) = (rules.parameters.transition_steps, rules.parameters.transition_time);
    // Whole transitions are counted, so that no sum of seconds decides when to look.
    let transitions = |seconds: f64| (seconds / duration - 1e-9).ceil() as u64;
    let last = transitions(rules.parameters.check_seconds);
    let mut look = transitions(rules.parameters.trial_seconds);
    let (mut state, mut terms, mut looks) = (start, Terms::default(), Vec::new());
    let mut done = 0;
    loop {
        rules.stop.check()?;
        let outcome = world.track(&state, &targets, done * length..(done + 1) * length, rules.stop)?;
        terms += outcome.terms;
        let Some(after) = outcome.after else {
            let seconds = done as f64 * duration + outcome.seconds;
            let fitness = rules.objective.fallen(&terms, seconds, rules.parameters.check_seconds);
            return Ok(Run { fitness, seconds, looks: None });
        };
        state = after;
        done += 1;
        if done == look {
            let seconds = done as f64 * duration;
            let fitness = rules.objective.fitness(&terms, seconds);
            let best = bar.and_then(|bar| Some((*bar.get(looks.len())?, *bar.last()?)));
            looks.push(fitness);
            if look == last {
                return Ok(Run { fitness, seconds, looks: Some(looks) });
            }
            if let Some((now, finally)) = best
                && fitness <= now
            {
                return Ok(Run { fitness: finally + fitness - now, seconds, looks: None });
            }
            look = (2 * look).min(last);
        }
    }
}

/// The targets of a behaviour, as everyone else plays them.
fn player(rules: Rules<'_>, behaviour: &Behaviour) -> Player {
    Player::from_postures(
        &rules.grid.standing().angles,
        behaviour.entry.iter().map(Posture::parts),
        behaviour.cycle.iter().map(Posture::parts),
        behaviour.transition_time,
    )
}
