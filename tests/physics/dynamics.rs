//! Rigid-body dynamics against the numbers of another engine (Pinocchio), for the bundled characters and for robots from
//! elsewhere; and the sines of its angles against the standard library's.

use crate::common;

use std::path::Path;
use std::sync::Arc;

use gaitwright_physics::model::wide::LANES;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Effect, Integrator, Scene};
use gaitwright_physics::sim::coordinates::reduced::trigonometry::sines_and_cosines;
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;

/// The files of `tests/reference`, which name the characters that they are about.
const CHARACTERS: [&str; 5] = ["quadruped", "biped", "hexapod", "snake", "snake-fixed"];

/// Robots from elsewhere, by the name of their URDF and of their reference numbers.
const ROBOTS: [&str; 5] = ["a1", "anymal_b", "bolt", "double_pendulum", "quadruped"];

/// A character with what another engine computed for it.
struct Subject {
    name: String,
    model: Arc<Model>,
    numbers: Value,
}

impl Subject {
    fn new(name: &str, character: &Path, numbers: Value) -> Self {
        let fixed_base = numbers["random_states"][0].get("root").is_none();
        let model = Arc::new(Model::new(common::character(character), Base::fixed_if(fixed_base)));
        Self { name: name.to_owned(), model, numbers }
    }

    fn random_states(&self) -> &[Value] {
        let states = self.numbers["random_states"].as_array().unwrap();
        assert!(states.len() >= 4, "{}", self.name);
        states
    }
}

fn bundled() -> Vec<Subject> {
    let subject = |name: &str| {
        let numbers = common::json(&common::reference_path(&format!("{name}.json")));
        let character = common::repository().join(numbers["character"].as_str().unwrap());
        Subject::new(name, &character, numbers)
    };
    CHARACTERS.map(subject).into()
}

fn from_elsewhere() -> Vec<Subject> {
    let (robots, reference) = (common::robots(), common::robot_reference());
    let subject = |name: &str| {
        let numbers = common::json(&reference.join(format!("{name}.json")));
        Subject::new(name, &robots.join(format!("{name}.urdf")), numbers)
    };
    ROBOTS.map(subject).into()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

/// Reads a state; `joint` gives angle and velocity of a joint's entry.
fn state(model: &Model, numbers: &Value, joint: impl Fn(&Value) -> (f64, f64)) -> State {
    let mut state = State::new(model);
    if let Some(root) = numbers.get("root") {
        let [w, x, y, z] = [0, 1, 2, 3].map(|index| number(&root["orientation_wxyz"][index]));
        state.root.position = Point3::from(vector(&root["position"]));
        state.root.orientation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        state.root.linear_velocity = vector(&root["linear_velocity"]);
        state.root.angular_velocity = vector(&root["angular_velocity"]);
    }
    for (index, name) in model.joint_names.iter().enumerate() {
        (state.angles[index], state.velocities[index]) = joint(&numbers["joints"][name]);
    }
    state
}

fn by_name(entry: &Value) -> (f64, f64) {
    (number(&entry["angle"]), number(&entry["velocity"]))
}

fn by_place(entry: &Value) -> (f64, f64) {
    (number(&entry[0]), number(&entry[1]))
}

/// Relative to the greatest acceleration of the state: an acceleration near zero is a difference of
/// large ones.
const TOLERANCE: f64 = 1e-9;

fn accelerations_agree(subjects: &[Subject]) {
    for subject in subjects {
        let Subject { name: robot, model, .. } = subject;
        for (case, numbers) in subject.random_states().iter().enumerate() {
            let start = state(model, numbers, by_name);
            let torque: Vec<f64> =
                model.joint_names.iter().map(|name| number(&numbers["joints"][name]["torque"])).collect();
            // Forces of velocity are those of the mean velocity of the step: in the limit of no step, which
            // two short steps point to with an error of (h ω)², those of the state.
            let [whole, half] = [1e-6, 0.5e-6].map(|step| {
                let plan = common::free_flight(model, step);
                let mut simulator = Simulator::new(plan, start.clone());
                simulator.step(Command::Torque(&torque)).unwrap();
                let end = simulator.state();
                let linear = end.root.linear_velocity - start.root.linear_velocity;
                let angular = end.root.angular_velocity - start.root.angular_velocity;
                let joints = end.velocities.iter().zip(&start.velocities).map(|(end, start)| end - start);
                let gains = joints.chain(linear.iter().copied()).chain(angular.iter().copied());
                gains.map(|gain| gain / step).collect::<Vec<f64>>()
            });
            let found = whole.iter().zip(&half).map(|(whole, half)| 2.0 * half - whole);
            let mut wanted: Vec<f64> = model
                .joint_names
                .iter()
                .map(|name| number(&numbers["joints"][name]["acceleration"]))
                .collect();
            if let Some(root) = numbers.get("root") {
                wanted.extend(vector(&root["linear_acceleration"]).iter());
                wanted.extend(vector(&root["angular_acceleration"]).iter());
            }
            assert_eq!(found.len(), model.joint_count() + 6, "{robot}: joints and root");
            if model.fixed_base {
                wanted.extend([0.0; 6]);
            }
            let pairs: Vec<(f64, f64)> = found.zip(wanted).collect();
            let scale = pairs.iter().map(|(_, wanted)| wanted.abs()).fold(0.0, f64::max);
            for (found, wanted) in pairs {
                let error = (found - wanted).abs() / scale;
                assert!(error < TOLERANCE, "{robot} state {case}: {found} instead of {wanted}");
            }
        }
    }
}

#[test]
fn accelerations_agree_with_another_engine() {
    accelerations_agree(&bundled());
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn accelerations_of_robots_agree_with_another_engine() {
    accelerations_agree(&from_elsewhere());
}

fn mass_energy_and_center_of_mass_agree(subjects: &[Subject]) {
    for subject in subjects {
        let Subject { name: robot, model, .. } = subject;
        for numbers in subject.random_states() {
            let start = state(model, numbers, by_name);
            let simulator = Simulator::new(common::free_flight(model, 1e-3), start);
            let close = |found: f64, wanted: f64| {
                assert!(
                    (found - wanted).abs() < TOLERANCE * wanted.abs().max(1.0),
                    "{robot}: {found}, not {wanted}"
                );
            };
            close(simulator.energy().kinetic, number(&numbers["kinetic_energy"]));
            if model.fixed_base {
                // The other engine makes a bolted link part of the world.
                close(model.mass - model.bodies[0].mass, number(&numbers["mass"]));
                continue;
            }
            close(model.mass, number(&numbers["mass"]));
            close(simulator.energy().potential, number(&numbers["potential_energy"]));
            let center = vector(&numbers["center_of_mass"]);
            assert!((simulator.center_of_mass().coords - center).norm() < TOLERANCE, "{robot}");
        }
    }
}

#[test]
fn mass_energy_and_center_of_mass_agree_with_another_engine() {
    mass_energy_and_center_of_mass_agree(&bundled());
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn mass_energy_and_center_of_mass_of_robots_agree_with_another_engine() {
    mass_energy_and_center_of_mass_agree(&from_elsewhere());
}

/// The diagonal of the joint-space inertia matrix: twice the kinetic energy where one joint alone turns at 1 rad/s.
fn inertia_about_each_joint_agrees(subjects: &[Subject]) {
    for subject in subjects {
        let Subject { name: robot, model, .. } = subject;
        for numbers in subject.random_states() {
            let mut start = state(model, numbers, by_name);
            (start.root.linear_velocity, start.root.angular_velocity) = (Vector3::zeros(), Vector3::zeros());
            for (joint, name) in model.joint_names.iter().enumerate() {
                start.velocities.fill(0.0);
                start.velocities[joint] = 1.0;
                let plan = common::free_flight(model, 1e-3);
                let found = 2.0 * Simulator::new(plan, start.clone()).energy().kinetic;
                let wanted = number(&numbers["joint_inertia_diagonal"][name]);
                let error = (found - wanted).abs() / wanted;
                assert!(error < TOLERANCE, "{robot}, {name}: {found}, not {wanted}");
            }
        }
    }
}

#[test]
fn inertia_about_each_joint_agrees_with_another_engine() {
    inertia_about_each_joint_agrees(&bundled());
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn inertia_about_each_joint_of_robots_agrees_with_another_engine() {
    inertia_about_each_joint_agrees(&from_elsewhere());
}

/// Distance of a state from the end that another engine found, over joint angles (rad) and the root's
/// position (m).
fn distance(model: &Arc<Model>, numbers: &Value, integrator: Integrator, step: f64) -> f64 {
    let passive = &numbers["passive_half_second"];
    let start = state(model, &passive["start"], by_place);
    let wanted = state(model, &passive["end"], by_place);
    let accuracy = Accuracy { step, integrator, ..Accuracy::default() };
    let scene = Scene {
        ground: None,
        ..common::without(&[
            Effect::SelfCollision,
            Effect::JointLimits,
            Effect::JointDamping,
            Effect::JointFriction,
        ])
    };
    let plan = common::plan(model, &scene, &accuracy, None);
    let mut simulator = Simulator::new(plan, start);
    for _ in 0..(0.5 / step).round() as usize {
        simulator.step(Command::Passive).unwrap();
    }
    let end = simulator.state();
    let joints = end.angles.iter().zip(&wanted.angles).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    joints.max((end.root.position - wanted.root.position).norm())
}

/// How far the reference's own end is from the limit, rad or m: fourth order at 2e-5 s, but the double pendulum
/// turns at 30 rad/s and multiplies small errors.
const REFERENCE: f64 = 3e-7;

fn passive_motion_converges(subjects: &[Subject]) {
    for Subject { name: robot, model, numbers } in subjects {
        for (integrator, least) in [(Integrator::SemiImplicitEuler, 1.8), (Integrator::MoreauJean, 3.3)] {
            let errors = [4e-4, 2e-4, 1e-4].map(|step| distance(model, numbers, integrator, step));
            for pair in errors.windows(2) {
                let ratio = pair[0] / (pair[1] - REFERENCE).max(1e-12);
                assert!(ratio > least, "{robot}, {integrator:?}: errors {errors:?}");
            }
        }
    }
}

#[test]
fn passive_motion_converges_to_the_reference() {
    passive_motion_converges(&bundled());
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn passive_motion_of_robots_converges_to_the_reference() {
    passive_motion_converges(&from_elsewhere());
}

/// Greatest distance from the standard library's results over many angles, with their neighbours about the
/// multiples of π/4.
fn greatest_error_of_sines(angles: impl Iterator<Item = f64>) -> f64 {
    let errors = angles.map(|angle| {
        let [[sine, ..], [cosine, ..]] = sines_and_cosines(&[angle, 0.0, 0.0, 0.0]);
        (sine - angle.sin()).abs().max((cosine - angle.cos()).abs())
    });
    errors.fold(0.0, f64::max)
}

#[test]
fn sines_agree_with_the_standard_library() {
    const BOUND: f64 = f64::EPSILON;
    let even = (-400_000..400_000).map(|index| f64::from(index) * 1.7e-5);
    assert!(greatest_error_of_sines(even) <= BOUND);
    let far = (0..400_000).map(|index| 1.000_1_f64.powi(index % 138_000) * 0.01);
    assert!(greatest_error_of_sines(far) <= BOUND);
    let corners = (-2000..2000).flat_map(|index| {
        let corner = f64::from(index) * std::f64::consts::FRAC_PI_4;
        [corner.next_down(), corner, corner.next_up()]
    });
    assert!(greatest_error_of_sines(corners) <= BOUND);
}

#[test]
fn sines_are_exact_at_zero_and_none_where_there_are_none() {
    assert_eq!(sines_and_cosines(&[0.0; LANES]), [[0.0; LANES], [1.0; LANES]]);
    let [sines, cosines] = sines_and_cosines(&[f64::NAN, f64::INFINITY, 1e9, 0.0]);
    assert!(sines[..2].iter().chain(&cosines[..2]).all(|number| number.is_nan()));
    let (sine, cosine) = 1e9_f64.sin_cos();
    assert_eq!([sines[2], cosines[2]], [sine, cosine]);
}
