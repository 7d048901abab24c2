//! Maximal coordinates, the paper's own system, beside reduced ones.

use crate::common;

mod chains;
mod one_step;

use std::sync::Arc;

use gaitwright_physics::character::Character;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{
    Accuracy, Coordinates, Effect, Gains, JointBias, Scene, SolverChoice, SolverKind, StepPlan,
};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;
use nalgebra::Vector3;

fn maximal(joint_bias: JointBias) -> Accuracy {
    let solver = SolverChoice { kind: SolverKind::Newton, iterations: 2_000, tolerance: 1e-13 };
    Accuracy { coordinates: Coordinates::Maximal, joint_bias, solver, ..Accuracy::default() }
}

/// The same settings in joint coordinates.
fn reduced(accuracy: Accuracy) -> Accuracy {
    Accuracy { coordinates: Coordinates::Reduced, ..accuracy }
}

/// How far apart the joints and the root of both coordinates are after 0.02 s in which the joints are driven
/// toward `targets`, m or rad.
fn divergence(
    model: &Arc<Model>,
    scene: &Scene,
    gains: &Gains,
    state: &State,
    targets: &[f64],
    step: f64,
) -> f64 {
    let accuracy = Accuracy { step, ..maximal(JointBias::Paper) };
    let [ours, theirs] = [accuracy, reduced(accuracy)].map(|accuracy| {
        let plan = common::plan(model, scene, &accuracy, Some(gains));
        let mut simulator = Simulator::new(plan, state.clone());
        for _ in 0..(0.02 / step).round() as usize {
            simulator.step(Command::Track { now: targets, next: targets }).unwrap();
        }
        simulator.state().clone()
    });
    let joints = ours.angles.iter().zip(&theirs.angles).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    joints.max((ours.root.position - theirs.root.position).amax())
}

#[test]
fn the_paper_s_own_rows_converge_to_joint_coordinates_at_first_order() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let targets = stance.angles;
    let gains = Gains { max_torque: vec![None; targets.len()], ..stance.gains };
    for airborne in [true, false] {
        let mut scene = common::without(&[Effect::JointLimits, Effect::JointFriction]);
        let mut state = stance.state.clone();
        // In the air it tumbles; on the ground its feet slide.
        if airborne {
            scene.ground = None;
            state.root.angular_velocity = Vector3::new(1.0, 2.0, 3.0);
        } else {
            state.root.linear_velocity.x = 1.0;
        }
        for (joint, velocity) in state.velocities.iter_mut().enumerate() {
            *velocity = if joint % 2 == 0 { 1.0 } else { -0.75 };
        }
        let errors =
            [5e-5, 2.5e-5, 1.25e-5].map(|step| divergence(&model, &scene, &gains, &state, &targets, step));
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((1.8..2.2).contains(&ratio), "airborne {airborne}: errors {errors:?}");
        }
    }
}

#[test]
fn a_kept_state_goes_on_bit_for_bit() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let plan = common::plan(&model, &Scene::default(), &maximal(JointBias::Consistent), Some(&stance.gains));
    let mut simulator = Simulator::new(plan.clone(), stance.state.clone());
    let targets = Command::Track { now: &stance.angles, next: &stance.angles };
    let run = |simulator: &mut Simulator| {
        for _ in 0..50 {
            simulator.step(targets).unwrap();
        }
        simulator.state().clone()
    };
    let kept = run(&mut simulator);
    let end = run(&mut simulator);
    assert_eq!(run(&mut Simulator::new(plan, kept.clone())), end);
    // A pose given by hand is taken as it is.
    let mut moved = kept;
    moved.root.position.z += 1.0;
    moved.forget();
    simulator.set_state(&moved);
    simulator.step(targets).unwrap();
    assert!((simulator.state().root.position.z - moved.root.position.z).abs() < 0.01);
}

#[test]
fn free_flight_keeps_momentum() {
    let model = common::example("quadruped.urdf");
    let plan_of = |accuracy| {
        let scene = Scene {
            ground: None,
            gravity: [0.0; 3],
            ..common::without(&[Effect::JointLimits, Effect::JointFriction])
        };
        common::plan(&model, &scene, &accuracy, None)
    };
    for joint_bias in [JointBias::Consistent, JointBias::Paper] {
        let mut state = State::new(&model);
        state.root.linear_velocity = Vector3::new(0.3, -0.2, 0.1);
        state.root.angular_velocity = Vector3::new(1.0, 2.0, -1.0);
        state.velocities.iter_mut().for_each(|velocity| *velocity = 2.0);
        let mut simulator = Simulator::new(plan_of(maximal(joint_bias)), state);
        let start = simulator.momentum();
        for _ in 0..500 {
            simulator.step(Command::Passive).unwrap();
        }
        let end = simulator.momentum();
        // What joints transmit acts on both bodies alike: linear momentum is kept to rounding whatever the step,
        // angular momentum within the order of the method, a share of ω h a radian of turning.
        assert!((end.linear - start.linear).norm() <= 1e-9 * start.linear.norm(), "{joint_bias:?}");
        let lost = (end.angular - start.angular).norm() / start.angular.norm();
        assert!(lost <= 0.01, "{joint_bias:?}: angular momentum changed by {lost:e} of it");
    }
}

#[test]
fn a_body_without_inertia_of_its_own_is_refused() {
    let model = common::example("quadruped.urdf");
    let mut character = Character::clone(&model.character);
    let place = character.links.iter().position(|link| link.joint.is_some()).unwrap();
    character.links[place].inertial = None;
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let compile = |accuracy| StepPlan::compile(&Scene::default(), &accuracy, None, &model);
    let error = compile(maximal(JointBias::Consistent)).unwrap_err().to_string();
    assert!(error.contains("/accuracy/coordinates"), "{error}");
    assert!(error.contains(&model.character.links[place].name), "{error}");
    assert!(compile(reduced(maximal(JointBias::Consistent))).is_ok());
}
