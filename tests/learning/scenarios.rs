//! Scenario documents set up and run.

use gaitwright_learning::accuracy::prepare;
use gaitwright_learning::scenario::{Line, NoFiles, Scenario};
use gaitwright_physics::scene::Accuracy;
use gaitwright_physics::sim::Simulator;
use serde_json::{Value, json};

use crate::common;

/// What a start leaves out follows the loop; what it gives in full is taken as it is, and pulled together.
#[test]
fn a_start_closes_the_loops_that_it_leaves_free() {
    let start = |joints: Value| {
        let document = json!({"character": {"json": serde_json::from_str::<Value>(
            &std::fs::read_to_string(common::example_path("fourbar.json")).unwrap()).unwrap()},
            "scene": {"ground": null, "gravity": [0, 0, 0]}, "start": {"joints": joints}, "duration": 0.01});
        Scenario::parse(document.to_string().as_bytes()).unwrap().set_up(&NoFiles)
    };
    let model = common::example("fourbar.json");
    let given = model.joint("left_shoulder").unwrap();
    let setup = start(json!({"left_shoulder": {"angle": 0.3}})).unwrap();
    assert_eq!(setup.start.angles[given], 0.3);
    let plan = common::plan(&setup.model, &setup.scene, &Accuracy::default(), None);
    assert!(Simulator::new(plan, setup.start).joint_separation() < 1e-9);
    let angles = |joint: &String| json!({"angle": if joint == "left_shoulder" { 0.3 } else { 0.0 }});
    let all = model.joint_names.iter().map(|joint| (joint.clone(), angles(joint))).collect();
    let setup = start(Value::Object(all)).unwrap();
    assert_eq!(setup.start.angles.iter().filter(|angle| **angle == 0.0).count(), model.joint_count() - 1);
}

#[test]
fn results_name_the_obstacle() {
    let character = r#"{"format": "gaitwright/character@1", "name": "cube", "links": [
        {"name": "cube", "density": 250, "shapes": [{"kind": "box", "size": [0.2, 0.2, 0.2]}]}]}"#;
    for (name, expected) in [(r#""name": "table","#, "table"), ("", "obstacle 1")] {
        let document = format!(
            r#"{{"format": "gaitwright/scenario@1", "character": {{"json": {character}}}, "duration": 0.1,
                "scene": {{"ground": null, "obstacles": [
                    {{"shape": {{"kind": "sphere", "radius": 1, "pose": {{"position": [9, 0, 0]}}}}}},
                    {{{name} "shape": {{"kind": "box", "size": [1, 1, 0.5]}}}}]}},
                "start": {{"root": {{"position": [0, 0, 0.35]}}}}}}"#
        );
        let scenario = Scenario::parse(document.as_bytes()).unwrap_or_else(|error| panic!("{error}"));
        let mut names = Vec::new();
        prepare(&scenario, &NoFiles).unwrap_or_else(|error| panic!("{error}")).run(|line| {
            if let Line::Sample(sample) = line {
                names.extend(sample.contacts.iter().map(|contact| contact.other.clone()));
            }
            true
        });
        assert!(!names.is_empty() && names.iter().all(|name| name == expected), "{names:?}");
    }
}

/// A budget of one sweep leaves steps unsolved, and the summary says so; the default solver leaves none.
#[test]
fn the_summary_says_what_was_left_unsolved() {
    let run = |solver: Value| {
        let document = json!({"character": example("quadruped.urdf"), "duration": 0.5,
            "start": {"root": {"position": [0, 0, 0.6], "angular_velocity": [3, 2, 1]}},
            "drive": {"kind": "hold"}, "accuracy": {"solver": solver}});
        let scenario = Scenario::parse(document.to_string().as_bytes()).unwrap();
        let mut last = None;
        prepare(&scenario, &NoFiles).unwrap().run(|line| {
            last = Some(line);
            true
        });
        serde_json::to_value(last).unwrap()["summary"].clone()
    };
    let (given_up, solved) = (run(json!({"kind": "pgs", "iterations": 1})), run(json!({})));
    let number = |summary: &Value, field: &str| summary[field].as_f64().unwrap();
    assert_eq!(solved["status"], "finished");
    assert_eq!(solved["unsolved_steps"], 0);
    assert!(number(&solved, "greatest_residual") < 1e-6 && number(&solved, "greatest_penetration") > 0.0);
    for field in ["divided_steps", "coarse_steps", "greatest_substeps"] {
        assert!(solved[field].is_u64(), "{field}");
    }
    let unsolved = given_up["unsolved_steps"].as_u64().unwrap();
    assert!(unsolved > 10, "{unsolved} of {} steps", given_up["steps"]);
    assert!(number(&given_up, "greatest_residual") > 1e-3);
    let expected = format!("finished, but {unsolved} of 250 steps are unsolved");
    assert_eq!(given_up["status"], expected.as_str());
}

/// A shipped URDF, inline.
fn example(name: &str) -> Value {
    json!({"urdf": std::fs::read_to_string(common::example_path(name)).unwrap()})
}

/// Step of the flywheel's scenarios, s.
const STEP: f64 = 0.001;

/// The flywheel's motor: greatest torque, N m, and the speed at which it has none left, rad/s.
const TORQUE: f64 = 20.0;
const SPEED: f64 = 10.0;

/// Time, angle, velocity and torque of a bolted flywheel of 1 kg m² under `drive`, over a second.
fn flywheel(drive: &Value) -> Vec<[f64; 4]> {
    let inertia = |z: f64| format!(r#"<inertia ixx="0.6" ixy="0" ixz="0" iyy="0.6" iyz="0" izz="{z}"/>"#);
    let urdf = format!(
        r#"<robot name="flywheel"><link name="base"><inertial><mass value="1"/>{}</inertial></link>
        <link name="wheel"><inertial><mass value="1"/>{}</inertial></link>
        <joint name="hinge" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 0 1"/>
          <limit effort="{TORQUE}" velocity="{SPEED}"/></joint></robot>"#,
        inertia(0.6),
        inertia(1.0)
    );
    let document = json!({"character": {"urdf": urdf}, "fixed_base": true, "scene": {"ground": null},
        "accuracy": {"step": STEP}, "start": {"joints": {"hinge": {"angle": 0.0, "velocity": 0.0}}}, "drive": drive,
        "duration": 1.0, "sample_every": 0.01});
    let scenario = Scenario::parse(document.to_string().as_bytes()).unwrap_or_else(|error| panic!("{error}"));
    let mut samples = Vec::new();
    prepare(&scenario, &NoFiles).unwrap_or_else(|error| panic!("{error}")).run(|line| {
        if let Line::Sample(sample) = line {
            let joint = sample.joints["hinge"];
            samples.push([sample.time, joint.angle, joint.velocity, joint.torque]);
        }
        true
    });
    assert!(samples.len() > 100, "{} samples", samples.len());
    samples
}

/// A constant torque below what the motor has left: q̇ = τ t / I, and q = τ t² / 2 I with half a step's lead, because positions
/// move along the new velocities.
#[test]
fn a_torque_drive_accelerates_a_flywheel_evenly() {
    for [time, angle, velocity, torque] in flywheel(&json!({"kind": "torque", "joints": {"hinge": 5.0}})) {
        assert!((velocity - 5.0 * time).abs() < 1e-9, "{velocity} rad/s at {time} s");
        assert!((angle - 2.5 * time * (time + STEP)).abs() < 1e-9, "{angle} rad at {time} s");
        assert!(time == 0.0 || (torque - 5.0).abs() < 1e-9, "{torque} N m at {time} s");
    }
}

/// A torque beyond the motor's, and a velocity that takes all of it to be reached: q̇ = v (1 − e^(−t τ / I v)) along the motor's line,
/// in steps of which each divides the rest v − q̇ by 1 + h τ / I v; and the wanted velocity from where it is reached.
#[test]
fn torque_and_velocity_drives_follow_the_motors_line() {
    let decay = TORQUE / SPEED;
    let wanted = 3.0;
    let drives = [
        (json!({"kind": "torque", "joints": {"hinge": 100.0}}), f64::INFINITY),
        (json!({"kind": "velocity", "joints": {"hinge": wanted}}), wanted),
    ];
    for (drive, most) in drives {
        for [time, _, velocity, torque] in flywheel(&drive) {
            let steps = (time / STEP).round();
            let along_line = SPEED * (1.0 - (1.0 + STEP * decay).powf(-steps));
            let expected = along_line.min(most);
            assert!((velocity - expected).abs() < 1e-9, "{drive}: {velocity} rad/s at {time} s");
            // The scheme's limit, at first order: the greatest error is (h / 2) τ / I times e^-1.
            let exact = (SPEED * (1.0 - (-decay * time).exp())).min(most);
            assert!((velocity - exact).abs() < 0.5 * STEP * TORQUE, "{drive}: {velocity}, not {exact}");
            let given = if velocity < most - 1e-9 { TORQUE * (1.0 - velocity / SPEED) } else { 0.0 };
            let changes = (time - (1.0 - wanted / SPEED).ln() / -decay).abs() < 2.0 * STEP && most == wanted;
            assert!(
                time == 0.0 || changes || (torque - given).abs() < 1e-7,
                "{drive}: {torque}, not {given}"
            );
        }
    }
}

/// An offset f₀ moves the rest of a spring by f₀ / K. Damped critically it is approached as (1 + ω t) e^(−ω t), which
/// steps of h follow within h ω of the way.
#[test]
fn an_offset_torque_moves_the_rest_of_a_held_joint() {
    let (stiffness, target, offset) = (100.0_f64, 0.1, 5.0);
    let omega = stiffness.sqrt();
    let drive = json!({"kind": "hold", "stiffness": stiffness, "damping": 2.0 * omega, "joints": {"hinge": target},
        "offset": {"hinge": offset}});
    let rest = target + offset / stiffness;
    let samples = flywheel(&drive);
    for [time, angle, ..] in &samples {
        let expected = rest * (1.0 - (1.0 + omega * time) * (-omega * time).exp());
        assert!((angle - expected).abs() < STEP * omega * rest, "{angle} rad, not {expected}, at {time} s");
    }
    let [_, angle, _, torque] = samples[samples.len() - 1];
    // What is left of the way after ten times 1 / ω.
    let left = 2.0 * 11.0 * (-10.0_f64).exp();
    assert!((angle - rest).abs() < left * rest, "{angle} rad, not {rest}");
    assert!(torque.abs() < left * offset * 4.0, "{torque} N m hold up nothing");
}
