//! Free flight keeps momentum to rounding: every character, integrator, step and coordinate system.

use std::fmt::Write;
use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Coordinates, Effect, Integrator, Scene};
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::bodies;
use crate::common;

/// Greatest share of momentum that may be lost in a flight of [`SECONDS`].
const LOST: f64 = 1e-10;
const SECONDS: f64 = 10.0;

const METHODS: [(Integrator, Coordinates); 3] = [
    (Integrator::SemiImplicitEuler, Coordinates::Reduced),
    (Integrator::MoreauJean, Coordinates::Reduced),
    (Integrator::SemiImplicitEuler, Coordinates::Maximal),
];

fn three(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from([0; 3].map(|_| rng.random_range(-size..size)))
}

/// Spinning at 2 to 10 rad/s, with all joints moving.
fn spinning(model: &Model, rng: &mut ChaCha8Rng) -> State {
    let mut state = State::new(model);
    state.root.orientation = UnitQuaternion::from_scaled_axis(three(rng, 2.0));
    let speed = rng.random_range(2.0..10.0);
    state.root.angular_velocity = three(rng, 1.0).normalize() * speed;
    state.root.linear_velocity = three(rng, 1.0) + Vector3::new(1.0, 1.0, 1.0);
    for joint in 0..model.joint_count() {
        let [lower, upper] = model.limits[joint].unwrap_or([-1.0, 1.0]);
        state.angles[joint] = 0.5 * (lower + upper) + 0.2 * (upper - lower) * rng.random_range(-1.0..1.0);
        state.velocities[joint] = rng.random_range(-2.0..2.0);
    }
    state
}

/// Greatest shares of linear and angular momentum lost in `seconds` of flight, each of what there was, and the time for
/// which the flight was computed, s.
fn lost(
    model: &Arc<Model>,
    start: State,
    scene: &Scene,
    accuracy: &Accuracy,
    seconds: f64,
) -> ([f64; 2], f64) {
    let plan = common::plan(model, scene, accuracy, None);
    let gravity = plan.gravity * model.mass;
    let mut simulator = Simulator::new(plan, start);
    let before = simulator.momentum();
    let mut lost = [0.0_f64; 2];
    for _ in 0..(seconds / accuracy.step).round() as usize {
        if simulator.step(Command::Passive).is_err() {
            return (lost, simulator.state().time);
        }
        let now = simulator.momentum();
        let wanted = before.linear + gravity * simulator.state().time;
        lost[0] = lost[0].max((now.linear - wanted).norm() / before.linear.norm());
        lost[1] = lost[1].max((now.angular - before.angular).norm() / before.angular.norm());
    }
    (lost, seconds)
}

fn space() -> Scene {
    Scene { ground: None, gravity: [0.0; 3], ..Scene::default() }
}

#[test]
fn every_bundled_character_keeps_its_momentum_while_it_spins() {
    let mut rng = ChaCha8Rng::seed_from_u64(21);
    for name in
        ["quadruped.urdf", "biped.urdf", "hexapod.json", "snake.json", "fourbar.json", "pantograph.json"]
    {
        let model = common::example(name);
        for (integrator, coordinates) in METHODS {
            for step in [5e-4, 2e-3, 8e-3] {
                let maximal = coordinates == Coordinates::Maximal;
                if maximal && step < 8e-3 && name != "quadruped.urdf" {
                    continue;
                }
                let seconds = if maximal && step < 2e-3 { 1.0 } else { SECONDS };
                let accuracy = Accuracy { step, integrator, coordinates, ..Accuracy::default() };
                let start = spinning(&model, &mut rng);
                let ([linear, angular], flown) = lost(&model, start, &space(), &accuracy, seconds);
                assert!(
                    linear < LOST && angular < LOST && flown == seconds,
                    "{name}, {integrator:?}, {coordinates:?}, {step} s: {linear:e} {angular:e}"
                );
            }
        }
    }
}

#[test]
fn random_trees_keep_their_momentum_with_gravity_and_without() {
    let mut rng = ChaCha8Rng::seed_from_u64(22);
    let mut ended = 0;
    for case in 0..24 {
        let (integrator, coordinates) = METHODS[case % 3];
        let links = match coordinates {
            Coordinates::Reduced => [1, 2, 3, 4, 6, 8, 12, 20][case % 8],
            Coordinates::Maximal => 1 + case % 4,
        };
        let model = bodies::tree(&mut rng, links, false);
        let step = [5e-4, 1e-3, 2e-3, 4e-3, 8e-3][case % 5];
        let gravity = if case % 2 == 0 { [0.0; 3] } else { [0.3, -0.2, -9.81] };
        let scene = Scene { gravity, ..space() };
        let seconds = if coordinates == Coordinates::Maximal && step < 2e-3 { 2.0 } else { SECONDS };
        let accuracy = Accuracy { step, integrator, coordinates, ..Accuracy::default() };
        let start = spinning(&model, &mut rng);
        let ([linear, angular], flown) = lost(&model, start, &scene, &accuracy, seconds);
        // A whirl too fast for the finest substep ends a simulation with an error. Shortly before, bodies are so fast that
        // rounding is no longer small against the momentum of the whole.
        if flown < seconds {
            ended += 1;
            continue;
        }
        assert!(
            linear < LOST && angular < LOST,
            "case {case}, {links} links, {integrator:?}, {coordinates:?}, {step} s: {linear:e} {angular:e}"
        );
    }
    assert!(ended <= 6, "{ended} flights ended early");
}

/// The estimate of the error corrects positions and velocities, and momentum with them, also where limits stop joints and links touch
/// each other.
#[test]
fn error_control_keeps_momentum() {
    let mut rng = ChaCha8Rng::seed_from_u64(23);
    let model = common::example("quadruped.urdf");
    let without_rows = Scene {
        effects: common::without(&[Effect::JointLimits, Effect::JointFriction, Effect::SelfCollision])
            .effects,
        ..space()
    };
    for integrator in [Integrator::SemiImplicitEuler, Integrator::MoreauJean] {
        let accuracy = Accuracy { integrator, step_tolerance: Some(1e-5), ..Accuracy::default() };
        for scene in [&without_rows, &space()] {
            let ([linear, angular], flown) = lost(&model, spinning(&model, &mut rng), scene, &accuracy, 2.0);
            assert!(
                linear < LOST && angular < LOST && flown == 2.0,
                "{integrator:?}: {linear:e} {angular:e}"
            );
        }
    }
}

/// Ground that is not reached leaves every bit as it is without ground.
#[test]
fn ground_that_is_not_touched_changes_no_bit() {
    let mut rng = ChaCha8Rng::seed_from_u64(24);
    let model = common::example("quadruped.urdf");
    for integrator in [Integrator::SemiImplicitEuler, Integrator::MoreauJean] {
        let mut start = spinning(&model, &mut rng);
        start.root.position.z = 3.0;
        start.root.linear_velocity.z = 2.0;
        let accuracy = Accuracy { integrator, ..Accuracy::default() };
        let [mut over_ground, mut in_space] = [Scene::default(), Scene { ground: None, ..Scene::default() }]
            .map(|scene| Simulator::new(common::plan(&model, &scene, &accuracy, None), start.clone()));
        for _ in 0..200 {
            over_ground.step(Command::Passive).unwrap();
            in_space.step(Command::Passive).unwrap();
            assert_eq!(over_ground.state().root, in_space.state().root);
            assert_eq!(over_ground.state().velocities, in_space.state().velocities);
        }
    }
}

/// A hundred rods of 50 g and 5 cm on a weight of 1 kg, spinning straight at 20 rad/s, by the default settings: momentum is
/// kept to rounding, and no energy comes of the waves that the step does not resolve.
#[test]
fn a_thrown_chain_keeps_its_momentum_by_the_default_settings() {
    let mut text = String::from(
        r#"<robot name="chain"><link name="l0"><inertial><mass value="1"/>
        <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>"#,
    );
    for link in 1..=100 {
        let at = if link == 1 { 0.0 } else { -0.05 };
        let _ = write!(
            text,
            r#"<link name="l{link}"><inertial><origin xyz="0 0 -0.025"/><mass value="0.05"/>
            <inertia ixx="1.05e-5" ixy="0" ixz="0" iyy="1.05e-5" iyz="0" izz="1e-6"/></inertial></link>
            <joint name="j{link}" type="continuous"><parent link="l{}"/><child link="l{link}"/>
            <origin xyz="0 0 {at}"/><axis xyz="0 1 0"/></joint>"#,
            link - 1
        );
    }
    text.push_str("</robot>");
    let model = bodies::urdf(&text, false);
    let mut start = State::new(&model);
    start.root.angular_velocity.y = 20.0;
    let plan = common::plan(&model, &space(), &Accuracy::default(), None);
    let mut simulator = Simulator::new(plan, start);
    let (before, energy) = (simulator.momentum(), simulator.energy().kinetic);
    for _ in 0..(1.0 / Accuracy::default().step) as usize {
        simulator.step(Command::Passive).unwrap();
        let now = simulator.momentum();
        let linear = (now.linear - before.linear).norm() / before.linear.norm();
        let angular = (now.angular - before.angular).norm() / before.angular.norm();
        assert!(linear < LOST && angular < LOST, "{linear:e} {angular:e}");
        assert!(simulator.energy().kinetic < 1.05 * energy, "{} of {energy} J", simulator.energy().kinetic);
    }
}

/// Twelve rods of 100 g and 10 cm, with joints about x and y in turns and no damping.
fn string_of_rods() -> Arc<Model> {
    let inertial = r#"<inertial><origin xyz="0 0 -0.05"/><mass value="0.1"/>
        <inertia ixx="8.4e-5" ixy="0" ixz="0" iyy="8.4e-5" iyz="0" izz="5e-6"/></inertial>"#;
    let mut text = format!(r#"<robot name="string"><link name="l0">{inertial}</link>"#);
    for link in 1..12 {
        let axis = if link % 2 == 0 { "0 1 0" } else { "1 0 0" };
        let _ = write!(
            text,
            r#"<link name="l{link}">{inertial}</link>
            <joint name="j{link}" type="continuous"><parent link="l{}"/><child link="l{link}"/>
            <origin xyz="0 0 -0.1"/><axis xyz="{axis}"/></joint>"#,
            link - 1
        );
    }
    text.push_str("</robot>");
    bodies::urdf(&text, false)
}

/// The string whirling at `rate` rad/s, all its joints moving.
fn whirl(model: &Arc<Model>, rate: f64, accuracy: &Accuracy) -> Simulator {
    let mut start = State::new(model);
    start.root.angular_velocity = Vector3::new(rate, 0.3 * rate, 0.0);
    start.root.linear_velocity.y = 1.0;
    for joint in 0..model.joint_count() {
        let phase = joint as f64;
        start.angles[joint] = 0.3 * (1.7 * phase).sin();
        start.velocities[joint] = 0.5 * rate * (2.3 * phase).cos();
    }
    Simulator::new(common::plan(model, &space(), accuracy, None), start)
}

/// Nothing acts on it, so that its energy is what it was: to a hundredth for ten seconds, at any of these steps, in the paper's
/// step as in the other. The rigid part of the energy follows from the pose, which is of first order.
#[test]
fn a_whirling_string_keeps_its_energy_at_any_step() {
    let model = string_of_rods();
    for integrator in [Integrator::SemiImplicitEuler, Integrator::MoreauJean] {
        for step in [4e-3, 2e-3, 1e-3, 5e-4] {
            let accuracy = Accuracy { step, integrator, ..Accuracy::default() };
            let mut simulator = whirl(&model, 10.0, &accuracy);
            let before = simulator.energy().kinetic;
            for _ in 0..(SECONDS / step).round() as usize {
                simulator.step(Command::Passive).unwrap();
                let now = simulator.energy().kinetic;
                assert!(
                    (now - before).abs() <= 0.01 * before,
                    "{integrator:?}, {step} s: {now} of {before} J at {} s",
                    simulator.state().time
                );
            }
        }
    }
}

/// Keeping energy and momentum leaves the paper's step its order: where the string's end is after a fifth of a second, against the other
/// integrator at a finer step.
#[test]
fn a_whirling_string_converges_with_the_step() {
    let model = string_of_rods();
    let end = |accuracy: &Accuracy| {
        let mut simulator = whirl(&model, 10.0, accuracy);
        for _ in 0..(0.2 / accuracy.step).round() as usize {
            simulator.step(Command::Passive).unwrap();
        }
        simulator.link_poses()[11].translation.vector
    };
    let truth = end(&Accuracy { step: 1.25e-4, integrator: Integrator::MoreauJean, ..Accuracy::default() });
    let errors = [1e-3, 5e-4, 2.5e-4, 1.25e-4]
        .map(|step| (end(&Accuracy { step, ..Accuracy::default() }) - truth).norm());
    for pair in errors.windows(2) {
        assert!((1.5..3.0).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

/// A push gives all of a character another velocity, in the middle of a run and in both coordinate systems.
#[test]
fn a_push_moves_the_whole_character() {
    let model = common::example("quadruped.urdf");
    let push = Vector3::new(0.3, -0.5, 0.2);
    for (integrator, coordinates) in METHODS {
        let accuracy = Accuracy { integrator, coordinates, ..Accuracy::default() };
        let plan = common::plan(&model, &common::without(&[Effect::Gravity]), &accuracy, None);
        let mut simulator = Simulator::new(plan, spinning(&model, &mut ChaCha8Rng::seed_from_u64(5)));
        (0..20).for_each(|_| simulator.step(Command::Passive).unwrap());
        let before = simulator.momentum();
        let mut state = simulator.state().clone();
        state.push(push);
        simulator.set_state(&state);
        (0..20).for_each(|_| simulator.step(Command::Passive).unwrap());
        let gained = (simulator.momentum().linear - before.linear) / model.mass;
        assert!((gained - push).norm() < 1e-10, "{integrator:?}, {coordinates:?}: {gained} m/s");
    }
}
