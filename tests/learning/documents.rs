//! Documents that say what cannot be meant: refused, with the place of the fault and on one line.

use std::fs;

use gaitwright_learning::scenario::{NoFiles, Scenario};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::Motion;
use serde_json::{Value, json};

/// A crank on a motor that carries a passive rod.
fn swing() -> Value {
    let ball = json!([{ "kind": "sphere", "radius": 0.1 }]);
    let link = |name: &str| json!({ "name": name, "density": 1000, "shapes": ball });
    json!({
        "format": "gaitwright/character@1", "name": "swing",
        "links": [link("post"), link("crank"), link("rod")],
        "joints": [
            { "name": "motor", "kind": "continuous", "parent": "post", "child": "crank",
              "origin": { "position": [0.5, 0, 0] }, "axis": [0, 1, 0] },
            { "name": "hinge", "kind": "continuous", "parent": "crank", "child": "rod",
              "origin": { "position": [0.5, 0, 0] }, "axis": [0, 1, 0], "actuation": null }]
    })
}

/// A scenario of the swing with these parts.
fn scenario(parts: &Value) -> Value {
    let mut document = json!({ "character": { "json": swing() }, "duration": 0.01 });
    for (name, part) in parts.as_object().unwrap() {
        document[name] = part.clone();
    }
    document
}

/// Why the scenario in `text` is refused.
fn refused(text: &str) -> InputError {
    let set_up = Scenario::parse(text.as_bytes()).and_then(|scenario| scenario.set_up(&NoFiles));
    set_up.err().unwrap_or_else(|| panic!("taken: {text}"))
}

/// The fault of the scenario in `text`, which is well-formed, as it is told.
fn fault(text: &str) -> String {
    let error = refused(text);
    assert!(matches!(&error, InputError::Impossible(faults) if faults.len() == 1), "{text}: {error:?}");
    error.to_string()
}

/// Asserts that a scenario with these parts has its fault at `place`, and that the reason says `reason`.
fn assert_fault(parts: &Value, place: &str, reason: &str) {
    let fault = fault(&scenario(parts).to_string());
    assert!(fault.starts_with(&format!("{place}: ")) && fault.contains(reason), "{parts}: {fault}");
}

#[test]
fn a_bolted_root_that_moves_is_refused() {
    let root = |velocity: &str| json!({ "position": [0, 0, 1], velocity: [0, 0, 2] });
    for velocity in ["linear_velocity", "angular_velocity"] {
        let parts = json!({ "fixed_base": true, "start": { "root": root(velocity) } });
        assert_fault(&parts, &format!("/start/root/{velocity}"), "bolted");
    }
}

#[test]
fn numbers_beyond_all_use_are_refused_before_anything_is_computed() {
    let ground = |height: f64| json!({ "scene": { "ground": { "kind": "plane", "height": height } } });
    let root = json!({ "start": { "root": { "position": [0, 1e300, 0] } } });
    let joint = json!({ "start": { "joints": { "motor": { "velocity": -1e7 } } } });
    for (parts, place, bound) in [
        (json!({ "scene": { "gravity": [1.8e19, 0, -9.81] } }), "/scene/gravity", "within 1e4 m/s²"),
        (ground(1e16), "/scene/ground/height", "within 1e6 m"),
        (ground(-1e308), "/scene/ground/height", "within 1e6 m"),
        (root, "/start/root", "within 1e6 m"),
        (joint, "/start/joints/motor", "within 1e6 rad"),
    ] {
        assert_fault(&parts, place, bound);
    }
}

#[test]
fn a_bolted_root_is_at_the_origin_where_left_out() {
    let ground = json!({ "kind": "plane", "height": -3 });
    let document = scenario(&json!({ "fixed_base": true, "scene": { "ground": ground } }));
    let setup = Scenario::parse(document.to_string().as_bytes()).unwrap().set_up(&NoFiles).unwrap();
    assert_eq!(setup.start.root.position.coords.norm(), 0.0);
}

#[test]
fn unknown_fields_of_things_with_a_kind_are_named() {
    let shape = json!({ "kind": "sphere", "radius": 1, "raduis": 1 });
    for (parts, place) in [
        (json!({ "drive": { "kind": "none", "stifness": 3 } }), "/drive/stifness"),
        (json!({ "drive": { "kind": "hold", "stifness": 3 } }), "/drive/stifness"),
        (json!({ "scene": { "ground": { "kind": "plane", "hieght": 0 } } }), "/scene/ground/hieght"),
        (json!({ "scene": { "obstacles": [{ "shape": shape }] } }), "/scene/obstacles/0/shape/raduis"),
    ] {
        assert_fault(&parts, place, "unknown field");
    }
}

#[test]
fn values_of_the_wrong_type_are_named() {
    let hold = |field: &str, value: Value| json!({ "drive": { "kind": "hold", field: value } });
    let root = json!({ "position": [0, 0, 1], "orientation": [1, 0, 0, 0, 0] });
    for (parts, place, reason) in [
        (json!({ "scene": { "effects": { "gravity": true } } }), "/scene/effects/gravity", "on, off, auto"),
        (json!({ "scene": { "gravity": [0, 0, -9.81, 0] } }), "/scene/gravity", "invalid length 4"),
        (json!({ "start": { "root": root } }), "/start/root/orientation", "invalid length 5"),
        (json!({ "character": { "foo": 1 } }), "/character/foo", "`urdf`, `json`, `zip`, `id`"),
        (json!({ "character": {} }), "/character", "`urdf`, `json`, `zip` and `id`"),
        (json!({ "character": 7 }), "/character", "a path"),
        (hold("max_torque", json!("foo")), "/drive/max_torque", "\"character\", a number, or null"),
        (hold("stiffness", json!("foo")), "/drive/stiffness", "expected a number"),
        (hold("joints", json!({ "motor": "foo" })), "/drive/joints/motor", "expected a number"),
        (
            hold("stiffness", json!("integer `3`")),
            "/drive/stiffness",
            "string \"integer `3`\", expected a number",
        ),
        (json!({ "drive": null }), "/drive", "invalid type: null, expected an object"),
        (json!({ "start": { "joints": [1] } }), "/start/joints", "invalid type: list, expected an object"),
        (json!({ "fixed_base": 1.5 }), "/fixed_base", "number `1.5`, expected true or false"),
        (json!({ "drive": { "kind": "hovld" } }), "/drive/kind", "unknown variant"),
        (json!({ "drive": { "stiffness": 1 } }), "/drive", "missing field `kind`"),
    ] {
        assert_fault(&parts, place, reason);
    }
    let mut bent = scenario(&json!({}));
    bent["character"]["json"]["joints"][0]["axis"] = json!([0, 1, 0, 0]);
    let fault = fault(&bent.to_string());
    assert!(fault.starts_with("/character/joints/0/axis: invalid length 4"), "{fault}");
    for text in ["{\"character\": tru}", "{\"character\": \"a\"} {}"] {
        assert!(matches!(refused(text), InputError::Malformed(_)), "{text}");
    }
}

#[test]
fn keys_given_twice_are_named() {
    let character = json!({ "json": swing() }).to_string();
    let standing =
        character.replacen("\"name\"", "\"standing\": { \"motor\": 0, \"motor\": 1 }, \"name\"", 1);
    for (character, parts, place) in [
        (&character, r#""start": { "joints": { "motor": {}, "motor": {} } }"#, "/start/joints/motor"),
        (
            &character,
            r#""drive": { "kind": "hold", "joints": { "motor": 0, "motor": 1 } }"#,
            "/drive/joints/motor",
        ),
        (
            &character,
            r#""scene": { "effects": { "gravity": "on", "gravity": "off" } }"#,
            "/scene/effects/gravity",
        ),
        (&character, r#""duration": 1, "duration": 2"#, "/duration"),
        (&standing, r#""duration": 1"#, "/character/json/"),
    ] {
        let fault = fault(&format!("{{ \"character\": {character}, {parts} }}"));
        assert!(fault.starts_with(place) && fault.contains("given twice"), "{fault}");
    }
}

#[test]
fn a_target_for_a_passive_joint_is_refused() {
    let drive = |joint: &str| json!({ "drive": { "kind": "hold", "joints": { joint: 0.5 } } });
    assert_fault(&drive("hinge"), "/drive/joints/hinge", "\"hinge\" is passive");
    // Nothing pushes it either.
    let pushed = |joint: &str| json!({ "drive": { "kind": "torque", "joints": { joint: 0.5 } } });
    assert_fault(&pushed("hinge"), "/drive/joints/hinge", "\"hinge\" is passive");
    let held = Scenario::parse(scenario(&drive("motor")).to_string().as_bytes()).unwrap();
    assert!(held.set_up(&NoFiles).is_ok());
}

#[test]
fn an_array_is_no_object() {
    let shape = json!({ "kind": "sphere", "radius": 1, "pose": [[0, 0, 1]] });
    for (parts, place) in [
        (json!({ "scene": [[0, 0, -9.81]] }), "/scene"),
        (json!({ "scene": { "ground": ["plane", 0] } }), "/scene/ground"),
        (json!({ "scene": { "obstacles": [["wall", shape]] } }), "/scene/obstacles/0"),
        (json!({ "scene": { "obstacles": [{ "shape": shape }] } }), "/scene/obstacles/0/shape/pose"),
        (json!({ "drive": ["none"] }), "/drive"),
        (json!({ "accuracy": [null, 0.001] }), "/accuracy"),
    ] {
        let fault = fault(&scenario(&parts).to_string());
        assert!(fault.starts_with(place) && fault.contains("object"), "{fault}");
    }
    let whole = json!(["gaitwright/scenario@1", { "json": swing() }]);
    assert!(fault(&whole.to_string()).contains("object"));
}

#[test]
fn names_are_escaped_in_places_and_stay_on_one_line() {
    for parts in [
        json!({ "start": { "joints": { "a/b~\nc": {} } } }),
        json!({ "drive": { "kind": "torque", "joints": { "a/b~\nc": 1 } } }),
    ] {
        let error = refused(&scenario(&parts).to_string());
        assert!(error.faults()[0].pointer.ends_with("/joints/a~1b~0\nc"), "{error:?}");
        assert!(error.to_string().contains("a~1b~0\\nc: the character has no movable joint"), "{error}");
        assert_eq!(error.to_string().lines().count(), 1, "{error}");
    }
}

#[test]
fn the_bundled_motion_gives_a_reason_for_what_it_was_learned_without() {
    let path = crate::common::example_path("quadruped-walk.motion.json");
    let motion = Motion::parse(&fs::read(path).unwrap()).unwrap();
    assert!(motion.provenance.effects.values().all(|decision| !decision.because.contains("version")));
}
