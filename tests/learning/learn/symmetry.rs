//! Mirror images and shifts of limbs: on the grid, in the simulator, and in what is learned.

use std::sync::Arc;

use super::{Notes, bundled, grid_of, parameters};
use gaitwright_learning::learn::cache::Cache;
use gaitwright_learning::learn::evaluation::{SimulatedWorld, World};
use gaitwright_learning::learn::genome::Genome;
use gaitwright_learning::learn::grid::Grid;
use gaitwright_learning::learn::policy::ActionPath;
use gaitwright_learning::learn::qlearning::{self, Environment, QTable, Rates};
use gaitwright_learning::learn::subset::{SearchContext, Subset};
use gaitwright_learning::learn::transition::Transition;
use gaitwright_learning::learn::{
    Cancel, Learning, LearningSetup, Objective, Posture, Repair, Repairs, Stop, Task, learn,
};
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::stance::Stance;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Greatest difference that the order of contacts may make in two transitions, rad and m: a contact that opens or closes at the very
/// end of a step does so a step of 2 ms later in the mirror, while joints move at 2.5 rad/s. (The solver's tolerance has no part
/// in it: with a thousandth of it the difference is the same.)
const NEAR: f64 = 5e-3;

struct Character {
    model: Arc<Model>,
    stance: Stance,
    grid: Grid,
}

fn character(name: &str) -> Character {
    let model = bundled(name);
    let stance = Stance::find(&model, &Scene::default());
    let grid = grid_of(&model, &stance, &parameters(&Learning::default(), &stance));
    Character { model, stance, grid }
}

#[test]
fn shifts_by_all_rows_are_the_mirror_image() {
    for (name, images) in [("quadruped.urdf", 4), ("hexapod.json", 6), ("biped.urdf", 2)] {
        let Character { grid, .. } = character(name);
        let symmetry = grid.symmetry.as_ref().unwrap_or_else(|| panic!("{name} has left and right"));
        assert_eq!(symmetry.images(), images, "{name}");
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for state in Genome::random(&grid, 50, false, &mut rng).states {
            let mirrored = symmetry.mirrored(&grid.joints, &state);
            assert_eq!(symmetry.mirrored(&grid.joints, &mirrored), state, "{name}: twice is nothing");
            let shifted = symmetry.shifted(&grid.joints, &state);
            assert_eq!((shifted.len(), &shifted[0]), (images / 2, &state));
            assert_eq!(mirrored.beats, state.beats);
        }
    }
}

#[test]
fn legs_take_turns_from_front_to_back_and_over_to_the_other_side() {
    let Character { model, stance, grid } = character("quadruped.urdf");
    let symmetry = grid.symmetry.as_ref().unwrap();
    let state = &Genome::random(&grid, 1, false, &mut ChaCha8Rng::seed_from_u64(4)).states[0];
    let leg = |levels: &[gaitwright_learning::learn::grid::Level], name: &str| {
        let of = |joint: usize| model.joint_names[joint].starts_with(name);
        (0..levels.len()).filter(|&joint| of(joint)).map(|joint| levels[joint]).collect::<Vec<_>>()
    };
    let names: Vec<&str> = ["LF", "LH", "RF", "RH"].into_iter().collect();
    assert!(names.iter().all(|name| leg(&state.levels, name).len() == 3), "{:?}", model.joint_names);
    let shifted = &symmetry.shifted(&grid.joints, state)[1];
    assert_eq!(leg(&shifted.levels, "LH"), leg(&state.levels, "LF"));
    assert_eq!(leg(&shifted.levels, "RH"), leg(&state.levels, "RF"));
    // The hip that spreads the leg turns the other way on the other side.
    let across = |levels: Vec<gaitwright_learning::learn::grid::Level>| {
        levels.into_iter().map(|level| (level.angle, level.velocity)).collect::<Vec<_>>()
    };
    let (front, hind) = (across(leg(&shifted.levels, "LF")), across(leg(&state.levels, "RH")));
    assert_eq!(front[0], (-hind[0].0, -hind[0].1));
    assert_eq!(front[1..], hind[1..]);
    // Along y the legs that were fore and hind are the sides; the names do not matter.
    let sideways = Grid::new(&model, &stance, [0.0, 1.0, 0.0], &parameters(&Learning::default(), &stance));
    let symmetry = sideways.symmetry.as_ref().expect("fore and hind legs are of a kind");
    let state = &Genome::random(&sideways, 1, false, &mut ChaCha8Rng::seed_from_u64(4)).states[0];
    let mirrored = symmetry.mirrored(&sideways.joints, state);
    for (own, other) in [("LF", "LH"), ("LH", "LF"), ("RF", "RH"), ("RH", "RF")] {
        let far = |(angle, velocity): (i8, i8)| (angle.abs(), velocity.abs());
        let (own, other) = (across(leg(&mirrored.levels, own)), across(leg(&state.levels, other)));
        assert!(own.into_iter().map(far).eq(other.into_iter().map(far)));
    }
}

/// Mirroring and simulating can be exchanged.
#[test]
fn the_simulator_does_in_the_mirror_what_the_mirror_shows() {
    let Character { model, stance, grid } = character("quadruped.urdf");
    let symmetry = grid.symmetry.as_ref().unwrap();
    let resolved = parameters(&Learning::default(), &stance);
    let mut world = SimulatedWorld::new(
        &model,
        &stance,
        (&Scene::default(), &Accuracy::default(), [1.0, 0.0, 0.0]),
        Some(symmetry.mirror().sources()),
        &resolved,
    )
    .unwrap();
    let stop = Stop::new(&Cancel::default(), None);
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    let (mut compared, mut turned) = (0, 0.0_f64);
    for states in (0..12).map(|_| Genome::random(&grid, 2, false, &mut rng).states) {
        let images = states.iter().map(|state| symmetry.mirrored(&grid.joints, state));
        let images: Vec<_> = images.collect();
        let mut go = |states: &[_]| {
            let mut state = world.standing().clone();
            let mut from = grid.standing();
            let mut terms = Vec::new();
            for to in states {
                let to = grid.posture(to);
                let duration = resolved.transition_time;
                let transition = Transition { from: &from, to: &to, duration };
                let targets = |t: f64, angles: &mut [f64]| transition.targets(t, angles);
                let outcome = world.track(&state, &targets, 0..resolved.transition_steps, &stop).unwrap();
                terms.push((outcome.terms, outcome.heading));
                state = outcome.after?;
                from = to;
            }
            Some((state, terms))
        };
        let (Some((plain, first)), Some((other, second))) = (go(&states), go(&images)) else { continue };
        let image = world.mirrored(&plain);
        // Contacts are solved one after the other, to a tolerance, and here in another order.
        assert!(image.distance(&other) < NEAR, "{}", image.distance(&other));
        for ((one, heading), (two, opposite)) in first.iter().zip(&second) {
            assert!((one.turn + two.turn).abs() < NEAR && (heading + opposite).abs() < NEAR);
            assert!((one.displacement[0] - two.displacement[0]).abs() < NEAR);
            assert!((one.displacement[1] + two.displacement[1]).abs() < NEAR);
        }
        let back = world.mirrored(&image);
        assert!(back.distance(&plain) < 1e-12);
        turned = turned.max(first[0].0.turn.abs());
        compared += 1;
    }
    assert!(compared >= 6 && turned > 0.01, "{compared} compared, turns up to {turned} rad");
}

/// The mirror image of a posture.
fn image(grid: &Grid, posture: &Posture) -> Posture {
    let sources = grid.symmetry.as_ref().unwrap().mirror().sources();
    let standing = grid.standing();
    let angle = |(joint, &(from, sign)): (usize, &(usize, i8))| {
        standing.angles[joint] + f64::from(sign) * (posture.angles[from] - standing.angles[from])
    };
    Posture {
        angles: sources.iter().enumerate().map(angle).collect(),
        velocities: sources.iter().map(|&(from, sign)| f64::from(sign) * posture.velocities[from]).collect(),
    }
}

#[test]
fn the_mirrored_half_of_a_cycle_follows_from_the_other() {
    let Character { model, stance, grid } = character("quadruped.urdf");
    let learning = Learning { states: 8, episodes: 6, ..Learning::default() };
    let parameters = parameters(&learning, &stance);
    let scene = Scene::default();
    let mirror = grid.symmetry.as_ref().unwrap().mirror().sources();
    let around = (&scene, &Accuracy::default(), [1.0, 0.0, 0.0]);
    let mut world = SimulatedWorld::new(&model, &stance, around, Some(mirror), &parameters).unwrap();
    let objective = Objective::new(&Task::default(), &model, &stance, 9.81).unwrap();
    let stop = Stop::new(&Cancel::default(), None);
    let context = SearchContext { grid: &grid, objective: &objective, parameters: &parameters, stop: &stop };
    let shared = Cache::new(1000);
    let genome = Genome::random(&grid, grid.drawn(8), true, &mut ChaCha8Rng::seed_from_u64(3));
    assert_eq!(genome.states.len(), 2);
    let mut subset = Subset::new(context, &mut world, &shared, &genome);
    // Two states, each shifted, are four; each of them or its image can be gone to.
    assert_eq!((subset.situations(), subset.actions()), (5, 8));
    let keyframes = subset.keyframes();
    let near = |a: &Posture, b: &Posture| {
        let pairs = a.angles.iter().chain(&a.velocities).zip(b.angles.iter().chain(&b.velocities));
        pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-9)
    };
    for action in 0..4 {
        assert!(near(&keyframes[action + 4].posture, &image(&grid, &keyframes[action].posture)));
    }
    // To state 1, to the image of state 0, on to 2 as seen from there; half a cycle of one change of side.
    let half = subset.unfolded(&ActionPath { entry: vec![1], cycle: vec![4, 2] });
    assert_eq!((half.entry, half.cycle), (vec![1], vec![4, 6, 0, 2]));
    let whole = subset.unfolded(&ActionPath { entry: vec![5], cycle: vec![4, 2, 6] });
    assert_eq!((whole.entry, whole.cycle), (vec![5], vec![0, 2, 6]));

    let mut table = QTable::new(&subset);
    let rates = Rates::from(&parameters);
    qlearning::learn(&mut subset, &mut table, &rates, &mut ChaCha8Rng::seed_from_u64(2)).unwrap();
    let edges = subset.edges();
    let situations = subset.unfolded_situations();
    assert!(edges.iter().all(|edge| edge.from < situations && edge.to < situations));
    // Both halves have the same edges, in the mirror.
    let count = subset.situations();
    let start = subset.start_situation();
    for edge in edges.iter().filter(|edge| edge.from < start) {
        let (from, to) = (edge.from + count, (edge.to + count) % (2 * count));
        let twin = edges.iter().find(|other| other.from == from && other.to == to).unwrap();
        assert_eq!((twin.reward, twin.time, twin.action), (edge.reward, edge.time, (edge.action + 4) % 8));
        assert_eq!(twin.signed, [-edge.signed[0], -edge.signed[1], edge.signed[2]]);
    }
}

#[test]
fn a_character_learns_in_the_mirror_the_same_with_any_threads() {
    let model = bundled("quadruped.urdf");
    let scene = Scene::default();
    let stance = Arc::new(Stance::find(&model, &scene));
    let learning = Learning {
        generations: Some(2),
        population: 4,
        islands: 2,
        states: 8,
        episodes: 4,
        cache_generations: 1,
        trial_seconds: 0.5,
        check_seconds: 2.0,
        ..Learning::default()
    };
    let run = |threads: usize, repairs: Repairs| {
        let parameters = parameters(&Learning { repairs, ..learning.clone() }, &stance);
        let setup = LearningSetup {
            model: model.clone(),
            stance: stance.clone(),
            scene: scene.clone(),
            accuracy: Accuracy::default(),
            task: Task::default(),
            parameters,
            seed: 7,
            threads,
        };
        let mut notes = Notes::default();
        let learned = learn(&setup, &mut notes, &Cancel::default(), None).unwrap();
        let checkpoint = notes.checkpoints.swap_remove(0);
        let resumed = learn(&setup, &mut Notes::default(), &Cancel::default(), Some(checkpoint)).unwrap();
        let learned = super::timeless(learned);
        assert_eq!(super::timeless(resumed), learned);
        learned
    };
    let all = run(1, Repairs::default());
    assert_eq!(run(2, Repairs::default()), all);
    let none = run(2, Repairs::default().without(Repair::Symmetry));
    assert_ne!(none.curve, all.curve);
}
