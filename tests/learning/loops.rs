//! Learning, playing and describing the motion of a character whose legs are closed chains.

use std::sync::Arc;

use gaitwright_learning::learn::evaluation::{SimulatedWorld, World};
use gaitwright_learning::learn::grid::Grid;
use gaitwright_learning::learn::{Behaviour, Checkpoint};
use gaitwright_learning::learn::{
    Cancel, Generation, Learning, LearningSetup, Observer, Posture, Stop, Task, learn,
};
use gaitwright_learning::program::legs::Legs;
use gaitwright_learning::program::subject::Subject;
use gaitwright_learning::training::check_task;
use gaitwright_physics::motion::Player;
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::sim::Simulator;
use gaitwright_physics::stance::Stance;

use crate::common;

struct Unheard;

impl Observer for Unheard {
    fn generation(&mut self, _: &Generation) {}
    fn improved(&mut self, _: &Behaviour) {}
    fn checkpoint(&mut self, _: &Checkpoint) {}
}

/// The bundled pantograph, which learns for a few generations.
fn setup() -> LearningSetup {
    let model = common::example("pantograph.json");
    let scene = Scene::default();
    let stance = Arc::new(Stance::find(&model, &scene));
    let learning = Learning {
        generations: Some(2),
        population: 6,
        islands: 1,
        states: 3,
        episodes: 4,
        episode_length: 8,
        trial_seconds: 0.5,
        check_seconds: 2.0,
        ..Learning::default()
    };
    let accuracy = Accuracy::default();
    let parameters = learning.resolve(&stance, 9.81, accuracy.step).unwrap();
    LearningSetup { model, stance, scene, accuracy, task: Task::default(), parameters, seed: 5, threads: 2 }
}

#[test]
fn the_pantograph_stands_with_closed_loops() {
    let LearningSetup { model, stance, .. } = setup();
    assert!(stance.stable);
    let simulator = Simulator::new(
        common::plan(&model, &Scene::default(), &Accuracy::default(), Some(&stance.gains)),
        stance.state.clone(),
    );
    assert!(simulator.joint_separation() <= 1e-5, "{:e}", simulator.joint_separation());
    for (joint, driven) in model.driven.iter().enumerate() {
        assert_eq!(*driven, model.joint_names[joint].ends_with("hip"));
        assert_eq!(stance.gains.stiffness[joint] > 0.0, *driven);
    }
}

/// Inverse kinematics would move the passive joints of its legs, which nothing drives: such a character is taught by QDSEGA.
#[test]
fn closed_chains_are_no_legs_of_a_leg_program() {
    let LearningSetup { model, stance, scene, accuracy, task, .. } = setup();
    assert!(Legs::of(&model, &stance, task.direction).is_none());
    let subject = Subject::new(&model, &stance, &scene, &accuracy, task.direction);
    assert!(subject.is_none_or(|subject| subject.legs.legs.is_empty()));
    let walk = Task { gait: "walk".into(), ..task };
    let error = check_task(&walk, &model, &stance, &scene).unwrap_err().to_string();
    assert!(error.contains("/task/gait") && error.contains("only `any`"), "{error}");
}

#[test]
fn only_driven_joints_are_learned() {
    let setup = setup();
    let grid = Grid::new(&setup.model, &setup.stance, setup.task.direction, &setup.parameters);
    for (joint, levels) in grid.joints.iter().enumerate() {
        let still = levels.lowest == 0 && levels.velocities == [[0, 0]];
        assert_eq!(still, !setup.model.driven[joint], "{}", setup.model.joint_names[joint]);
    }
    let learned = learn(&setup, &mut Unheard, &Cancel::default(), None).unwrap();
    let best = learned.best.expect("something stands for two seconds");
    for posture in best.entry.iter().chain(&best.cycle) {
        for joint in (0..setup.model.joint_count()).filter(|joint| !setup.model.driven[*joint]) {
            assert_eq!((posture.angles[joint], posture.velocities[joint]), (setup.stance.angles[joint], 0.0));
        }
    }
    // Played for two seconds, it keeps its legs together.
    let mut world = SimulatedWorld::new(
        &setup.model,
        &setup.stance,
        (&setup.scene, &setup.accuracy, setup.task.direction),
        None,
        &setup.parameters,
    )
    .unwrap();
    let player = Player::from_postures(
        &setup.stance.angles,
        best.entry.iter().map(Posture::parts),
        best.cycle.iter().map(Posture::parts),
        best.transition_time,
    );
    let mut state = setup.stance.state.clone();
    let plan = common::plan(&setup.model, &setup.scene, &setup.accuracy, Some(&setup.stance.gains));
    let mut observer = Simulator::new(plan, state.clone());
    let never = Stop::new(&Cancel::default(), None);
    for part in 0..20 {
        let targets = |time: f64, angles: &mut [f64]| player.targets(time, angles);
        let outcome = world.track(&state, &targets, part * 50..(part + 1) * 50, &never).unwrap();
        state = outcome.after.expect("it stays upright");
        observer.set_state(&state);
        assert!(observer.joint_separation() <= 1e-3, "{:e}", observer.joint_separation());
    }
}
