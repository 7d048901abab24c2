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
use crate::motion::Player;

/// What became of an individual.
#[derive(Debug)]
pub struct Verdict<S> {
    /// m/s.
    pub fitness: f64,
    /// The behaviour, if it passed the whole continuous check upright.
    pub proven: Option<Behaviour>,
    /// Transitions it simulated.
    pub additions: Additions<S>,
    /// What it cost.
    pub account: Account,
}

/// Learns in the subset `genome` and tries what was learned: the greedy behaviour, and beside it the
/// best cycle among the transitions it came to know, where that is another.
///
/// `bar` is the fitness that a behaviour has to exceed to be checked for longer than a trial.
///
/// # Errors
/// The reason to break off.
pub fn judge<W: World>(
    rules: Rules<'_>,
    world: &mut W,
    shared: &Cache<W::State>,
    genome: &Genome,
    (generation, bar): (u32, Option<f64>),
    rng: &mut impl Rng,
) -> Result<Verdict<W::State>, Interrupted> {
    let mut subset = Subset::new(rules, world, shared, genome);
    let mut table = QTable::new(&subset);
    learn(&mut subset, &mut table, &Rates::from(&rules.parameters.learning), rng)?;
    let greedy = greedy_path(&mut subset, &table)?;
    let exact = best_path(subset.situations(), &subset.edges(), subset.start_situation());
    let postures = subset.postures().to_vec();
    let (additions, mut account) = subset.into_parts();

    let transition_time = rules.parameters.transition_time;
    let stood = greedy.entry.len() as f64 * transition_time;
    let check_seconds = rules.parameters.learning.check_seconds;
    let (mut fitness, mut proven) = (rules.objective.fallen(&Terms::default(), stood, check_seconds), None);
    let exact = exact.filter(|path| !path.same_cycle(&greedy));
    let cyclic = [Some(greedy), exact].into_iter().flatten().filter(|path| !path.cycle.is_empty());
    for (place, path) in cyclic.enumerate() {
        let behaviour = compose(&path, &postures, transition_time, generation);
        let bar = if place == 0 { bar } else { Some(bar.map_or(fitness, |bar| bar.max(fitness))) };
        let run = race(rules, world, &behaviour, bar)?;
        account.seconds += run.seconds;
        if place == 0 || run.fitness > fitness {
            fitness = run.fitness;
            proven = run.proven.then_some(Behaviour { fitness, ..behaviour });
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
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// m/s.
    pub fitness: f64,
    /// s simulated.
    pub seconds: f64,
    /// Whether it stayed upright over the whole check.
    pub proven: bool,
}

/// Plays a behaviour from the standing pose in one continuous simulation, without the cache. It is
/// looked at after the trial's time and whenever the time has doubled since, until the check's time
/// is over, and goes on only as long as its fitness so far exceeds `bar`.
///
/// # Errors
/// The reason to break off.
pub fn race<W: World>(
    rules: Rules<'_>,
    world: &mut W,
    behaviour: &Behaviour,
    bar: Option<f64>,
) -> Result<Run, Interrupted> {
    let learning = &rules.parameters.learning;
    let player = player(rules, behaviour);
    let targets = |t: f64, angles: &mut [f64]| player.targets(t, angles);
    let (length, duration) = (rules.parameters.transition_steps, rules.parameters.transition_time);
    // Whole transitions are counted, so that no sum of seconds decides when to look.
    let transitions = |seconds: f64| (seconds / duration - 1e-9).ceil() as u64;
    let last = transitions(learning.check_seconds);
    let mut look = transitions(learning.trial_seconds);
    let mut state = world.standing().clone();
    let mut terms = Terms::default();
    let mut done = 0;
    loop {
        rules.stop.check()?;
        let outcome = world.track(&state, &targets, done * length..(done + 1) * length);
        terms += outcome.terms;
        let Some(after) = outcome.after else {
            let seconds = done as f64 * duration + outcome.seconds;
            let fitness = rules.objective.fallen(&terms, seconds, learning.check_seconds);
            return Ok(Run { fitness, seconds, proven: false });
        };
        state = after;
        done += 1;
        if done == look {
            let seconds = done as f64 * duration;
            let fitness = rules.objective.fitness(&terms, seconds);
            let proven = look == last;
            if proven || bar.is_some_and(|bar| fitness <= bar) {
                return Ok(Run { fitness, seconds, proven });
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
