//! Maximal coordinates, the paper's own system, beside reduced ones.

mod common;

use std::path::PathBuf;
use std::sync::Arc;

use gaitwright::character::{self, Character, Options, Source};
use gaitwright::model::Model;
use gaitwright::scene::{
    Accuracy, Coordinates, Effect, Feedforward, Gains, JointBias, Scene, SolverChoice, SolverKind, Switch,
    Terrain,
};
use gaitwright::sim::{Command, Simulator, State};
use gaitwright::stance::{Stance, resting_height};
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// One step in both coordinates may differ by this share of the greatest velocity in it.
const ROUNDING: f64 = 1e-9;

fn maximal(joint_bias: JointBias) -> Accuracy {
    let solver = SolverChoice { kind: SolverKind::Newton, iterations: 2_000, tolerance: 1e-13 };
    Accuracy { coordinates: Coordinates::Maximal, joint_bias, solver, ..Accuracy::default() }
}

/// The same settings in joint coordinates.
fn reduced(accuracy: Accuracy) -> Accuracy {
    Accuracy { coordinates: Coordinates::Reduced, ..accuracy }
}

/// The real robots, where they are at hand, and the examples.
fn characters() -> Vec<Arc<Character>> {
    let examples = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut paths: Vec<PathBuf> =
        ["quadruped.urdf", "biped.urdf", "hexapod.json", "snake.json"].map(|name| examples.join(name)).into();
    if let Some(robots) = common::robots() {
        paths.extend(
            ["a1", "anymal_b", "bolt", "double_pendulum", "quadruped"]
                .map(|name| robots.join(format!("{name}.urdf"))),
        );
    }
    paths.iter().map(|path| common::character(path)).collect()
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
    Gains { stiffness, damping, max_torque, feedforward }
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

#[test]
fn one_step_is_the_same_in_both_coordinates() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let feedforwards = [Feedforward::None, Feedforward::ContactFree, Feedforward::ContactAware];
    let (mut saturated, mut touching, mut limited, mut many, mut cases) = (0, 0, 0, 0, 0);
    for character in characters() {
        for case in 0..24 {
            let character = if case % 2 == 0 { character.clone() } else { lossy(&character, &mut rng) };
            let fixed_base = case % 4 == 3;
            let model = Arc::new(Model::new(character, fixed_base));
            // Drawn poses overlap, and no motion takes such links apart at once.
            let friction = if case < 12 { 0.8 } else { 0.0 };
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
                    let mut simulator = Simulator::new(model.clone(), plan, state.clone());
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
                many += 1;
            }
            let [ours, theirs] = both;
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
            cases += 1;
            touching += usize::from(theirs.contacts().count() > 0);
            limited += usize::from(theirs.limit_violation() > 0.0);
            let at_limit = |(torque, limit): (&f64, &Option<f64>)| limit.is_some_and(|it| torque.abs() >= it);
            saturated += usize::from(theirs.torques().iter().zip(&gains.max_torque).any(at_limit));
        }
    }
    // The cases are what they are meant to be.
    assert!(touching * 3 >= cases && limited * 4 >= cases && saturated * 3 >= cases && many * 20 >= cases);
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
        let mut simulator = Simulator::new(model.clone(), plan, state.clone());
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

/// A hanging chain of links of 0.1 m, hinged about y and x in turn; `mass` gives each its mass, kg.
fn chain(links: usize, mass: impl Fn(usize) -> f64) -> Arc<Model> {
    let link = |index: usize| {
        let mass = mass(index);
        let inertia = mass * 0.1 * 0.1 / 12.0;
        format!(
            r#"{{"name": "link_{index}", "mass": {mass:e}, "center_of_mass": [0, 0, -0.05],
                "inertia": {{"xx": {inertia:e}, "yy": {inertia:e}, "zz": {:e}}}}}"#,
            0.1 * inertia
        )
    };
    let joint = |index: usize| {
        let axis = if index.is_multiple_of(2) { "[0, 1, 0]" } else { "[1, 0, 0]" };
        let height = if index == 1 { 0.0 } else { -0.1 };
        format!(
            r#"{{"name": "joint_{index}", "kind": "continuous", "parent": "link_{}", "child": "link_{index}",
                "origin": {{"position": [0, 0, {height}]}}, "axis": {axis}}}"#,
            index - 1
        )
    };
    let all =
        |each: &dyn Fn(usize) -> String, from: usize| (from..=links).map(each).collect::<Vec<_>>().join(",");
    let document = format!(
        r#"{{"format": "gaitwright/character@1", "name": "chain", "links": [{}], "joints": [{}]}}"#,
        all(&link, 0),
        all(&joint, 1)
    );
    let reading = character::read(document.as_bytes(), Source::Json, Options::default()).unwrap();
    Arc::new(Model::new(Arc::new(reading.character), true))
}

#[test]
fn a_chain_of_any_mass_ratio_holds_together_behind_every_solver() {
    let links = 10;
    for (name, heavy_end) in [("light to heavy", true), ("heavy to light", false)] {
        let model = chain(links, |index| {
            let share = index as f64 / links as f64;
            1e6_f64.powf(if heavy_end { share } else { 1.0 - share })
        });
        let greatest_torque = 1e-3 * model.mass * 9.81 * 0.1;
        // Torque limits leave boxed rows to the solver behind the equalities.
        let gains = Gains {
            stiffness: vec![greatest_torque; links],
            damping: vec![0.0; links],
            max_torque: vec![Some(greatest_torque); links],
            feedforward: Feedforward::None,
        };
        let targets = vec![0.0; links];
        for kind in [SolverKind::Pgs, SolverKind::Newton] {
            // The heavy end swings the light links at √(10⁶ g / 0.1 m) = 10⁴ rad/s: steps short of that period.
            let accuracy = Accuracy {
                step: 5e-5,
                solver: SolverChoice { kind, ..SolverChoice::default() },
                ..maximal(JointBias::Consistent)
            };
            let mut state = State::new(&model);
            state.angles[0] = 0.5;
            let plan = common::plan(&model, &Scene::default(), &accuracy, Some(&gains));
            let mut simulator = Simulator::new(model.clone(), plan, state);
            let total = |simulator: &Simulator| {
                let energy = simulator.energy();
                energy.kinetic + energy.potential
            };
            let start = total(&simulator);
            for _ in 0..6000 {
                simulator.step(Command::Track { now: &targets, next: &targets }).unwrap();
                // Links below 10³ rad/s leave their circle of 0.1 m by (10³ h)² / 2 of its radius in a step, of
                // which a fifth is taken back in each; the axis likewise.
                let apart = simulator.joint_separation();
                assert!(
                    apart <= 5.0 * 0.5 * (1e3_f64 * 5e-5).powi(2),
                    "{name}, {kind:?}: apart by {apart:e}"
                );
            }
            // The drives add at most their springs' energy; h ω of the fastest link is the method's own share.
            let gained = total(&simulator) - start;
            let swing = model.mass * 9.81 * 0.1;
            assert!(gained <= 0.01 * swing, "{name}, {kind:?}: gained {gained:e} of {swing:e}");
        }
    }
}

#[test]
fn joints_drift_apart_unless_stabilised() {
    let model = chain(3, |_| 1.0);
    let run = |accuracy: Accuracy, stabilization: Switch| {
        let mut scene = Scene::default();
        scene.effects.insert(Effect::Stabilization, stabilization);
        let mut state = State::new(&model);
        state.angles[0] = 1.5;
        let plan = common::plan(&model, &scene, &accuracy, None);
        let mut simulator = Simulator::new(model.clone(), plan, state);
        let (mut apart, mut fastest) = (0.0_f64, 0.0_f64);
        for _ in 0..1000 {
            simulator.step(Command::Passive).unwrap();
            apart = apart.max(simulator.joint_separation());
            fastest = fastest.max(simulator.state().velocities.iter().map(|rate| rate.abs()).sum());
        }
        (apart, fastest)
    };
    let accuracy = maximal(JointBias::Consistent);
    let (held, fastest) = run(accuracy, Switch::Auto);
    let (drifting, _) = run(accuracy, Switch::Off);
    // In a step of h a link leaves its circle, and its axis its plane, by (ω h)² / 2 at most; a fifth of what
    // has gathered is taken back.
    let bound = 5.0 * 0.5 * (fastest * accuracy.step).powi(2);
    assert!(held <= bound, "apart by {held:e} at {fastest} rad/s");
    assert!(drifting >= 5.0 * held, "{drifting:e} against {held:e}");
    assert_eq!(run(reduced(accuracy), Switch::Auto).0, 0.0);
}

#[test]
fn a_kept_state_goes_on_bit_for_bit() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let plan = common::plan(&model, &Scene::default(), &maximal(JointBias::Consistent), Some(&stance.gains));
    let mut simulator = Simulator::new(model.clone(), plan.clone(), stance.state.clone());
    let targets = Command::Track { now: &stance.angles, next: &stance.angles };
    let run = |simulator: &mut Simulator| {
        for _ in 0..50 {
            simulator.step(targets).unwrap();
        }
        simulator.state().clone()
    };
    let kept = run(&mut simulator);
    let end = run(&mut simulator);
    assert_eq!(run(&mut Simulator::new(model.clone(), plan, kept.clone())), end);
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
        let mut simulator = Simulator::new(model.clone(), plan_of(maximal(joint_bias)), state);
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
    let model = Model::new(Arc::new(character), false);
    let compile = |accuracy| gaitwright::scene::StepPlan::compile(&Scene::default(), &accuracy, None, &model);
    let error = compile(maximal(JointBias::Consistent)).unwrap_err().to_string();
    assert!(error.contains("/accuracy/coordinates"), "{error}");
    assert!(error.contains(&model.character.links[place].name), "{error}");
    assert!(compile(reduced(maximal(JointBias::Consistent))).is_ok());
}
