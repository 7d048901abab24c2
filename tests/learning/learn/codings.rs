//! The coding in which the population is the subset.

use super::toy::{Sledge, run_toy, toy_learning, toy_parameters, toy_search};
use super::{plain_grid, plain_task, timeless};
use gaitwright_learning::learn::cache::Cache;
use gaitwright_learning::learn::genome::Genome;
use gaitwright_learning::learn::policy::greedy_path;
use gaitwright_learning::learn::qlearning::{self, QTable, Rates};
use gaitwright_learning::learn::subset::{SearchContext, Subset};
use gaitwright_learning::learn::{Cancel, Checkpoint, Coding, Learning, Objective, Stop};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn learning() -> Learning {
    Learning { coding: Coding::Population, states: 8, elite: 1, ..toy_learning() }
}

#[test]
fn a_population_that_is_the_subset_finds_the_toys_best_behaviour() {
    let learning = Learning { generations: Some(150), patience: 200, ..learning() };
    let (learned, notes) = run_toy(&toy_search(Sledge::new(), learning, 3), 2, None);
    let best = learned.best.unwrap();
    // From −0.6 to 0.6 and back, 0.1 s each: 6 m/s; a neighbour of that is good enough.
    assert!(best.fitness > 5.0, "{}", best.fitness);
    let islands = &notes.checkpoints.last().unwrap().islands;
    for island in islands {
        assert_eq!(island.members.len(), 8, "as many individuals as the subset has states");
        assert!(island.members.iter().all(|member| member.genome.states.len() == 1));
        assert!(island.members.iter().all(|member| (0.0..=2.0).contains(&member.fitness)));
        assert!(island.members.windows(2).all(|pair| pair[0].fitness >= pair[1].fitness));
    }
}

#[test]
fn threads_and_interruptions_change_no_bit_of_it() {
    let search = toy_search(Sledge { tip: 0.2, ..Sledge::new() }, learning(), 11);
    let (alone, notes) = run_toy(&search, 1, None);
    let alone = timeless(alone);
    assert!(alone.best.is_some());
    assert_eq!(timeless(run_toy(&search, 3, None).0), alone);
    for checkpoint in &notes.checkpoints {
        let read: Checkpoint = serde_json::from_slice(&serde_json::to_vec(checkpoint).unwrap()).unwrap();
        assert_eq!(timeless(run_toy(&search, 2, Some(read)).0), alone);
    }
}

#[test]
fn a_state_is_worth_its_values_and_its_uses() {
    let (grid, parameters) = (plain_grid(), toy_parameters(learning()));
    let objective = Objective::of(&plain_task(), 1.0, 0.3, 9.81).unwrap();
    let stop = Stop::new(&Cancel::default(), None);
    let context = SearchContext { grid: &grid, objective: &objective, parameters: &parameters, stop: &stop };
    for seed in 0..10 {
        let genome = Genome::random(&grid, 6, true, &mut ChaCha8Rng::seed_from_u64(seed));
        let (mut world, shared) = (Sledge::new(), Cache::new(1000));
        let mut subset = Subset::new(context, &mut world, &shared, &genome);
        let mut table = QTable::new(&subset);
        let rates = Rates { episodes: 200, ..Rates::from(&parameters) };
        qlearning::learn(&mut subset, &mut table, &rates, &mut ChaCha8Rng::seed_from_u64(2)).unwrap();
        let path = greedy_path(&mut subset, &table).unwrap();
        let worths = subset.worths(&table, &path);
        // By hand: each row between its least and its greatest, averaged; each state of the cycle is used equally often.
        for (state, worth) in worths.iter().enumerate() {
            let share = |situation: usize| {
                let row: Vec<f64> = (0..6).map(|action| table.value(situation, action)).collect();
                let least = row.iter().copied().fold(f64::INFINITY, f64::min);
                let greatest = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                (row[state] - least) / (greatest - least)
            };
            let value = (0..7).map(share).sum::<f64>() / 7.0;
            let used = if path.cycle.contains(&state) { 1.0 } else { 0.0 };
            assert!((worth - value - used).abs() < 1e-12, "seed {seed}: {worth} instead of {value} + {used}");
        }
        assert!(path.cycle.len() >= 2 || path.cycle.is_empty());
    }
}
