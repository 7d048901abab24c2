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
