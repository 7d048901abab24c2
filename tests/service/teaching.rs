//! How a character is taught, as `check` tells it.

use gaitwright::jobs::{Teaching, TeachingMethod, check};
use gaitwright_physics::character::{Options, Source, read};
use gaitwright_physics::scene::Scene;
use serde_json::{Value, json};

use crate::common;

const GAITS_OF_FOUR: [&str; 10] = [
    "walk",
    "trot",
    "running trot",
    "pace",
    "canter",
    "bound",
    "gallop",
    "transverse gallop",
    "rotary gallop",
    "pronk",
];

fn example(name: &str) -> Vec<u8> {
    std::fs::read(common::example_path(name)).unwrap()
}

/// The hexapod's document.
fn hexapod() -> Value {
    serde_json::from_slice(&example("hexapod.json")).unwrap()
}

fn taught(document: &[u8], source: Source) -> Teaching {
    let reading = read(document, source, Options::default()).unwrap();
    check(&reading, &Scene::default()).teaching.unwrap()
}

fn taught_json(document: &Value) -> Teaching {
    taught(&serde_json::to_vec(document).unwrap(), Source::Json)
}

fn joint<'a>(document: &'a mut Value, name: &str) -> &'a mut Value {
    let joints = document["joints"].as_array_mut().unwrap();
    joints.iter_mut().find(|joint| joint["name"] == name).unwrap()
}

/// Without the links and joints whose names begin with `leg`.
fn without_leg(mut document: Value, leg: &str) -> Value {
    for list in ["links", "joints"] {
        let all = document[list].as_array_mut().unwrap();
        all.retain(|one| !one["name"].as_str().unwrap().starts_with(leg));
    }
    document
}

/// A hexapod whose legs are copies of its left and right middle legs, so many on each side.
fn many_legged(rows: usize) -> Value {
    let mut document = hexapod();
    let middle = |document: &Value, list: &str, side: &str| -> Vec<Value> {
        let all = document[list].as_array().unwrap().iter();
        all.filter(|one| one["name"].as_str().unwrap().starts_with(&format!("{side}M_"))).cloned().collect()
    };
    let parts: Vec<[Vec<Value>; 2]> =
        ["L", "R"].map(|side| ["links", "joints"].map(|list| middle(&document, list, side))).into();
    for leg in ["LF", "LM", "LH", "RF", "RM", "RH"] {
        document = without_leg(document, leg);
    }
    let half = 0.06 * rows as f64;
    document["links"][0]["shapes"][0]["size"][0] = json!(2.0 * half);
    for row in 0..rows {
        for [links, joints] in &parts {
            let renamed = |part: &Value| -> Value {
                let text = part.to_string().replace("LM_", &format!("L{row}_"));
                serde_json::from_str(&text.replace("RM_", &format!("R{row}_"))).unwrap()
            };
            document["links"].as_array_mut().unwrap().extend(links.iter().map(renamed));
            let mut joints: Vec<Value> = joints.iter().map(renamed).collect();
            joints[0]["origin"]["position"][0] = json!(half - 0.06 - 0.12 * row as f64);
            document["joints"].as_array_mut().unwrap().extend(joints);
        }
    }
    document
}

#[test]
fn legs_are_listed_by_side_and_row_with_the_gaits_that_they_have() {
    let Teaching { method, legs, gaits, hip_height, because } = taught_json(&hexapod());
    assert_eq!((method, because), (TeachingMethod::LegPrograms, None));
    assert_eq!(gaits, ["wave", "ripple", "tripod"]);
    let names: Vec<&str> = legs.iter().map(|leg| &*leg.name).collect();
    assert_eq!(names, ["LF", "LM", "LH", "RF", "RM", "RH"]);
    for leg in &legs {
        // The document's author has given the links the same names.
        assert_eq!(leg.foot, format!("{}_tibia", leg.name));
        assert_eq!(leg.joints, ["yaw", "lift", "knee"].map(|joint| format!("{}_{joint}", leg.name)));
    }
    assert!(hip_height.is_some_and(|height| height > 0.0));
}

#[test]
fn a_task_can_name_the_gaits_of_four_legs_and_of_a_body_without_any() {
    let four = taught(&example("quadruped.urdf"), Source::Urdf);
    assert_eq!(four.gaits, GAITS_OF_FOUR);
    assert!(four.legs.iter().all(|leg| !leg.sprawled));
    let snake = taught(&example("snake.json"), Source::Json);
    assert_eq!((snake.method, snake.legs.len()), (TeachingMethod::Waves, 0));
    assert_eq!(snake.gaits, ["undulation", "crawling"]);
}

#[test]
fn what_a_gait_lacks_is_told() {
    let because = |document: &Value| {
        let Teaching { method, legs, gaits, because, .. } = taught_json(document);
        assert_eq!((method, legs.len(), gaits.len()), (TeachingMethod::Qdsega, 0, 0));
        because.unwrap()
    };
    let five = because(&without_leg(hexapod(), "LM"));
    assert_eq!(five, "of its feet 2 are on the left of the way, 3 on the right, and 0 on the line between");
    let mut passive = hexapod();
    joint(&mut passive, "RM_yaw")["actuation"] = Value::Null;
    let passive = because(&passive);
    assert!(passive.contains("RM_tibia") && passive.contains("without a motor, `RM_yaw`"), "{passive}");
    let mut stiff = hexapod();
    let legs = ["LF", "LM", "LH", "RF", "RM", "RH"];
    for name in legs.iter().flat_map(|leg| ["yaw", "knee"].map(|joint| format!("{leg}_{joint}"))) {
        let fixed = joint(&mut stiff, &name);
        fixed["kind"] = json!("fixed");
        for field in ["axis", "limits", "actuation", "damping"] {
            fixed.as_object_mut().unwrap().remove(field);
        }
    }
    let stiff = because(&stiff);
    assert!(stiff.contains("the leg that ends in `") && stiff.contains("has one joint"), "{stiff}");
    assert_eq!(because(&many_legged(5)), "no gaits are known for 10 legs");
    assert_eq!(taught_json(&many_legged(4)).gaits, ["wave", "ripple", "tetrapod"]);
}

#[test]
fn without_weight_there_are_no_gaits() {
    let reading = read(&example("quadruped.urdf"), Source::Urdf, Options::default()).unwrap();
    let scene = Scene { gravity: [0.0; 3], ..Scene::default() };
    let teaching = check(&reading, &scene).teaching.unwrap();
    assert_eq!(teaching.because.as_deref(), Some("nothing pulls it down"));
    assert_eq!(teaching.to_string(), "is taught one motion by QDSEGA, because nothing pulls it down");
}
