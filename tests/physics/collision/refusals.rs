//! What a scene with impossible obstacles or ground is told.

use gaitwright_physics::fault;
use gaitwright_physics::scene::Scene;

fn pointers(scene: &str) -> Vec<String> {
    let scene: Scene = fault::from_json(scene.as_bytes()).unwrap();
    scene.faults().into_iter().map(|fault| fault.pointer).collect()
}

#[test]
fn every_fault_of_an_obstacle_has_its_place() {
    let scene = r#"{"obstacles": [
        {"shape": {"kind": "sphere", "radius": 0.5}},
        {"name": "step", "shape": {"kind": "box", "size": [1, 0, 1]}},
        {"name": "step", "shape": {"kind": "cylinder", "radius": -1, "length": 1}},
        {"name": " ", "shape": {"kind": "capsule", "radius": 1, "length": -1, "pose": {"position": [1e9, 0, 0]}}},
        {"shape": {"kind": "hull", "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]}},
        {"shape": {"kind": "sphere", "radius": 1, "pose": {"orientation": [0, 0, 0, 0]}}}
    ]}"#;
    let expected = [
        "/obstacles/1/shape/size",
        "/obstacles/2/name",
        "/obstacles/2/shape/radius",
        "/obstacles/3/name",
        "/obstacles/3/shape/pose/position",
        "/obstacles/3/shape/length",
        "/obstacles/4/shape/vertices",
        "/obstacles/5/shape/pose/orientation",
    ];
    assert_eq!(pointers(scene), expected);
}

#[test]
fn every_fault_of_a_height_field_has_its_place() {
    let field = |heights: &str, size: &str| {
        format!(r#"{{"ground": {{"kind": "height_field", "heights": {heights}, "size": {size}}}}}"#)
    };
    assert_eq!(pointers(&field("[[0, 1], [2, 3]]", "[1, 1]")), [""; 0]);
    assert_eq!(pointers(&field("[[0, 1]]", "[1, 1]")), ["/ground/heights"]);
    assert_eq!(pointers(&field("[[0, 1], [2]]", "[1, 1]")), ["/ground/heights/1"]);
    assert_eq!(pointers(&field("[[0, 1], [2, 1e9]]", "[1, 0]")), ["/ground/heights/1", "/ground/size"]);
    assert_eq!(pointers(r#"{"restitution": 1.5}"#), ["/restitution"]);
    assert_eq!(pointers(r#"{"restitution": 1.0}"#), [""; 0]);
}
