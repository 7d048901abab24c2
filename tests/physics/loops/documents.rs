//! Loops as characters are described with them: four-bar legs that stand, and every fault.

use std::sync::Arc;

use gaitwright_physics::character::{self, Character, Options, Source};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::sim::{Command, Simulator};
use gaitwright_physics::stance::Stance;
use serde_json::{Value, json};

use super::common;

/// A trunk on four legs, each a parallelogram with a ball for a foot.
fn four_bar_legs() -> Value {
    let shape = |kind: Value| json!([kind]);
    let mut links = vec![json!({
        "name": "trunk", "density": 400,
        "shapes": shape(json!({"kind": "box", "size": [0.5, 0.3, 0.08]})),
    })];
    let (mut joints, mut loops) = (Vec::new(), Vec::new());
    let rod = |name: String| {
        json!({"name": name, "density": 800, "shapes": [
            {"kind": "capsule", "radius": 0.012, "length": 0.15, "pose": {"position": [0, 0, -0.1]}}]})
    };
    let actuation = json!({"max_torque": 20});
    let limits = json!({"lower": -1.2, "upper": 1.2});
    for (leg, (x, y)) in [(0.2, 0.15), (0.2, -0.15), (-0.2, 0.15), (-0.2, -0.15)].into_iter().enumerate() {
        let name = |part: &str| format!("{part}_{leg}");
        links.push(rod(name("front")));
        links.push(json!({"name": name("foot"), "density": 800, "shapes": [
            {"kind": "sphere", "radius": 0.025, "pose": {"position": [-0.04, 0, -0.05]}}]}));
        links.push(rod(name("back")));
        joints.push(json!({"name": name("front_hip"), "kind": "revolute", "parent": "trunk",
            "child": name("front"), "origin": {"position": [x + 0.04, y, 0]}, "axis": [0, 1, 0],
            "limits": limits, "actuation": actuation}));
        joints.push(json!({"name": name("front_ankle"), "kind": "revolute", "parent": name("front"),
            "child": name("foot"), "origin": {"position": [0, 0, -0.2]}, "axis": [0, 1, 0],
            "limits": limits, "actuation": actuation}));
        joints.push(json!({"name": name("back_hip"), "kind": "revolute", "parent": "trunk",
            "child": name("back"), "origin": {"position": [x - 0.04, y, 0]}, "axis": [0, 1, 0],
            "limits": limits, "actuation": actuation}));
        loops.push(json!({"name": name("back_ankle"), "kind": "revolute", "a": name("back"),
            "b": name("foot"), "origin": {"position": [0, 0, -0.2]}, "axis": [0, 1, 0]}));
    }
    json!({"format": "gaitwright/character@1", "name": "four-bar legs",
        "links": links, "joints": joints, "loops": loops})
}

/// That character.
pub fn legged() -> Arc<Model> {
    Arc::new(Model::new(Arc::new(read(&four_bar_legs()).unwrap()), Base::Floating))
}

fn read(document: &Value) -> Result<Character, String> {
    character::read(document.to_string().as_bytes(), Source::Json, Options::default())
        .map(|reading| reading.character)
        .map_err(|error| error.to_string())
}

#[test]
fn a_character_with_four_bar_legs_finds_a_closed_pose_and_stands() {
    let model = legged();
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable);
    let plan = common::plan(&model, &Scene::default(), &Accuracy::default(), Some(&stance.gains));
    let mut posed = stance.state.clone();
    posed.angles.copy_from_slice(&stance.angles);
    let targeted = Simulator::new(plan.clone(), posed);
    assert!(targeted.joint_separation() <= 1e-6, "{:e}", targeted.joint_separation());
    let mut simulator = Simulator::new(plan, stance.state.clone());
    for _ in 0..1000 {
        simulator.step(Command::Track { now: &stance.angles, next: &stance.angles }).unwrap();
        assert!(simulator.joint_separation() <= 1e-4);
    }
    let fallen = stance.state.root.position.z - simulator.state().root.position.z;
    assert!(fallen.abs() <= 0.01, "{fallen}");
    let weight: f64 = simulator.contacts().map(|contact| contact.force.z).sum();
    assert!((weight / (model.mass * 9.81) - 1.0).abs() <= 0.01, "{weight}");
}

/// Spoils a document.
type Change<'a> = &'a dyn Fn(&mut Value);

#[test]
fn every_fault_of_a_loop_is_named() {
    let path = common::example_path("fourbar.json");
    let good: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    assert!(read(&good).is_ok());
    let with = |change: &dyn Fn(&mut Value)| {
        let mut document = good.clone();
        change(&mut document["loops"][0]);
        read(&document).unwrap_err()
    };
    let cases: [(Change<'_>, &[&str]); 9] = [
        (&|it| it["a"] = json!("nobody"), &["/loops/0/a", "nobody"]),
        (&|it| it["b"] = json!("right_crank"), &["/loops/0/b", "right_crank", "rigidly"]),
        (&|it| it["axis"] = json!([0, 0, 0]), &["/loops/0/axis"]),
        (&|it| it["kind"] = json!("welded"), &["welded"]),
        (&|it| it["limits"] = json!([0, 1]), &["limits"]),
        (&|it| it["name"] = json!(""), &["/loops/0/name"]),
        (&|it| it["origin"]["position"] = json!([0, 0, 1e9]), &["/loops/0/origin"]),
        (
            &|it| it["origin_in_b"]["position"] = json!([0.3, 0, 0]),
            &["/loops/0/origin_in_b", "right_crank", "coupler", "1.000e-1 m"],
        ),
        (
            &|it| it["origin_in_b"]["rpy"] = json!([0.5, 0, 0]),
            &["/loops/0/origin_in_b", "right_crank", "coupler", "5.000e-1 rad"],
        ),
    ];
    for (change, words) in cases {
        let error = with(change);
        for word in words {
            assert!(error.contains(word), "{error:?} does not name {word:?}");
        }
    }
    let mut passive = good.clone();
    passive["joints"][1]["actuation"] = Value::Null;
    let driven: Vec<bool> =
        read(&passive).unwrap().links.iter().flat_map(|link| &link.joint).map(|it| it.driven).collect();
    assert_eq!(driven, [true, false, true]);
    let mut twice = good.clone();
    twice["loops"] = json!([good["loops"][0], good["loops"][0]]);
    assert!(read(&twice).unwrap_err().contains("/loops/1/name"));
    // A turn about its own axis is nothing to a revolute joint, and no turn at all is to a ball.
    let mut turned = good.clone();
    turned["loops"][0]["origin_in_b"]["rpy"] = json!([0, 0.5, 0]);
    assert!(read(&turned).is_ok());
    turned["loops"][0]["kind"] = json!("ball");
    turned["loops"][0]["origin_in_b"]["rpy"] = json!([0.5, 0.5, 0.5]);
    assert!(read(&turned).is_ok());
}

/// Multiplies all lengths of a document by `factor`.
fn scale(value: &mut Value, factor: f64) {
    let times = |number: &mut Value| *number = json!(number.as_f64().unwrap() * factor);
    match value {
        Value::Array(items) => items.iter_mut().for_each(|item| scale(item, factor)),
        Value::Object(members) => {
            for (name, member) in members {
                match (name.as_str(), &mut *member) {
                    ("position" | "size", Value::Array(numbers)) => numbers.iter_mut().for_each(times),
                    ("radius" | "length", Value::Number(_)) => times(member),
                    _ => scale(member, factor),
                }
            }
        }
        _ => {}
    }
}

/// How far the two ends may be apart goes with the character's size.
#[test]
fn ends_of_a_loop_are_compared_by_the_size_of_the_character() {
    let path = common::example_path("pantograph.json");
    let good: Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    for factor in [0.01, 1.0, 100.0] {
        let mut document = good.clone();
        scale(&mut document, factor);
        read(&document).unwrap();
        // Of a hip 0.25 m from the root's origin.
        for (share, holds) in [(1e-4, true), (1e-3, false)] {
            let mut off = document.clone();
            let ahead = &mut off["loops"][0]["origin_in_b"]["position"][0];
            *ahead = json!(ahead.as_f64().unwrap() + 0.25 * factor * share);
            let outcome = read(&off);
            assert_eq!(outcome.is_ok(), holds, "{factor}: {share}");
            if let Err(error) = outcome {
                assert!(error.contains("/loops/0/origin_in_b"), "{error}");
            }
        }
    }
}
