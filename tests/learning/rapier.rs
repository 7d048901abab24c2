//! The comparison engine: that it simulates the same character, and refuses what it cannot do.

use crate::bodies;
use crate::common;

use std::sync::Arc;

use bodies::{Bar, Hanging};
use gaitwright_learning::accuracy::rapier::{Rapier, Unsupported};
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{
    Accuracy, Effect, Feedforward, FrictionCone, Gains, Scene, StepPlan, Switch,
};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;
use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const GRAVITY: f64 = 9.81;

/// The default scene with what rapier can do in it.
fn scene() -> Scene {
    common::without(&[Effect::SelfCollision])
}

fn rapier(model: &Arc<Model>, plan: &Arc<StepPlan>, state: &State) -> Rapier {
    Rapier::new(model, plan, state).unwrap_or_else(|error| panic!("{error}"))
}

fn run(rapier: &mut Rapier, steps: usize, command: Command<'_>) {
    for _ in 0..steps {
        rapier.step(command).unwrap_or_else(|failure| panic!("{failure}"));
    }
}

/// Greatest difference of two states in joint angles (rad, m), the root's position (m) and its turn (rad).
fn distance(a: &State, b: &State) -> f64 {
    let joints = a.angles.iter().zip(&b.angles).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let turn = a.root.orientation.angle_to(&b.root.orientation);
    joints.max((a.root.position - b.root.position).norm()).max(turn)
}

fn tumbling(model: &Model, rng: &mut ChaCha8Rng) -> State {
    let mut state = State::new(model);
    let mut three = |size: f64| Vector3::from([0; 3].map(|_| rng.random_range(-size..size)));
    state.root.orientation = UnitQuaternion::from_scaled_axis(three(2.0));
    state.root.angular_velocity = three(3.0);
    state.root.linear_velocity = three(1.0);
    for joint in 0..model.joint_count() {
        state.angles[joint] = rng.random_range(-1.0..1.0);
        state.velocities[joint] = rng.random_range(-3.0..3.0);
    }
    state
}

#[test]
fn a_state_is_taken_over_and_read_back() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for links in [1, 2, 7] {
        let model = bodies::tree(&mut rng, links, false);
        let start = tumbling(&model, &mut rng);
        let step = 1e-6;
        let plan = common::free_flight(&model, step);
        let mut other = rapier(&model, &plan, &start);
        run(&mut other, 1, Command::Passive);
        // A millionth of a second at some 10 rad/s, and at some 1000 rad/s².
        assert!(distance(other.state(), &start) < 1e-4);
        let rates = |state: &State| {
            let root = [state.root.linear_velocity, state.root.angular_velocity];
            root.iter()
                .flat_map(|v| v.iter().copied())
                .chain(state.velocities.iter().copied())
                .collect::<Vec<_>>()
        };
        for (found, wanted) in rates(other.state()).iter().zip(rates(&start)) {
            assert!((found - wanted).abs() < 1e-2, "{found} instead of {wanted}");
        }
    }
}

/// Free fall is exact up to semi-implicit Euler's own g t h / 2, with h the substep.
#[test]
fn free_fall_is_a_parabola() {
    let model = common::example("quadruped.urdf");
    let (step, seconds) = (0.002, 0.5);
    let plan = common::free_flight(&model, step);
    let mut other = rapier(&model, &plan, &State::new(&model));
    run(&mut other, (seconds / step) as usize, Command::Passive);
    let wanted = -0.5 * GRAVITY * seconds * seconds;
    let error = wanted - other.state().root.position.z;
    assert!((0.0..0.5 * GRAVITY * seconds * step).contains(&error), "{error} m");
    assert!((other.state().time - seconds).abs() < 1e-12);
}

/// Both engines, each at its first order, approach the same motion of a tumbling tree.
#[test]
fn tumbling_trees_move_as_in_our_own_engine() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let seconds = 0.2;
    let mut errors = [0.0; 3];
    for links in [1, 2, 3, 5, 9] {
        for fixed_base in [false, true] {
            if fixed_base && links == 1 {
                continue;
            }
            let model = bodies::tree(&mut rng, links, fixed_base);
            let mut start = tumbling(&model, &mut rng);
            if fixed_base {
                start.root = State::new(&model).root;
            }
            let fine = 1e-5;
            let mut own = Simulator::new(common::free_flight(&model, fine), start.clone());
            for _ in 0..(seconds / fine).round() as usize {
                own.step(Command::Passive).unwrap();
            }
            for (error, step) in errors.iter_mut().zip([4e-3, 2e-3, 1e-3]) {
                let mut other = rapier(&model, &common::free_flight(&model, step), &start);
                run(&mut other, (seconds / step).round() as usize, Command::Passive);
                *error += distance(other.state(), own.state());
            }
        }
    }
    for pair in errors.windows(2) {
        assert!((1.5..2.5).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

#[test]
fn a_pendulum_swings_with_the_period_of_its_closed_form() {
    let bar = Bar { mass: 1.0, center: 0.5, length: 1.0, inertia: 0.09 };
    let model = bodies::chain(Hanging::Bolted, &[bar], "");
    let about_hinge = bar.inertia + bar.mass * bar.center * bar.center;
    let rate = (bar.mass * GRAVITY * bar.center / about_hinge).sqrt();
    let step = 0.001;
    for amplitude in [0.05_f64, 1.0, 2.5] {
        // T = 2π / (ω₀ M(1, cos(θ₀ / 2))), with M the arithmetic-geometric mean.
        let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
        for _ in 0..20 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        let wanted = std::f64::consts::TAU / (rate * a);
        let mut state = State::new(&model);
        state.angles[0] = amplitude;
        let mut other = rapier(&model, &common::free_flight(&model, step), &state);
        let mut crossings = Vec::new();
        while crossings.len() < 3 {
            let before = other.state().angles[0];
            other.step(Command::Passive).unwrap();
            let after = other.state().angles[0];
            if (before > 0.0) != (after > 0.0) {
                crossings.push(other.state().time - step * after / (after - before));
            }
            assert!(other.state().time < 10.0, "no third crossing");
        }
        let period = crossings[2] - crossings[0];
        assert!((period / wanted - 1.0).abs() < 1e-3, "{period} s instead of {wanted} s");
    }
}

#[test]
fn torques_accelerate_joints_as_in_our_own_engine() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let step = 1e-5;
    for links in [2, 4, 8] {
        let model = bodies::tree(&mut rng, links, false);
        let mut start = State::new(&model);
        start.angles.iter_mut().for_each(|angle| *angle = rng.random_range(-1.0..1.0));
        let torque: Vec<f64> = start.angles.iter().map(|_| rng.random_range(-2.0..2.0)).collect();
        let plan = common::free_flight(&model, step);
        let mut own = Simulator::new(plan.clone(), start.clone());
        let mut other = rapier(&model, &plan, &start);
        own.step(Command::Torque(&torque)).unwrap();
        run(&mut other, 1, Command::Torque(&torque));
        let scale = own.state().velocities.iter().fold(0.0, |most: f64, rate| most.max(rate.abs()));
        for (found, wanted) in other.state().velocities.iter().zip(&own.state().velocities) {
            assert!((found - wanted).abs() < 1e-3 * scale, "{found} instead of {wanted} rad/s");
        }
        // The torque was for that step alone.
        let kept = other.state().velocities.clone();
        run(&mut other, 1, Command::Passive);
        for (before, after) in kept.iter().zip(&other.state().velocities) {
            assert!((before - after).abs() < 1e-2 * scale, "{before} became {after} rad/s");
        }
    }
}

fn gains(stiffness: f64, damping: f64, max_torque: Option<f64>) -> Gains {
    let feedforward = Feedforward::None;
    Gains {
        stiffness: vec![stiffness],
        damping: vec![damping],
        max_torque: vec![max_torque],
        feedforward,
        ..Gains::default()
    }
}

/// A bar that follows a moving target, against our own engine at a fine step.
#[test]
fn a_motor_follows_a_moving_target_as_the_drive_does() {
    let bar = Bar { mass: 1.0, center: 0.5, length: 1.0, inertia: 0.09 };
    let model = bodies::chain(Hanging::Bolted, &[bar], "");
    let target = |time: f64| 0.5 * (4.0 * time).sin();
    let steps = [4e-3, 2e-3, 1e-3];
    let mut errors = [0.0; 3];
    for (stiffness, damping, max_torque) in [(40.0, 1.0, None), (40.0, 1.0, Some(4.0)), (10.0, 5.0, None)] {
        let gains = gains(stiffness, damping, max_torque);
        let scene = Scene { ground: None, ..scene() };
        let plan =
            |step| common::plan(&model, &scene, &Accuracy { step, ..Accuracy::default() }, Some(&gains));
        let fine = 1e-5;
        let mut own = Simulator::new(plan(fine), State::new(&model));
        for index in 0..(1.0 / fine).round() as usize {
            let (now, next) = (target(index as f64 * fine), target((index + 1) as f64 * fine));
            own.step(Command::Track { now: &[now], next: &[next] }).unwrap();
        }
        for (error, step) in errors.iter_mut().zip(steps) {
            let mut other = rapier(&model, &plan(step), &State::new(&model));
            for index in 0..(1.0 / step).round() as usize {
                let (now, next) = (target(index as f64 * step), target((index + 1) as f64 * step));
                other.step(Command::Track { now: &[now], next: &[next] }).unwrap();
            }
            *error += distance(other.state(), own.state());
        }
    }
    for pair in errors.windows(2) {
        assert!((1.5..2.5).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

#[test]
fn a_joint_rests_on_its_limit() {
    let bar = Bar { mass: 1.0, center: 0.5, length: 1.0, inertia: 0.09 };
    let model =
        bodies::chain(Hanging::Bolted, &[bar], r#"<limit lower="0.3" upper="2" effort="10" velocity="10"/>"#);
    let scene = Scene { ground: None, ..scene() };
    let mut state = State::new(&model);
    state.angles[0] = 1.0;
    let mut other = rapier(&model, &common::plan(&model, &scene, &Accuracy::default(), None), &state);
    run(&mut other, 2000, Command::Passive);
    let resting = other.state();
    assert!((resting.angles[0] - 0.3).abs() < 1e-3 && resting.velocities[0].abs() < 0.1, "{resting:?}");
}

#[test]
fn dry_friction_damping_and_armature_are_the_models_own() {
    let bar = Bar { mass: 1.0, center: 0.5, length: 1.0, inertia: 0.09 };
    let model = bodies::chain(Hanging::Bolted, &[bar], r#"<dynamics damping="0.3" friction="0.2"/>"#);
    let scene = Scene { ground: None, gravity: [0.0; 3], ..scene() };
    let mut state = State::new(&model);
    state.velocities[0] = 2.0;
    // I q̈ = −f − D q̇: q̇ = (q̇₀ + f / D) exp(−D t / I) − f / D until it stops.
    let (about_hinge, damping, friction) = (0.34, 0.3, 0.2_f64);
    let step = 0.001;
    let plan = common::plan(&model, &scene, &Accuracy { step, ..Accuracy::default() }, None);
    let mut other = rapier(&model, &plan, &state);
    run(&mut other, 500, Command::Passive);
    let wanted = (2.0 + friction / damping) * f64::exp(-damping * 0.5 / about_hinge) - friction / damping;
    assert!((other.state().velocities[0] - wanted).abs() < 2.0 * step, "{:?}", other.state());
    run(&mut other, 3500, Command::Passive);
    assert!(other.state().velocities[0].abs() < 1e-6, "{:?}", other.state());
}

#[test]
fn a_sliding_cube_stops_where_coulomb_says() {
    let model = bodies::cube();
    let (speed, friction, step) = (2.0, 0.8, 0.002);
    let mut state = State::new(&model);
    state.root.position.z = 0.1;
    state.root.linear_velocity.x = speed;
    let plan = common::plan(&model, &Scene { friction, ..scene() }, &Accuracy::default(), None);
    let mut other = rapier(&model, &plan, &state);
    run(&mut other, 500, Command::Passive);
    let wanted = speed * speed / (2.0 * friction * GRAVITY);
    let root = other.state().root;
    assert!((root.position.x - wanted).abs() < speed * step, "{root:?}");
    assert!(root.linear_velocity.norm() < 1e-3, "{root:?}");
}

#[test]
fn a_robot_stands_as_high_as_in_our_own_engine() {
    for name in ["quadruped.urdf", "hexapod.json", "biped.urdf", "snake.json"] {
        let model = common::example(name);
        let stance = Stance::find(&model, &Scene::default());
        let gains = Gains { feedforward: Feedforward::None, ..stance.gains.clone() };
        let plan = common::plan(&model, &scene(), &Accuracy::default(), Some(&gains));
        let hold = Command::Track { now: &stance.angles, next: &stance.angles };
        let mut own = Simulator::new(plan.clone(), stance.state.clone());
        let mut other = rapier(&model, &plan, &stance.state);
        for _ in 0..2000 {
            own.step(hold).unwrap();
        }
        run(&mut other, 2000, hold);
        let heights = [own.state(), other.state()].map(|state| state.root.position.z);
        assert!((heights[0] - heights[1]).abs() < 2e-3, "{name}: {heights:?} m");
        assert!(other.state().root.linear_velocity.norm() < 1e-2, "{name}: {:?}", other.state().root);
    }
}

#[test]
fn what_rapier_cannot_do_is_refused() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let plain = Gains { feedforward: Feedforward::None, ..stance.gains.clone() };
    let new = |scene: &Scene, accuracy: &Accuracy, gains: &Gains| {
        let plan = common::plan(&model, scene, accuracy, Some(gains));
        Rapier::new(&model, &plan, &stance.state).err()
    };
    let (scene, accuracy) = (scene(), Accuracy::default());
    assert_eq!(new(&scene, &accuracy, &plain), None);
    let missing = |error: Option<Unsupported>| matches!(error, Some(Unsupported::Missing(_)));
    let inseparable = |error: Option<Unsupported>| matches!(error, Some(Unsupported::Inseparable(_)));
    let forward = Gains { feedforward: Feedforward::ContactFree, ..plain.clone() };
    assert!(missing(new(&scene, &accuracy, &forward)));
    let pyramid = Accuracy { friction_cone: FrictionCone::Pyramid, ..accuracy };
    assert!(missing(new(&scene, &pyramid, &plain)));
    assert!(missing(new(&Scene::default(), &accuracy, &plain)), "self-collision");
    let mut locked = scene.clone();
    locked.effects.insert(Effect::TrunkRotationLock, Switch::On);
    assert!(missing(new(&locked, &accuracy, &plain)));
    assert!(inseparable(new(
        &common::without(&[Effect::SelfCollision, Effect::VelocityForces]),
        &accuracy,
        &plain
    )));
    assert!(inseparable(new(
        &common::without(&[Effect::SelfCollision, Effect::Stabilization]),
        &accuracy,
        &plain
    )));
    // What is not asked for is no reason to refuse.
    assert_eq!(new(&common::without(&[Effect::SelfCollision, Effect::Friction]), &pyramid, &plain), None);
}

#[test]
fn a_state_that_is_not_finite_ends_the_simulation() {
    let model = bodies::tree(&mut ChaCha8Rng::seed_from_u64(4), 3, false);
    let mut state = State::new(&model);
    state.velocities[1] = f64::INFINITY;
    let mut other = rapier(&model, &common::free_flight(&model, 1e-3), &state);
    let failure = other.step(Command::Passive).unwrap_err();
    assert_eq!(failure.time, 1e-3);
    assert!(failure.cause.to_string().contains("non-finite"), "{failure}");
}
