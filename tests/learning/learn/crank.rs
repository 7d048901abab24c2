//! The search on a toy world whose best behaviour is a loop of four states, and in which loops of two go nowhere.

use std::ops::Range;

use super::toy::{toy_learning, toy_parameters};
use super::{Notes, plain_grid, plain_task};
use gaitwright_learning::learn::evaluation::{Targets, TrackingOutcome, World};
use gaitwright_learning::learn::search::Search;
use gaitwright_learning::learn::{Behaviour, Cancel, Coding, Interrupted, Learning, Objective, Stop, Terms};

/// A crank on two slides: the joints' angles are its place in the plane, and it advances by twice the area that the straight line from
/// one place to the next sweeps about the origin, counter-clockwise.
#[derive(Debug, Clone)]
struct Crank;

impl World for Crank {
    /// Where the crank is.
    type State = [f64; 2];

    fn standing(&self) -> &[f64; 2] {
        &[0.0; 2]
    }

    fn disturbed(&self) -> &[[f64; 2]] {
        &[]
    }

    fn track(
        &mut self,
        state: &[f64; 2],
        targets: Targets<'_>,
        steps: Range<u64>,
        _: &Stop,
    ) -> Result<TrackingOutcome<[f64; 2]>, Interrupted> {
        let mut next = [0.0; 2];
        targets(steps.end as f64 * STEP, &mut next);
        let swept = state[0] * next[1] - state[1] * next[0];
        let terms = Terms { displacement: [swept, 0.0], ..Terms::default() };
        let seconds = (steps.end - steps.start) as f64 * STEP;
        Ok(TrackingOutcome { terms, seconds, heading: 0.0, after: Some(next) })
    }

    fn mirrored(&self, state: &[f64; 2]) -> [f64; 2] {
        *state
    }

    fn cells(&self) -> usize {
        1
    }

    fn cell(&self, _: &[f64; 2]) -> usize {
        0
    }
}

/// s.
const STEP: f64 = 0.01;

/// What the search finds with so many states in a subset, in 100 generations.
fn best(coding: Coding, states: usize, seed: u64) -> Behaviour {
    let learning = Learning { generations: Some(100), coding, states, ..toy_learning() };
    let search = Search {
        world: Crank,
        grid: plain_grid(),
        task: plain_task(),
        objective: Objective::of(&plain_task(), 1.0, 0.3, 9.81).unwrap(),
        parameters: toy_parameters(learning),
        seed,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    search.run(&pool, &mut Notes::default(), &Stop::new(&Cancel::default(), None), None).best.unwrap()
}

/// From a place a to a place b it advances by a × b: in a square of side 1.2 about the origin at most by 0.72 m, and by that only from one
/// corner to the next. There and back is nothing, so that only the loop through all four corners has 0.72 m for every 0.1 s.
#[test]
fn a_loop_of_four_states_is_found_where_loops_of_two_go_nowhere() {
    for (states, seed) in [(4, 3), (8, 3), (8, 4), (8, 5)] {
        let found = best(Coding::Chromosome, states, seed);
        assert_eq!(found.cycle.len(), 4, "{states} states, seed {seed}");
        // The way from the origin to the first corner gains nothing: 199 of the 200 transitions of 20 s.
        assert!((found.fitness - 199.0 * 0.72 / 20.0).abs() < 1e-9, "{}", found.fitness);
    }
}

/// Where one individual is one state, a loop of more than two states is found as well: no other gets on. It is not the best one, since
/// states that nobody visits yet are worth nothing there.
#[test]
fn states_on_their_own_breed_into_a_loop_as_well() {
    for seed in [3, 4, 5] {
        let found = best(Coding::Population, 8, seed);
        assert!(found.cycle.len() >= 3, "{} states, seed {seed}", found.cycle.len());
        assert!(found.fitness > 0.0, "{}, seed {seed}", found.fitness);
    }
}
