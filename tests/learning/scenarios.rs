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
