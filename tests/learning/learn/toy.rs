//! The search on a toy world whose best behaviour is known.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use super::{Notes, plain_grid, plain_task, timeless};
use gaitwright_learning::learn::cache::{Cache, TrackedTransition, TransitionKey};
use gaitwright_learning::learn::evaluation::{Targets, TrackingOutcome, World};
use gaitwright_learning::learn::genome::Genome;
use gaitwright_learning::learn::grid::{GridState, Level};
use gaitwright_learning::learn::qlearning::{self, QTable, Rates};
use gaitwright_learning::learn::search::Search;
use gaitwright_learning::learn::subset::{SearchContext, Subset};
use gaitwright_learning::learn::trial::{Bar, run_check};
use gaitwright_learning::learn::{
    Behaviour, Cancel, Checkpoint, Interrupted, Learned, Learning, Objective, Parameters, Posture, Repair,
    Repairs, Stop, StopReason, Terms,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A sledge with a one-way brake, pushed by joint 0: it advances by every increase of the joint's
/// target, and nothing moves it back. Its best behaviour swings between the ends of the range: it
/// gains the whole range every second transition. Joint 1 tips it over beyond `tip`.
#[derive(Debug, Clone)]
pub struct Sledge {
    pub standing: f64,
    pub disturbed: Vec<f64>,
    pub tip: f64,
    pub step: f64,
    pub calls: Arc<AtomicU64>,
}

impl Sledge {
    pub fn new() -> Self {
        Self { standing: 0.0, disturbed: Vec::new(), tip: f64::INFINITY, step: 0.01, calls: Arc::default() }
    }
}

impl World for Sledge {
    /// Angle of joint 0.
    type State = f64;

    fn standing(&self) -> &f64 {
        &self.standing
    }

    fn disturbed(&self) -> &[f64] {
        &self.disturbed
    }

    fn track(
        &mut self,
        state: &f64,
        targets: Targets<'_>,
        steps: Range<u64>,
        _: &Stop,
    ) -> Result<TrackingOutcome<f64>, Interrupted> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        let mut angles = [0.0; 2];
        targets(steps.end as f64 * self.step, &mut angles);
        let fell = angles[1] > self.tip;
        let terms = Terms { displacement: [(angles[0] - state).max(0.0), 0.0], ..Terms::default() };
        let seconds = (steps.end - steps.start) as f64 * self.step;
        Ok(TrackingOutcome { terms, seconds, heading: 0.0, after: (!fell).then_some(angles[0]) })
    }

    fn mirrored(&self, state: &f64) -> f64 {
        *state
    }

    fn cells(&self) -> usize {
        1
    }

    fn cell(&self, _: &f64) -> usize {
        0
    }
}

/// 24 individuals of 4 states, 20 generations, T = 0.1 s, in steps of 0.01 s.
pub fn toy_learning() -> Learning {
    Learning {
        generations: Some(20),
        seconds: None,
        population: 12,
        islands: 2,
        states: 4,
        migration: 3,
        patience: 4,
        cache_generations: 4,
        transition_time: Some(0.1),
        repairs: Repairs::default().without(Repair::TransitionTimes),
        ..Learning::default()
    }
}

pub fn toy_parameters(learning: Learning) -> Parameters {
    learning.resolve_with(0.1, 0.01).unwrap()
}

pub fn toy_search(world: Sledge, learning: Learning, seed: u64) -> Search<Sledge> {
    Search {
        world,
        grid: plain_grid(),
        task: plain_task(),
        objective: Objective::of(&plain_task(), 1.0, 0.3, 9.81).unwrap(),
        parameters: toy_parameters(learning),
        seed,
    }
}

pub fn run_toy(search: &Search<Sledge>, threads: usize, resume: Option<Checkpoint>) -> (Learned, Notes) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut notes = Notes::default();
    let learned = search.run(&pool, &mut notes, &Stop::new(&Cancel::default(), None), resume);
    (learned, notes)
}

#[test]
fn the_toys_best_behaviour_is_found() {
    let learning = Learning { generations: Some(60), ..toy_learning() };
    let (learned, notes) = run_toy(&toy_search(Sledge::new(), learning, 3), 2, None);
    let best = learned.best.unwrap();
    // From −0.6 to 0.6 and back, 0.1 s each: 6 m/s, less or more at the start of 20 s by 0.6 m at most.
    assert!((best.fitness - 6.0).abs() <= 0.6 / 20.0 + 1e-9, "{}", best.fitness);
    assert_eq!(best.cycle.len(), 2);
    assert_eq!(learned.ended, StopReason::Generations);
    assert_eq!(learned.curve, notes.generations);
    assert_eq!(notes.improved.last(), Some(&best));
    assert!(notes.improved.windows(2).all(|pair| pair[1].fitness > pair[0].fitness));
    assert!(learned.curve.windows(2).all(|pair| pair[1].simulated_seconds > pair[0].simulated_seconds));
}

#[test]
fn threads_and_interruptions_change_no_bit() {
    let world = || Sledge { tip: 0.2, ..Sledge::new() };
    let search = toy_search(world(), toy_learning(), 11);
    let (alone, notes) = run_toy(&search, 1, None);
    let alone = timeless(alone);
    assert!(alone.best.is_some());
    for threads in [2, 3] {
        assert_eq!(timeless(run_toy(&search, threads, None).0), alone);
    }
    assert_eq!(notes.checkpoints.len(), 5);
    for checkpoint in &notes.checkpoints {
        let bytes = serde_json::to_vec(checkpoint).unwrap();
        let read: Checkpoint = serde_json::from_slice(&bytes).unwrap();
        assert_eq!(read, *checkpoint);
        assert_eq!(timeless(run_toy(&search, 2, Some(read)).0), alone);
    }
    let other = toy_search(world(), toy_learning(), 12);
    assert_ne!(timeless(run_toy(&other, 1, None).0).curve, alone.curve, "another seed is another run");
}

#[test]
fn a_cancelled_search_keeps_what_it_found() {
    let learning = Learning { generations: None, ..toy_learning() };
    let search = toy_search(Sledge::new(), learning, 3);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let cancel = Cancel::default();
    let mut notes = Notes { cancel_after: Some((3, cancel.clone())), ..Notes::default() };
    let learned = search.run(&pool, &mut notes, &Stop::new(&cancel, None), None);
    assert_eq!((learned.ended, learned.curve.len()), (StopReason::Cancelled, 3));
    assert!(learned.best.is_some());
    let out_of_time =
        search.run(&pool, &mut Notes::default(), &Stop::new(&Cancel::default(), Some(0.0)), None);
    assert_eq!((out_of_time.ended, out_of_time.curve.len()), (StopReason::Seconds, 0));
}

#[test]
fn the_cache_counts_what_it_saves_and_changes_no_deterministic_world() {
    let world = Sledge { tip: 0.2, ..Sledge::new() };
    let grid = plain_grid();
    let parameters = toy_parameters(toy_learning());
    let objective = Objective::of(&plain_task(), 1.0, 0.3, 9.81).unwrap();
    let stop = Stop::new(&Cancel::default(), None);
    let context = SearchContext { grid: &grid, objective: &objective, parameters: &parameters, stop: &stop };
    let genome = Genome::random(&grid, 4, true, &mut ChaCha8Rng::seed_from_u64(1));
    let rates = Rates::from(&parameters);
    let learn_in = |shared: &Cache<f64>| {
        let mut world = Sledge { calls: Arc::default(), ..world.clone() };
        let mut subset = Subset::new(context, &mut world, shared, &genome);
        let mut table = QTable::new(&subset);
        qlearning::learn(&mut subset, &mut table, &rates, &mut ChaCha8Rng::seed_from_u64(2)).unwrap();
        let (additions, account) = subset.into_parts();
        assert_eq!(account.simulated, world.calls.load(Ordering::Relaxed));
        assert_eq!(account.simulated, additions.len() as u64);
        (table, additions, account)
    };
    let mut shared = Cache::new(1000);
    let (table, additions, account) = learn_in(&shared);
    assert!(account.simulated <= 5 * 4, "no transition is simulated twice");
    assert!(account.hit_rate() > 0.5 && account.hit_rate() < 1.0);
    shared.merge(additions);
    let (again, additions, account) = learn_in(&shared);
    assert_eq!((additions.len(), account.hit_rate()), (0, 1.0), "the second time all is known");
    assert_eq!(again, table, "and leads to the same values");
}

#[test]
fn a_full_cache_keeps_what_came_first() {
    let key = |angle| {
        let to = GridState { levels: vec![Level { angle, velocity: 0 }], beats: 1 };
        TransitionKey { from: None, to, cell: 0, mirrored: false }
    };
    let tracked = |after: f64| {
        Arc::new(TrackedTransition { terms: Terms::default(), seconds: 0.1, after: Some((after, 0)) })
    };
    let mut cache = Cache::new(2);
    cache.merge(vec![(key(1), tracked(1.0))]);
    cache.merge(vec![(key(1), tracked(5.0)), (key(2), tracked(2.0)), (key(3), tracked(3.0))]);
    let after =
        |key: &TransitionKey| cache.get(key).and_then(|tracked| tracked.after).map(|(state, _)| state);
    assert_eq!([after(&key(1)), after(&key(2)), after(&key(3))], [Some(1.0), Some(2.0), None]);
}

#[test]
fn a_race_measures_what_the_closed_form_says() {
    let grid = plain_grid();
    let learning = Learning { trial_seconds: 1.0, check_seconds: 10.0, ..toy_learning() };
    let parameters = toy_parameters(learning);
    let objective = Objective::of(&plain_task(), 1.0, 0.3, 9.81).unwrap();
    let stop = Stop::new(&Cancel::default(), None);
    let context = SearchContext { grid: &grid, objective: &objective, parameters: &parameters, stop: &stop };
    let posture = |angle: f64, tip: f64| Posture::resting(&[angle, tip]);
    let behaviour = |cycle: Vec<Posture>| Behaviour {
        fitness: 0.0,
        generation: 0,
        transition_time: 0.1,
        entry: vec![posture(0.1, 0.0)],
        cycle,
        steering: None,
    };
    let swing = behaviour(vec![posture(-0.3, 0.0), posture(0.2, 0.0)]);
    let mut world = Sledge::new();
    // 0.1 m at first, then half a metre every 0.2 s: 49 times in the 98 transitions up to 9.9 s, and the
    // hundredth transition goes back.
    let run = run_check(context, &mut world, &swing, Bar::None).unwrap();
    let inspections = run.inspections.unwrap();
    assert!((run.seconds - 10.0).abs() < 1e-9);
    assert!((run.fitness - (0.1 + 49.0 * 0.5) / 10.0).abs() < 1e-9, "{}", run.fitness);
    // Looks at 1, 2, 4, 8 and 10 s: 4, 9, 19, 39 and 49 times half a metre, and 0.1 m.
    for (look, expected) in inspections.iter().zip([2.1 / 1.0, 4.6 / 2.0, 9.6 / 4.0, 19.6 / 8.0, 24.6 / 10.0])
    {
        assert!((look - expected).abs() < 1e-9, "{inspections:?}");
    }
    // Against itself it is no better, and ends at the first look with the same fitness; against what was
    // as good at first and worse later it goes on; against what was better at 2 s it ends there, as far
    // below the other's final fitness as it was then.
    let run = run_check(context, &mut world, &swing, Bar::Incumbent(&inspections)).unwrap();
    assert_eq!((run.fitness, run.inspections), (inspections[4], None));
    assert!((run.seconds - 1.0).abs() < 1e-9);
    let run = run_check(context, &mut world, &swing, Bar::Incumbent(&[2.0, 2.0, 2.0, 2.0, 2.0])).unwrap();
    assert_eq!(run.inspections, Some(inspections));
    let run = run_check(context, &mut world, &swing, Bar::Incumbent(&[2.0, 2.5, 2.5, 2.5, 2.7])).unwrap();
    assert!(run.inspections.is_none() && (run.seconds - 2.0).abs() < 1e-9);
    assert!((run.fitness - (2.7 - 0.2)).abs() < 1e-9);
    // From a start that is 0.05 m ahead it gains that much less; the least counts.
    let mut upset = Sledge { disturbed: vec![-0.02, 0.05], ..Sledge::new() };
    let run = run_check(context, &mut upset, &swing, Bar::None).unwrap();
    assert!((run.fitness - 24.55 / 10.0).abs() < 1e-9 && (run.seconds - 30.0).abs() < 1e-9);
    assert_eq!(run.inspections.unwrap().last(), Some(&run.fitness));
    // Whoever falls is below whoever stands, and the later the better.
    let mut tipping = Sledge { tip: 0.5, ..Sledge::new() };
    let mut last = f64::MIN;
    for length in [1, 5, 20] {
        let mut cycle = vec![posture(-0.3, 0.0); length];
        cycle.push(posture(0.0, 0.6));
        let run = run_check(context, &mut tipping, &behaviour(cycle), Bar::None).unwrap();
        assert!(run.inspections.is_none() && run.fitness > last && run.fitness < -0.5);
        assert!((run.seconds - 0.1 * (length + 2) as f64).abs() < 1e-9);
        last = run.fitness;
    }
}
