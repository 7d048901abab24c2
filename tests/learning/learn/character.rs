//! A character in the simulator.

use std::sync::Arc;

use super::{Notes, bundled, grid_of, parameters, plain_task, timeless};
use gaitwright_learning::learn::evaluation::{SimulatedWorld, World};
use gaitwright_learning::learn::transition::Transition;
use gaitwright_learning::learn::{
    Behaviour, Cancel, LearnError, Learned, Learning, LearningSetup, Posture, Task, Trunk, learn,
};
use gaitwright_physics::motion::Player;
use gaitwright_physics::playback::Playback;
use gaitwright_physics::scene::{Accuracy, Effect, Scene, StepPlan, Switch};
use gaitwright_physics::stance::{Stance, Upright};

/// Learning short enough for a test: 2 islands of 6, 3 generations, checks of 2 s.
fn brief() -> Learning {
    Learning {
        generations: Some(3),
        population: 6,
        islands: 2,
        states: 3,
        episodes: 4,
        episode_length: 8,
        migration: 2,
        cache_generations: 2,
        trial_seconds: 0.5,
        check_seconds: 2.0,
        ..Learning::default()
    }
}

fn setup(learning: Learning, threads: usize) -> LearningSetup {
    let model = bundled("quadruped.urdf");
    let scene = learning.trunk.in_scene(&Scene::default());
    let stance = Arc::new(Stance::find(&model, &scene));
    let parameters = parameters(&learning, &stance);
    let accuracy = Accuracy::default();
    LearningSetup { model, stance, scene, accuracy, task: Task::default(), parameters, seed: 42, threads }
}

fn player(setup: &LearningSetup, behaviour: &Behaviour) -> Player {
    Player::from_postures(
        &setup.stance.angles,
        behaviour.entry.iter().map(Posture::parts),
        behaviour.cycle.iter().map(Posture::parts),
        behaviour.transition_time,
    )
}

#[test]
fn a_character_learns_the_same_with_any_threads_and_after_resuming() {
    let mut notes = Notes::default();
    let alone = learn(&setup(brief(), 1), &mut notes, &Cancel::default(), None).unwrap();
    let alone = timeless(alone);
    assert_eq!(alone.curve.len(), 3);
    let together = learn(&setup(brief(), 2), &mut Notes::default(), &Cancel::default(), None).unwrap();
    assert_eq!(timeless(together), alone);
    let checkpoint = notes.checkpoints[0].clone();
    assert_eq!(checkpoint.generations, 2);
    let before = notes.improved.iter().filter(|best| best.generation < 2);
    assert!(checkpoint.improved.iter().eq(before), "every best behaviour is known after resuming");
    let resumed =
        learn(&setup(brief(), 2), &mut Notes::default(), &Cancel::default(), Some(checkpoint.clone()));
    assert_eq!(timeless(resumed.unwrap()), alone);

    let foreign = LearningSetup { seed: 43, ..setup(brief(), 1) };
    let error = learn(&foreign, &mut Notes::default(), &Cancel::default(), Some(checkpoint)).unwrap_err();
    let LearnError::Input(error) = error else { panic!("{error}") };
    assert_eq!(error.faults()[0].pointer, "/checkpoint/seed");
}

#[test]
fn the_learned_behaviour_is_what_playback_plays() {
    let setup = LearningSetup { task: plain_task(), ..setup(brief(), 2) };
    let learned = learn(&setup, &mut Notes::default(), &Cancel::default(), None).unwrap();
    let best = learned.best.expect("something in 30 individuals stands for two seconds");
    let grid = grid_of(&setup.model, &setup.stance, &setup.parameters);

    // No spline of it leaves a range of motion.
    let standing = Posture::resting(&setup.stance.angles);
    let visited: Vec<&Posture> =
        [&standing].into_iter().chain(&best.entry).chain(&best.cycle).chain(&best.cycle[..1]).collect();
    for pair in visited.windows(2) {
        let transition = Transition { from: pair[0], to: pair[1], duration: best.transition_time };
        assert!(transition.stays_within(&grid));
        let mut angles = vec![0.0; setup.model.joint_count()];
        for i in 0..=100 {
            transition.targets(best.transition_time * f64::from(i) / 100.0, &mut angles);
            for (angle, limits) in angles.iter().zip(&setup.model.limits) {
                let [lower, upper] = limits.unwrap_or([f64::MIN, f64::MAX]);
                assert!(*angle >= lower - 1e-9 && *angle <= upper + 1e-9);
            }
        }
    }

    // Playing it gives the very displacements that its fitness was measured by: from the standing pose
    // and from the disturbed ones, the least counts.
    let world = SimulatedWorld::new(
        &setup.model,
        &setup.stance,
        (&setup.scene, &setup.accuracy, [1.0, 0.0, 0.0]),
        None,
        &setup.parameters,
    )
    .unwrap();
    let plan = StepPlan::compile(&setup.scene, &setup.accuracy, Some(&setup.stance.gains), &setup.model);
    let plan = Arc::new(plan.unwrap());
    let player = player(&setup, &best);
    // The check ends with the transition in which its time is over.
    let seconds = (2.0 / best.transition_time - 1e-9).ceil() * best.transition_time;
    let mut least = f64::INFINITY;
    assert_eq!((world.standing(), world.disturbed().len()), (&setup.stance.state, 2));
    for start in [world.standing()].into_iter().chain(world.disturbed()) {
        let playback = Playback {
            model: &setup.model,
            plan: &plan,
            start,
            player: &player,
            upright: &Upright::new(&setup.model, &setup.stance, &setup.scene),
            seconds,
            sample_every: seconds,
        };
        let trace = playback.run(|| false);
        assert_eq!((trace.fell_at, &trace.failure), (None, &None));
        let travelled = trace.samples[1].center_of_mass.x - trace.samples[0].center_of_mass.x;
        least = least.min(travelled / seconds);
    }
    assert!((least - best.fitness).abs() < 1e-9, "{least} m/s instead of {}", best.fitness);
}

#[test]
fn a_locked_trunk_does_not_turn() {
    let learning = Learning { trunk: Trunk::Locked, ..brief() };
    let setup = LearningSetup { task: plain_task(), ..setup(learning, 2) };
    let best = learn(&setup, &mut Notes::default(), &Cancel::default(), None).unwrap().best.unwrap();
    let mut scene = setup.scene.clone();
    scene.effects.insert(Effect::TrunkRotationLock, Switch::On);
    let plan = StepPlan::compile(&scene, &setup.accuracy, Some(&setup.stance.gains), &setup.model).unwrap();
    let player = player(&setup, &best);
    let playback = Playback {
        model: &setup.model,
        plan: &Arc::new(plan),
        start: &setup.stance.state,
        player: &player,
        upright: &Upright::new(&setup.model, &setup.stance, &scene),
        seconds: 2.0,
        sample_every: 0.1,
    };
    let trace = playback.run(|| false);
    assert_eq!(trace.samples.len(), 21);
    let standing = setup.stance.state.root.orientation;
    assert!(trace.samples.iter().all(|sample| sample.root.orientation.angle_to(&standing) < 1e-6));
}

#[test]
fn trunk_cells_part_what_the_q_learner_sees() {
    let learning = Learning { trunk_cells: 3, ..brief() };
    let learned = learn(&setup(learning, 2), &mut Notes::default(), &Cancel::default(), None).unwrap();
    let none = learn(&setup(brief(), 2), &mut Notes::default(), &Cancel::default(), None).unwrap();
    let rate = |learned: &Learned| learned.curve[2].cache_hit_rate;
    assert!(rate(&learned) < rate(&none), "the same pair of states is another transition in another cell");
}

#[test]
fn a_scene_that_cannot_be_simulated_is_refused_before_learning() {
    let mut setup = setup(brief(), 1);
    setup.scene.restitution = 1.5;
    let error = learn(&setup, &mut Notes::default(), &Cancel::default(), None).unwrap_err();
    let LearnError::Input(error) = error else { panic!("{error}") };
    assert_eq!(error.faults()[0].pointer, "/scene/restitution");
}
