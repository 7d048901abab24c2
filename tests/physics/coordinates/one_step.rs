//! One step of the examples and of robots from elsewhere, in contact, at limits, saturated and locked.

use std::sync::Arc;

use gaitwright_physics::character::Character;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Effect, Feedforward, Gains, JointBias, Scene, Switch, Terrain};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::resting_height;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{common, maximal, reduced};
use crate::bodies::{self, Bar, Hanging};

/// One step in both coordinates may differ by this share of the greatest velocity in it.
const ROUNDING: f64 = 1e-9;

/// The examples that stand or lie on the ground.
fn examples() -> Vec<Arc<Character>> {
    ["quadruped.urdf", "biped.urdf", "hexapod.json", "snake.json"]
        .map(|name| common::character(&common::example_path(name)))
        .into()
}

/// A box on its four lower corners, with two bars hinged in it.
fn cart() -> Arc<Character> {
    let bar = Bar { mass: 0.5, center: 0.1, length: 0.2, inertia: 0.002 };
    let limit = r#"<limit lower="-1" upper="1" effort="30" velocity="10"/>"#;
    bodies::chain(Hanging::Cart(5.0, [0.2, 0.15, 0.1]), &[bar, bar], limit).character.clone()
}

/// How many cases there were of what.
#[derive(Debug, Default)]
struct Counts {
    cases: usize,
    touching: usize,
    limited: usize,
    saturated: usize,
    /// More than three contacts, and without friction for that.
    many: usize,
    /// Left out: the step was divided.
    divided: usize,
}

/// The same character with rotors, damping and dry friction in every joint.
fn lossy(character: &Character, rng: &mut ChaCha8Rng) -> Arc<Character> {
    let mut character = character.clone();
    for joint in character.links.iter_mut().filter_map(|link| link.joint.as_mut()) {
        joint.armature = rng.random_range(0.0..0.05);
        joint.damping = rng.random_range(0.0..0.5);
        joint.friction = rng.random_range(0.0..0.5);
    }
    Arc::new(character)
}

/// A state near the ground, or in it by a little, with some joints at the ends of their range or beyond.
fn random_state(model: &Model, rng: &mut ChaCha8Rng) -> State {
    let mut state = State::new(model);
    for (joint, limit) in model.limits.iter().enumerate() {
        let [lower, upper] = limit.unwrap_or([-1.0, 1.0]);
        let beyond = if model.fixed_base { 0.0 } else { rng.random_range(-0.01..0.01) };
        let share = match rng.random_range(0..6) {
            0 => beyond,
            1 => 1.0 + beyond,
            _ => rng.random_range(0.0..1.0),
        };
        state.angles[joint] = lower + share * (upper - lower);
        state.velocities[joint] = rng.random_range(-3.0..3.0);
    }
    // A character that is bolted could be asked for what it cannot do both: leave the ground and its limits.
    let depth = if model.fixed_base { -1e-3..0.0 } else { -1e-3..2e-3 };
    state.root.position.z =
        resting_height(model, &state.angles, &Terrain::Plane { height: 0.0 }) - rng.random_range(depth);
    if !model.fixed_base {
        state.root.orientation =
            UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, rng.random_range(-3.0..3.0)));
        let mut any = || Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
        (state.root.linear_velocity, state.root.angular_velocity) = (any(), any());
    }
    state
}

fn random_gains(joints: usize, feedforward: Feedforward, rng: &mut ChaCha8Rng) -> Gains {
    let mut values = |low: f64, high: f64| (0..joints).map(|_| rng.random_range(low..high)).collect();
    let (stiffness, damping): (Vec<f64>, Vec<f64>) = (values(0.0, 200.0), values(0.0, 5.0));
    let greatest: Vec<f64> = values(0.0, 30.0);
    // Some unlimited, some far below what is asked.
    let max_torque = greatest.into_iter().map(|limit| (limit < 25.0).then_some(0.1 + limit)).collect();
    Gains { stiffness, damping, max_torque, feedforward, ..Gains::default() }
}

/// The greatest number in a state's velocities.
fn speed(state: &State) -> f64 {
    let root = state.root.linear_velocity.iter().chain(&state.root.angular_velocity);
    root.chain(&state.velocities).fold(1.0, |greatest, number| greatest.max(number.abs()))
}

/// The greatest difference of two states' velocities.
fn difference(left: &State, right: &State) -> f64 {
    let root = (left.root.linear_velocity - right.root.linear_velocity)
        .amax()
        .max((left.root.angular_velocity - right.root.angular_velocity).amax());
    left.velocities.iter().zip(&right.velocities).map(|(a, b)| (a - b).abs()).fold(root, f64::max)
}

/// Compares one step of each character in both coordinates, `each` times from a random state.
fn compare(characters: &[Arc<Character>], each: usize) {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let feedforwards = [Feedforward::None, Feedforward::ContactFree, Feedforward::ContactAware];
    let mut counts = Counts::default();
    for character in characters {
        for case in 0..each {
            let character = if case % 2 == 0 { character.clone() } else { lossy(character, &mut rng) };
            let fixed_base = case % 4 == 3;
            let model = Arc::new(Model::new(character, Base::fixed_if(fixed_base)));
            // Drawn poses overlap, and no motion takes such links apart at once.
            let friction = if case % 24 < 12 { 0.8 } else { 0.0 };
            let mut scene = Scene { friction, ..common::without(&[Effect::SelfCollision]) };
            if case % 3 == 1 && !fixed_base {
                scene.effects.insert(Effect::TrunkRotationLock, Switch::On);
            }
            let mut gains = random_gains(model.joint_count(), feedforwards[case % 3], &mut rng);
            let state = random_state(&model, &mut rng);
            let now: Vec<f64> = state.angles.iter().map(|it| it + rng.random_range(-0.2..0.2)).collect();
            let next: Vec<f64> = now.iter().map(|it| it + rng.random_range(-0.004..0.004)).collect();
            let accuracy = maximal(JointBias::Consistent);
            let step = |scene: &Scene, gains: &Gains| {
                [accuracy, reduced(accuracy)].map(|accuracy| {
                    let plan = common::plan(&model, scene, &accuracy, Some(gains));
                    let mut simulator = Simulator::new(plan, state.clone());
                    let command = match case % 5 {
                        4 => Command::Torque(&now),
                        _ => Command::Track { now: &now, next: &next },
                    };
                    simulator.step(command).unwrap();
                    simulator
                })
            };
            let mut both = step(&scene, &gains);
            // How more than three points share the load is not determined. With friction, which depends on it, or a
            // torque found from it there is more than one answer; without, the velocities are those of
            // the least of a convex function, and there is one.
            if both[1].contacts().count() > 3 {
                scene.friction = 0.0;
                gains.feedforward = Feedforward::ContactFree;
                both = step(&scene, &gains);
                counts.many += 1;
            }
            let [ours, theirs] = both;
            // The first step is looked at twice ahead. In the second part of a divided one the bodies' own places
            // differ from those of the joints.
            if theirs.substeps() > 3 {
                counts.divided += 1;
                continue;
            }
            let name = &model.character.name;
            let scale = speed(&state).max(speed(theirs.state()));
            for simulator in [&ours, &theirs] {
                let residual = simulator.residual();
                assert!(residual <= 0.1 * ROUNDING * scale, "{name}, case {case}: residual {residual:e}");
            }
            let apart = difference(ours.state(), theirs.state());
            assert!(apart <= ROUNDING * scale, "{name}, case {case}: {apart:e} of {scale}");
            let torque = theirs.torques().iter().fold(1.0_f64, |greatest, it| greatest.max(it.abs()));
            for (a, b) in ours.torques().iter().zip(theirs.torques()) {
                assert!(
                    (a - b).abs() <= 100.0 * ROUNDING * torque,
                    "{name}, case {case}: torques {a} and {b}"
                );
            }
            counts.cases += 1;
            counts.touching += usize::from(theirs.contacts().count() > 0);
            counts.limited += usize::from(theirs.limit_violation() > 0.0);
            let at_limit = |(torque, limit): (&f64, &Option<f64>)| limit.is_some_and(|it| torque.abs() >= it);
            counts.saturated += usize::from(theirs.torques().iter().zip(&gains.max_torque).any(at_limit));
        }
    }
    // The cases are what they are meant to be.
    let Counts { cases, touching, limited, saturated, many, .. } = counts;
    assert!(cases >= 100, "{counts:?}");
    assert!(touching * 3 >= cases && limited * 4 >= cases, "{counts:?}");
    assert!(saturated * 3 >= cases && many * 20 >= cases, "{counts:?}");
}

#[test]
fn one_step_is_the_same_in_both_coordinates() {
    let mut characters = examples();
    characters.push(cart());
    compare(&characters, 48);
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn one_step_of_robots_is_the_same_in_both_coordinates() {
    let robots = common::robots();
    let names = ["a1", "anymal_b", "bolt", "double_pendulum", "quadruped"];
    let mut characters = examples();
    characters.extend(names.map(|name| common::character(&robots.join(format!("{name}.urdf")))));
    compare(&characters, 24);
}
