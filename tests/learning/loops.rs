//! Learning, playing and describing the motion of a character whose legs are closed chains.

use std::sync::Arc;

use gaitwright_learning::learn::evaluation::{SimulatedWorld, World};
use gaitwright_learning::learn::grid::Grid;
use gaitwright_learning::learn::{Behaviour, Checkpoint};
use gaitwright_learning::learn::{
    Cancel, Generation, Learning, LearningSetup, Observer, Posture, Stop, Task, learn,
};
use gaitwright_learning::program::closing::Following;
use gaitwright_learning::program::gaits::named;
use gaitwright_learning::program::legs::Legs;
use gaitwright_learning::program::no_gaits::NoGaits;
use gaitwright_learning::program::ring::{LIFT, PARAMETERS, PERIOD, SWAY, Wanted};
use gaitwright_learning::program::subject::Subject;
use gaitwright_learning::training::check_task;
use gaitwright_physics::character::{Source, read};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::Player;
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::sim::Simulator;
use gaitwright_physics::stance::{Stance, close_loops};
use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde_json::{Value, json};

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

fn pantograph() -> Value {
    serde_json::from_slice(&std::fs::read(common::example_path("pantograph.json")).unwrap()).unwrap()
}

fn compiled(document: &Value) -> Arc<Model> {
    let reading = read(document.to_string().as_bytes(), Source::Json, Default::default()).unwrap();
    Arc::new(Model::new(Arc::new(reading.character), Base::Floating))
}

/// The pantograph with a joint above each of its legs that swings both of its thighs aside.
fn pantograph_with_abduction() -> Arc<Model> {
    let mut document = pantograph();
    for joint in document["joints"].as_array_mut().unwrap() {
        let name = joint["name"].as_str().unwrap().to_owned();
        let Some(leg) = name.strip_suffix("_fore_hip").or(name.strip_suffix("_aft_hip")) else { continue };
        joint["parent"] = json!(format!("{leg}_carrier"));
        let position = &mut joint["origin"]["position"];
        let ahead = if leg.starts_with("front") { 0.16 } else { -0.16 };
        position[0] = json!(position[0].as_f64().unwrap() - ahead);
    }
    for leg in ["front_left", "front_right", "hind_left", "hind_right"] {
        let ahead = if leg.starts_with("front") { 0.16 } else { -0.16 };
        let link = json!({"name": format!("{leg}_carrier"), "density": 500,
            "shapes": [{"kind": "sphere", "radius": 0.02, "pose": {"position": [0, 0, 0.1]}}]});
        document["links"].as_array_mut().unwrap().push(link);
        let joint = json!({"name": format!("{leg}_abduction"), "kind": "revolute", "parent": "trunk",
            "child": format!("{leg}_carrier"), "origin": {"position": [ahead, 0, 0]}, "axis": [1, 0, 0],
            "limits": {"lower": -0.5, "upper": 0.5}, "actuation": {"max_torque": 6, "max_speed": 20}});
        document["joints"].as_array_mut().unwrap().push(joint);
    }
    compiled(&document)
}

/// Virtual work: where the motors of a leg turn a little and its loop stays closed, they do the work that lifts the foot against the force on
/// it, whatever joints they sit on.
#[test]
fn motors_on_either_side_of_a_loop_carry_the_foot() {
    for model in [common::example("pantograph.json"), pantograph_with_abduction()] {
        let stance = Stance::find(&model, &Scene::default());
        let legs = Legs::of(&model, &stance, [1.0, 0.0, 0.0]).expect("legs with closed loops");
        assert_eq!(legs.legs.len(), 4);
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for leg in &legs.legs {
            let names: Vec<&str> = leg.moved().map(|joint| &*model.joint_names[joint]).collect();
            let side = names[0].split('_').take(2).collect::<Vec<_>>().join("_");
            assert!(names.iter().all(|name| name.starts_with(&side)), "{names:?}");
            assert_eq!(leg.followers.len(), 2, "{names:?}");
            for _ in 0..20 {
                // Somewhere above where the foot stands, where both sides of the loop reach.
                let way =
                    Vector3::new(random.random_range(-0.03..0.03), 0.0, random.random_range(0.01..0.03));
                let mut own = leg.standing.clone();
                assert!(leg.reach(&mut own, leg.foot + way, Vector3::z()) < 1e-4);
                let mut angles = stance.angles.clone();
                leg.joints.iter().zip(own).for_each(|(&joint, angle)| angles[joint] = angle);
                let following = Following::new(&model, &angles, &leg.joints, &leg.followers).unwrap();
                assert!(following.open < 1e-9, "{:e}", following.open);
                leg.followers
                    .iter()
                    .zip(&following.angles)
                    .for_each(|(&joint, &angle)| angles[joint] = angle);
                let force = Vector3::from_fn(|_, _| random.random_range(-20.0..20.0));
                let own = |angles: &[f64]| leg.joints.iter().map(|&joint| angles[joint]).collect::<Vec<_>>();
                let placed = leg.place(&own(&angles));
                let asked: Vec<f64> = (0..leg.joints.len())
                    .map(|place| -placed.column(place, placed.foot).dot(&force))
                    .collect();
                let carried = following.carried(&asked).unwrap();
                for (joint, torque) in leg.moved().zip(carried) {
                    if !model.driven[joint] {
                        assert_eq!(torque, 0.0);
                        continue;
                    }
                    let turned = |by: f64| {
                        let mut angles = angles.clone();
                        angles[joint] += by;
                        assert!(close_loops(&model, &mut angles, |joint| model.driven[joint]) < 1e-9);
                        leg.place(&own(&angles)).foot
                    };
                    let lifted = (turned(1e-4) - turned(-1e-4)) / 2e-4;
                    let work = -lifted.dot(&force);
                    assert!(
                        (torque - work).abs() < 1e-5 * (1.0 + work.abs()),
                        "{torque} instead of {work} N m"
                    );
                }
            }
        }
    }
}

/// The targets of a gait keep all loops closed but for what the motors' springs give way by.
#[test]
fn a_gait_of_closed_chains_moves_both_sides_of_each_loop() {
    let LearningSetup { model, stance, scene, accuracy, task, .. } = setup();
    let subject = Subject::new(&model, &stance, &scene, &accuracy, task.direction).unwrap();
    let legs = &subject.legs;
    let wanted = Wanted::at_froude(legs, named("walk", legs).unwrap(), 0.05, 9.81);
    let mut parameters = vec![0.0; PARAMETERS];
    (parameters[PERIOD], parameters[LIFT]) = (-3.0, -2.0);
    // Its legs do not move to the side.
    parameters[SWAY] = -2.5;
    let (ring, gains) = subject.ring(&wanted, &parameters);
    assert!(ring.missed < 1e-3 * legs.length, "a foot misses its path by {} m", ring.missed);
    let hips = model.joint_names.iter().enumerate().filter(|(_, name)| name.ends_with("hip"));
    for (joint, name) in hips {
        let angles = ring.cycle.iter().map(|posture| posture.angles[joint]);
        let moved = angles.clone().fold(f64::MIN, f64::max) - angles.fold(f64::MAX, f64::min);
        assert!(moved > 0.1, "{name} moves by {moved} rad");
        assert!(gains.stiffness[joint] > 0.0);
    }
}

/// A leg whose loop leaves a joint that nothing drives has no program, and such a character is taught by QDSEGA.
#[test]
fn a_loop_with_a_motor_too_few_is_no_leg_of_a_leg_program() {
    let mut document = pantograph();
    let joints = document["joints"].as_array_mut().unwrap();
    let hip = joints.iter_mut().find(|joint| joint["name"] == "hind_left_aft_hip").unwrap();
    hip["actuation"] = Value::Null;
    let model = compiled(&document);
    let stance = Arc::new(Stance::find(&model, &Scene::default()));
    let legs = Legs::of(&model, &stance, [1.0, 0.0, 0.0]);
    assert!(matches!(legs, Err(NoGaits::Undecided { .. })), "{legs:?}");
    let walk = Task { gait: "walk".into(), ..Task::default() };
    let error = check_task(&walk, &model, &stance, &Scene::default()).unwrap_err().to_string();
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
