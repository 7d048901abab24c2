//! What `check` says about characters.

use super::{PADDLER, run, run_with, stdout};
use crate::common;

use std::path::Path;

use serde_json::{Value, json};

#[test]
fn check_tells_what_it_understood() {
    let text = stdout(&run(&["check", PADDLER]));
    let document: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(document["format"], "gaitwright/check@1");
    assert_eq!(document["links"], json!(["plate", "left", "right"]));
    assert_eq!(document["joints"][0]["limits"], json!([-3.0, 3.0]));
    assert_eq!(document["joints"][0]["effort"], 10.0);
    assert_eq!(document["shapes"][0], json!({ "link": "plate", "kind": "box", "size": [0.4, 0.3, 0.05] }));
    assert_eq!(document["notes"], json!([]));
    let from_input = run_with(&["check", "-"], &std::fs::read(PADDLER).unwrap());
    assert_eq!(stdout(&from_input), text);
}

#[test]
fn check_lists_the_shapes_that_pass_through_each_other() {
    let ball = |radius: f64| json!([{ "kind": "sphere", "radius": radius }]);
    let link = |name: &str, radius: f64| json!({ "name": name, "density": 1000, "shapes": ball(radius) });
    let slide = |child: &str, parent: &str, x: f64| {
        json!({ "name": format!("to_{child}"), "kind": "prismatic", "parent": parent, "child": child,
                "origin": { "position": [x, 0, 0] }, "axis": [1, 0, 0],
                "limits": { "lower": -0.01, "upper": 0.01 } })
    };
    // A ball, another beside it, and on that a small one inside the first, one out of its reach, and one that
    // just reaches it.
    let character = json!({
        "format": "gaitwright/character@1", "name": "balls",
        "links": [link("first", 0.1), link("beside", 0.1), link("inside", 0.05), link("far", 0.05),
                  link("near", 0.05)],
        "joints": [slide("beside", "first", 0.5), slide("inside", "beside", -0.5),
                   slide("far", "beside", 1.0), slide("near", "beside", -0.665)]
    });
    let answer = run_with(&["check", "-"], character.to_string().as_bytes());
    let document: Value = serde_json::from_str(&stdout(&answer)).unwrap();
    // `beside` is joined to all others, and of those only `near` and `first` can meet.
    assert_eq!(
        document["self_collision"],
        json!({ "can_touch": 1, "apart": 4, "joined": 4, "overlapping": [[0, 2]] })
    );
}

/// What `check` states of a file: its mass, kg, and its movable joints, all of them in the standing pose.
fn assert_checked(path: &Path, mass: f64, joints: usize) {
    let document: Value = serde_json::from_str(&stdout(&run(&["check", path.to_str().unwrap()]))).unwrap();
    assert!((document["mass"].as_f64().unwrap() - mass).abs() < 1e-3, "{}", path.display());
    assert_eq!(document["joints"].as_array().unwrap().len(), joints, "{}", path.display());
    assert_eq!(document["standing"]["joints"].as_object().unwrap().len(), joints, "{}", path.display());
}

#[test]
fn check_reads_the_examples() {
    for (name, joints) in [("quadruped", 12), ("biped", 8), ("hexapod", 18), ("snake", 11)] {
        let numbers = common::json(&common::reference_path(&format!("{name}.json")));
        let path = common::repository().join(numbers["character"].as_str().unwrap());
        assert_checked(&path, numbers["random_states"][0]["mass"].as_f64().unwrap(), joints);
    }
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn check_reads_robots_from_elsewhere() {
    let folder = common::robots();
    // Name, mass (kg) and number of movable joints as the robots' makers state them.
    for (name, mass, joints) in
        [("a1", 13.741, 12), ("anymal_b", 30.475, 12), ("bolt", 1.254, 6), ("quadruped", 2.772, 8)]
    {
        assert_checked(&folder.join(format!("{name}.urdf")), mass, joints);
    }
}
