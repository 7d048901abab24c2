//! What is changed in the algorithm as published, each against what it is to change.

use std::sync::Arc;

use super::toy::{Sledge, run_toy, toy_learning, toy_parameters, toy_search};
use super::{bundled, grid_of, parameters, plain_grid, plain_task};
use gaitwright_learning::learn::cache::Cache;
use gaitwright_learning::learn::genome::{Genome, Leader};
use gaitwright_learning::learn::grid::Grid;
use gaitwright_learning::learn::policy::ActionPath;
use gaitwright_learning::learn::qlearning::{self, QTable, Rates};
use gaitwright_learning::learn::subset::{SearchContext, Subset, TimedPosture};
use gaitwright_learning::learn::trial::compose;
use gaitwright_learning::learn::{
    Cancel, Earnings, Learning, Objective, Posture, Repair, Repairs, Stop, Terms,
};
use gaitwright_physics::motion::{Player, hermite};
use gaitwright_physics::scene::Scene;
use gaitwright_physics::stance::Stance;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn without(repair: Repair) -> Learning {
    Learning { repairs: Repairs::default().without(repair), ..Learning::default() }
}

#[test]
fn a_document_lists_the_repairs_by_name() {
    let read = |text: &str| serde_json::from_str::<Learning>(text);
    let some = read(r#"{"repairs": ["symmetry", "whole_cycle"]}"#).unwrap().repairs;
    for repair in Repair::ALL {
        assert_eq!(some.has(repair), matches!(repair, Repair::Symmetry | Repair::WholeCycle));
        assert!(Repairs::default().has(repair) && !Repairs::NONE.has(repair));
        let left = Repairs::default().without(repair);
        let names = serde_json::to_value(left).unwrap();
        let names: Vec<&str> = names.as_array().unwrap().iter().map(|name| name.as_str().unwrap()).collect();
        assert!(names.len() == Repair::ALL.len() - 1 && !names.contains(&repair.name()));
        assert_eq!(serde_json::from_value::<Repairs>(names.into()).unwrap(), left);
    }
    assert_eq!(read("{}").unwrap().repairs, Repairs::default());
    assert_eq!(read(r#"{"repairs": []}"#).unwrap().repairs, Repairs::NONE);
    assert!(read(r#"{"repairs": ["cure"]}"#).unwrap_err().to_string().contains("cure"));
}

#[test]
fn ways_are_seen_from_the_heading() {
    let terms = Terms { displacement: [0.0, 2.0], turn: 0.1, ..Terms::default() };
    let [ahead, left] = terms.seen_from(std::f64::consts::FRAC_PI_2).displacement;
    assert!((ahead - 2.0).abs() < 1e-12 && left.abs() < 1e-12, "who is headed along y goes ahead");
    let [ahead, left] = terms.seen_from(std::f64::consts::FRAC_PI_6).displacement;
    assert!((ahead - 1.0).abs() < 1e-12 && (left - 3f64.sqrt()).abs() < 1e-12);
    assert_eq!(terms.seen_from(0.3).turn, 0.1);
}

#[test]
fn sway_is_charged_over_a_cycle_and_not_on_the_way() {
    let task = gaitwright_learning::learn::Task::default();
    let objective = Objective::of(&task, 10.0, 0.5, 9.81).unwrap();
    let half = Terms { displacement: [0.2, 0.1], turn: 0.3, ..Terms::default() };
    let other = Terms { displacement: [0.2, -0.1], turn: -0.3, ..Terms::default() };
    let [first, second] = [half, other].map(|terms| objective.earnings(&terms, 0.1));
    // 0.5 a metre of drift, 2 × 0.5 m a radian of turn.
    assert!((first.total() - (0.2 - 0.05 - 0.3)).abs() < 1e-12);
    assert!((first.without_sway() - 0.2).abs() < 1e-12);
    assert_eq!(first.mirrored(), second);
    let mut sum = half;
    sum += other;
    let whole = objective.earnings(&sum, 0.2);
    let added = Earnings {
        plain: first.plain + second.plain,
        signed: std::array::from_fn(|index| first.signed[index] + second.signed[index]),
    };
    assert!((whole.total() - 0.4).abs() < 1e-12 && (added.total() - 0.4).abs() < 1e-12);
}

#[test]
fn a_behaviour_written_beat_by_beat_has_the_same_targets() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let parameters = toy_parameters(Learning { repairs: Repairs::default(), ..toy_learning() });
    let beat = parameters.beat();
    assert!((beat - 0.05).abs() < 1e-15);
    for _ in 0..20 {
        let mut draw = || Posture {
            angles: (0..2).map(|_| rng.random_range(-1.0..1.0)).collect(),
            velocities: (0..2).map(|_| rng.random_range(-5.0..5.0)).collect(),
        };
        let postures: Vec<Posture> = (0..4).map(|_| draw()).collect();
        let beats = [3, 1, 6, 2];
        let keyframes: Vec<TimedPosture> = postures
            .iter()
            .zip(beats)
            .map(|(posture, beats)| TimedPosture { posture: posture.clone(), beats })
            .collect();
        let standing = Posture::resting(&[0.1, -0.2]);
        let path = ActionPath { entry: vec![0, 1], cycle: vec![2, 3, 1] };
        let behaviour = compose(&path, (&standing, &keyframes), &parameters, 7);
        assert_eq!((behaviour.entry.len(), behaviour.cycle.len()), (3 + 1 + 5, 6 + 2 + 1));
        let player = Player::from_postures(
            &standing.angles,
            behaviour.entry.iter().map(Posture::parts),
            behaviour.cycle.iter().map(Posture::parts),
            behaviour.transition_time,
        );
        // The same by whole transitions, twice round the cycle.
        let mut from = (&standing, 0.0);
        for action in [0, 1, 2, 3, 1, 2, 3, 1, 2] {
            let (to, duration) = (&postures[action], beat * f64::from(beats[action]));
            for part in 0..=10 {
                let since = duration * f64::from(part) / 10.0;
                let mut angles = [0.0; 2];
                player.targets(from.1 + since, &mut angles);
                for (joint, angle) in angles.iter().enumerate() {
                    let end = |posture: &Posture| (posture.angles[joint], posture.velocities[joint]);
                    let expected = hermite(end(from.0), end(to), duration, since);
                    assert!((angle - expected).abs() < 1e-9, "{angle} instead of {expected}");
                }
            }
            from = (to, from.1 + duration);
        }
    }
}

#[test]
fn times_are_drawn_and_mutated_where_they_are_genes() {
    let model = bundled("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut seen = |learning: &Learning| {
        let parameters = parameters(learning, &stance);
        let grid = grid_of(&model, &stance, &parameters);
        let mut beats: Vec<u8> = Vec::new();
        let mut genome = Genome::random(&grid, 8, false, &mut rng);
        for _ in 0..200 {
            genome.mutate(&grid, &parameters.mutation, &mut rng);
            beats.extend(genome.states.iter().map(|state| state.beats));
        }
        beats.sort_unstable();
        beats.dedup();
        beats
    };
    assert_eq!(seen(&Learning::default()), [1, 2, 3, 4, 5, 6]);
    assert_eq!(seen(&without(Repair::TransitionTimes)), [1]);
}

/// Legs in turn: the second limb does in each state what the first does in its partner.
#[test]
fn crossover_by_whole_groups_keeps_alternation() {
    let model = bundled("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let learning = without(Repair::Symmetry);
    let parameters = parameters(&learning, &stance);
    let grid = grid_of(&model, &stance, &parameters);
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let alternating = Leader { limb: 0, swapped: true };
    let mut parents: Vec<Genome> = Vec::new();
    while parents.len() < 2 {
        let genome = Genome::random(&grid, 6, true, &mut rng);
        if genome.leader(&grid, 2) == Some(alternating) {
            parents.push(genome);
        }
    }
    let [a, b] = [&parents[0], &parents[1]];
    let mut kept = [0; 2];
    for _ in 0..400 {
        for (group, kept) in [1, 2].into_iter().zip(&mut kept) {
            let child = a.cross_uniform(b, group, &mut rng);
            *kept += usize::from(child.leader(&grid, 2) == Some(alternating));
        }
        let groups = a.limb_groups(b, &grid, &parameters);
        assert!(groups.iter().any(|group| group.contains(&0) && group.contains(&2)), "{groups:?}");
        let child = a.cross_by_limb(b, &groups, &grid, &mut rng);
        assert_eq!(child.leader(&grid, 2), Some(alternating));
    }
    // Each of three pairs has both states from the same parent half of the time: one in eight.
    assert_eq!(kept[1], 400);
    assert!((25..=80).contains(&kept[0]), "{} of 400, of which 50 are expected", kept[0]);
}

#[test]
fn the_first_generation_is_bounded() {
    let run = |repairs: Repairs| {
        let world = Sledge { tip: 0.4, ..Sledge::new() };
        let learning = Learning { generations: Some(1), repairs, ..toy_learning() };
        let (learned, _) = run_toy(&toy_search(world, learning, 9), 2, None);
        assert!(learned.best.is_some());
        learned.curve[0].simulated_seconds
    };
    let usual = toy_learning().repairs;
    let (bounded, unbounded) = (run(usual), run(usual.without(Repair::BoundedStart)));
    // 24 individuals with two trials of 1.5 s at most, 20 transitions of 0.1 s each, and two whole checks of 20 s.
    assert!(bounded <= 24.0 * (3.0 + 2.0) + 2.0 * 20.0, "{bounded} s");
    assert!(unbounded > 1.5 * bounded, "{unbounded} s without, {bounded} s with");
}

#[test]
fn without_a_cache_every_transition_is_simulated() {
    let grid: Grid = plain_grid();
    let objective = Objective::of(&plain_task(), 1.0, 0.3, 9.81).unwrap();
    let stop = Stop::new(&Cancel::default(), None);
    let run = |cache_transitions: usize| {
        let parameters = toy_parameters(Learning { cache_transitions, ..toy_learning() });
        let context =
            SearchContext { grid: &grid, objective: &objective, parameters: &parameters, stop: &stop };
        let genome = Genome::random(&grid, 4, true, &mut ChaCha8Rng::seed_from_u64(1));
        let mut world = Sledge { calls: Arc::default(), ..Sledge::new() };
        let shared = Cache::new(cache_transitions);
        let mut subset = Subset::new(context, &mut world, &shared, &genome);
        let mut table = QTable::new(&subset);
        let rates = Rates::from(&parameters);
        qlearning::learn(&mut subset, &mut table, &rates, &mut ChaCha8Rng::seed_from_u64(2)).unwrap();
        let (_, totals) = subset.into_parts();
        assert!((totals.seconds - 0.1 * totals.simulated as f64).abs() < 1e-9);
        assert!((totals.saved - 0.1 * (totals.asked - totals.simulated) as f64).abs() < 1e-9);
        totals
    };
    let (none, usual) = (run(0), run(1000));
    assert_eq!((none.simulated, none.saved, none.hit_rate()), (none.asked, 0.0, 0.0));
    assert_eq!(usual.asked, none.asked, "in a world where the cache tells the truth the same is learned");
    assert!(usual.simulated <= 20);
}
