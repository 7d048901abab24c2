//! How an individual is evaluated: Q-learning in its subset, then the continuous check of the behaviour it learned.

use rand::Rng;

use super::behaviour::{Behaviour, Posture};
use super::cache::{Additions, Cache, SimulationTotals};
use super::evaluation::World;
use super::genome::Genome;
use super::objective::Terms;
use super::parameters::{Coding, Parameters};
use super::policy::{ActionPath, greedy_path};
use super::qlearning::{QTable, Rates, learn};
use super::ratio::best_path;
use super::repairs::Repair;
use super::stop::Interrupted;
use super::subset::{SearchContext, Subset, TimedPosture};
use gaitwright_physics::motion::{Player, hermite, hermite_rate};

/// The result of evaluating an individual.
#[derive(Debug)]
pub struct IndividualVerdict<S> {
    /// m/s: that of its better behaviour in the continuous check, see [`run_check`].
    pub fitness: f64,
    /// That behaviour, if it stayed upright over the whole check.
    pub accepted: Option<AcceptedBehaviour>,
    /// That behaviour, if it stayed upright to the first inspection and was not checked any further.
    pub candidate: Option<Behaviour>,
    /// What each state of the genome is worth, where states are individuals; empty otherwise.
    pub worths: Vec<f64>,
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
/// greatest reward per time among the transitions that were tried, where the two differ.
///
/// `incumbent` is the fitness of the island's best behaviour at each inspection (see [`run_check`]); where there is none,
/// a bounded start goes no further than the first inspection.
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
    let parameters = context.parameters;
    let mut subset = Subset::new(context, world, shared, genome);
    let mut table = QTable::new(&subset);
    learn(&mut subset, &mut table, &Rates::from(parameters), rng)?;
    let folded = greedy_path(&mut subset, &table)?;
    let exact = if parameters.repairs.has(Repair::BestCycle) {
        best_path(subset.unfolded_situations(), &subset.edges(), subset.start_situation())
    } else {
        None
    };
    let worths = match parameters.coding {
        Coding::Chromosome => Vec::new(),
        Coding::Population => subset.worths(&table, &folded),
    };
    let greedy = subset.unfolded(&folded);
    let (standing, keyframes) = (context.grid.standing(), subset.keyframes());
    let (additions, totals) = subset.into_parts();

    let beats: u32 = greedy.entry.iter().map(|&action| u32::from(keyframes[action].beats)).sum();
    let stood = f64::from(beats) * parameters.beat();
    let fitness = context.objective.fallen(&Terms::default(), stood, parameters.check_seconds);
    let bar = match incumbent {
        Some(inspections) => Bar::Incumbent(inspections),
        None if parameters.repairs.has(Repair::BoundedStart) => Bar::FirstInspection,
        None => Bar::None,
    };
    let mut verdict =
        IndividualVerdict { fitness, accepted: None, candidate: None, worths, additions, totals };
    let exact = exact.filter(|path| !path.same_cycle(&greedy));
    let cyclic = [Some(greedy), exact].into_iter().flatten().filter(|path| !path.cycle.is_empty());
    for (place, path) in cyclic.enumerate() {
        let behaviour = compose(&path, (&standing, &keyframes), parameters, generation);
        let bar = verdict.accepted.as_ref().map_or(bar, |accepted| Bar::Incumbent(&accepted.inspections));
        let run = run_check(context, world, &behaviour, bar)?;
        verdict.totals.seconds += run.seconds;
        if place == 0 || run.fitness > verdict.fitness {
            verdict.fitness = run.fitness;
            let behaviour = Behaviour { fitness: run.fitness, ..behaviour };
            verdict.candidate = run.unfinished.then(|| behaviour.clone());
            verdict.accepted =
                run.inspections.map(|inspections| AcceptedBehaviour { behaviour, inspections });
        }
    }
    Ok(verdict)
}

/// Gives the whole check to the behaviour of a verdict that has gone no further than the first inspection, and adds what
/// it shows to the verdict.
///
/// # Errors
/// The reason of `stop` to break off.
pub fn prove<W: World>(
    context: SearchContext<'_>,
    world: &mut W,
    verdict: &mut IndividualVerdict<W::State>,
) -> Result<(), Interrupted> {
    let Some(behaviour) = verdict.candidate.take() else { return Ok(()) };
    let run = run_check(context, world, &behaviour, Bar::None)?;
    verdict.totals.seconds += run.seconds;
    verdict.fitness = run.fitness;
    let behaviour = Behaviour { fitness: run.fitness, ..behaviour };
    verdict.accepted = run.inspections.map(|inspections| AcceptedBehaviour { behaviour, inspections });
    Ok(())
}

/// The behaviour that visits the keyframes of a path, written beat by beat: within a transition of several beats, what its
/// spline passes through after each becomes a posture of its own, which changes no target.
pub fn compose(
    path: &ActionPath,
    (standing, keyframes): (&Posture, &[TimedPosture]),
    parameters: &Parameters,
    generation: u32,
) -> Behaviour {
    let beat = parameters.beat();
    let mut from = standing;
    // Everything up to the next keyframe, which is left out.
    let mut between = |to: &usize| {
        let TimedPosture { posture, beats } = &keyframes[*to];
        let passed = (1..*beats).map(|count| passed(from, posture, (beat, *beats), count));
        let passed: Vec<Posture> = passed.collect();
        from = posture;
        passed
    };
    let (mut entry, mut cycle) = (Vec::new(), Vec::new());
    for action in &path.entry {
        entry.extend(between(action));
        entry.push(keyframes[*action].posture.clone());
    }
    for (place, action) in path.cycle.iter().enumerate() {
        if place == 0 { &mut entry } else { &mut cycle }.extend(between(action));
        cycle.push(keyframes[*action].posture.clone());
    }
    cycle.extend(path.cycle.first().map(between).unwrap_or_default());
    Behaviour { fitness: 0.0, generation, transition_time: beat, entry, cycle, steering: None }
}

/// Where the spline between two postures is after `count` of its beats, of so many seconds.
fn passed(from: &Posture, to: &Posture, (beat, beats): (f64, u8), count: u8) -> Posture {
    let (duration, time) = (beat * f64::from(beats), beat * f64::from(count));
    let joints = || {
        let end = |posture: &Posture, joint: usize| (posture.angles[joint], posture.velocities[joint]);
        (0..from.angles.len()).map(move |joint| (end(from, joint), end(to, joint)))
    };
    Posture {
        angles: joints().map(|(from, to)| hermite(from, to, duration, time)).collect(),
        velocities: joints().map(|(from, to)| hermite_rate(from, to, duration, time)).collect(),
    }
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
    /// Whether the check ended upright at the first inspection because it was to go no further.
    pub unfinished: bool,
}

/// What a behaviour has to exceed for its check to go on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bar<'a> {
    /// Nothing.
    None,
    /// The check goes no further than the first inspection.
    FirstInspection,
    /// The fitness of the best behaviour so far at each inspection.
    Incumbent(&'a [f64]),
}

/// The continuous check: plays a behaviour from the standing pose in one continuous simulation, without the cache.
/// Its fitness is inspected after the trial's time and each time that has doubled, until the check's time is over. A
/// behaviour that stays upright so far is also played from the world's disturbed starts, and its fitness is the least
/// of all: a motion that a small push ends is not robust.
///
/// A behaviour that does not exceed the incumbent of the `bar` at an inspection ends there, with a fitness as far below the incumbent's final one as it was below at that
/// inspection. Behaviours that are still accelerating or already drifting are thus compared at the same time since
/// the start, and none that was not fully checked ranks above the incumbent.
///
/// # Errors
/// The reason of `stop` to break off.
pub fn run_check<W: World>(
    context: SearchContext<'_>,
    world: &mut W,
    behaviour: &Behaviour,
    bar: Bar<'_>,
) -> Result<CheckResult, Interrupted> {
    let player = behaviour.player(&context.grid.standing().angles);
    let standing = world.standing().clone();
    let mut run = play(context, world, &player, standing, bar)?;
    for start in world.disturbed().to_vec() {
        let Some(inspections) = &mut run.inspections else { break };
        let again = play(context, world, &player, start, Bar::None)?;
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
    bar: Bar<'_>,
) -> Result<CheckResult, Interrupted> {
    let parameters = &context.parameters;
    let targets = |t: f64, angles: &mut [f64]| player.targets(t, angles);
    let (length, duration) = (parameters.beat_steps(), parameters.beat());
    // Whole beats are counted, so that rounding of times cannot shift an inspection.
    let beats = |seconds: f64| (seconds / duration - 1e-9).ceil() as u64;
    let last = beats(parameters.check_seconds);
    let mut next_inspection = beats(parameters.trial_seconds);
    let (mut state, mut terms, mut inspections) = (start, Terms::default(), Vec::new());
    let mut done = 0;
    loop {
        context.stop.check()?;
        let outcome = world.track(&state, &targets, done * length..(done + 1) * length, context.stop)?;
        terms += outcome.terms;
        let Some(after) = outcome.after else {
            let seconds = done as f64 * duration + outcome.seconds;
            let fitness = context.objective.fallen(&terms, seconds, parameters.check_seconds);
            return Ok(CheckResult { fitness, seconds, inspections: None, unfinished: false });
        };
        state = after;
        done += 1;
        if done == next_inspection {
            let seconds = done as f64 * duration;
            let fitness = context.objective.fitness(&terms, seconds);
            let best = match bar {
                Bar::Incumbent(incumbent) => {
                    incumbent.get(inspections.len()).copied().zip(incumbent.last().copied())
                }
                Bar::None | Bar::FirstInspection => None,
            };
            inspections.push(fitness);
            if next_inspection == last {
                let inspections = Some(inspections);
                return Ok(CheckResult { fitness, seconds, inspections, unfinished: false });
            }
            if bar == Bar::FirstInspection {
                return Ok(CheckResult { fitness, seconds, inspections: None, unfinished: true });
            }
            if let Some((now, finally)) = best
                && fitness <= now
            {
                let fitness = finally + fitness - now;
                return Ok(CheckResult { fitness, seconds, inspections: None, unfinished: false });
            }
            next_inspection = (2 * next_inspection).min(last);
        }
    }
}
