//! Rigid-body dynamics against the numbers of another engine (Pinocchio), on real robots.

mod common;

use std::sync::Arc;

use gaitwright::model::Model;
use gaitwright::sim::{Command, Simulator, State};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;

const ROBOTS: [&str; 5] = ["a1", "anymal_b", "bolt", "double_pendulum", "quadruped"];

fn model_and_reference(robot: &str) -> Option<(Arc<Model>, Value)> {
    let urdf = common::robots()?.join(format!("{robot}.urdf"));
    let numbers = std::fs::read(common::reference()?.join(format!("{robot}.json"))).ok()?;
    let numbers: Value = serde_json::from_slice(&numbers).unwrap();
    let fixed_base = numbers["random_states"][0].get("root").is_none();
    Some((Arc::new(Model::new(common::character(&urdf), fixed_base)), numbers))
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

#[test]
fn accelerations_agree_with_another_engine() {
    for robot in ROBOTS {
        let Some((model, numbers)) = model_and_reference(robot) else { return };
        let step = 1e-3;
        for (case, numbers) in numbers["random_states"].as_array().unwrap().iter().enumerate() {
            let start = state(&model, numbers, by_name);
            let torque: Vec<f64> =
                model.joint_names.iter().map(|name| number(&numbers["joints"][name]["torque"])).collect();
            let mut simulator =
                Simulator::new(model.clone(), common::free_flight(&model, step), start.clone());
            simulator.step(Command::Torque(&torque)).unwrap();
            let end = simulator.state();
            let mut pairs = Vec::new();
            for (index, name) in model.joint_names.iter().enumerate() {
                let acceleration = (end.velocities[index] - start.velocities[index]) / step;
                pairs.push((acceleration, number(&numbers["joints"][name]["acceleration"])));
            }
            if let Some(root) = numbers.get("root") {
                let linear = (end.root.linear_velocity - start.root.linear_velocity) / step;
                let angular = (end.root.angular_velocity - start.root.angular_velocity) / step;
                pairs
                    .extend(linear.iter().copied().zip(vector(&root["linear_acceleration"]).iter().copied()));
                pairs.extend(
                    angular.iter().copied().zip(vector(&root["angular_acceleration"]).iter().copied()),
                );
            }
            let scale = pairs.iter().map(|(_, wanted)| wanted.abs()).fold(0.0, f64::max);
            for (found, wanted) in pairs {
                let error = (found - wanted).abs() / scale;
                assert!(error < TOLERANCE, "{robot} state {case}: {found} instead of {wanted}");
            }
        }
    }
}

#[test]
fn mass_energy_and_center_of_mass_agree_with_another_engine() {
    for robot in ROBOTS {
        let Some((model, numbers)) = model_and_reference(robot) else { return };
        for numbers in numbers["random_states"].as_array().unwrap() {
            let start = state(&model, numbers, by_name);
            let simulator = Simulator::new(model.clone(), common::free_flight(&model, 1e-3), start);
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

/// Distance of a state from the end that another engine found, over joint angles (rad) and the root's
/// position (m).
fn distance(model: &Arc<Model>, numbers: &Value, step: f64) -> f64 {
    let passive = &numbers["passive_half_second"];
    let start = state(model, &passive["start"], by_place);
    let wanted = state(model, &passive["end"], by_place);
    let mut simulator = Simulator::new(model.clone(), common::free_flight(model, step), start);
    for _ in 0..(0.5 / step).round() as usize {
        simulator.step(Command::Passive).unwrap();
    }
    let end = simulator.state();
    let joints = end.angles.iter().zip(&wanted.angles).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    joints.max((end.root.position - wanted.root.position).norm())
}

#[test]
fn passive_motion_converges_to_the_reference_at_first_order() {
    for robot in ROBOTS {
        let Some((model, numbers)) = model_and_reference(robot) else { return };
        // Fine enough that the error is dominated by its leading term.
        let errors = [4e-5, 2e-5, 1e-5].map(|step| distance(&model, &numbers, step));
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((1.8..2.2).contains(&ratio), "{robot}: errors {errors:?}");
        }
        // Extrapolated to a step of zero, what is left is the reference's own error and the next term.
        let limit = (2.0 * errors[2] - errors[1]).abs();
        assert!(limit < 0.05 * errors[2], "{robot}: errors {errors:?}");
    }
}
