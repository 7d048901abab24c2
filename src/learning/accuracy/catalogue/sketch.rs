//! Building blocks for the characters and scenes of the cases.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use crate::scenario::{CharacterSource, InlineCharacter, JointStart, Scenario, ScenarioFormat, Start};
use gaitwright_physics::motion::RootMotion;
use gaitwright_physics::scene::{
    Accuracy, AskedAccuracy, DEFAULT_FEEDFORWARD_PERIOD, Drive, Feedforward, Integrator, MaxTorque, Scene,
};

/// Gravitational acceleration of the default scene, m/s².
pub const GRAVITY: f64 = 9.81;

/// Longest step that the bounds allow for, s: four times the default one.
pub const LONGEST: f64 = 0.008;

/// A character document with these links and joints that stands with all joints at zero.
pub fn character(name: &str, links: &[Value], joints: &[Value]) -> CharacterSource {
    closed(name, links, joints, &[])
}

/// The same with joints that close loops.
pub fn closed(name: &str, links: &[Value], joints: &[Value], loops: &[Value]) -> CharacterSource {
    CharacterSource::Inline(InlineCharacter::Json(json!({
        "format": "gaitwright/character@1", "name": name, "links": links, "joints": joints, "loops": loops,
        "standing": {}
    })))
}

/// A link of `mass` kg with these principal moments (kg m²) about `center` (m), without shapes.
pub fn body(name: &str, mass: f64, center: [f64; 3], moments: [f64; 3]) -> Value {
    let [xx, yy, zz] = moments;
    json!({ "name": name, "mass": mass, "center_of_mass": center, "inertia": { "xx": xx, "yy": yy, "zz": zz } })
}

/// A rod of `mass` kg that hangs `length` m down from its joint, 2 cm in radius.
pub fn rod(name: &str, mass: f64, length: f64) -> Value {
    let radius = 0.02;
    let across = mass * (length * length / 12.0 + radius * radius / 4.0);
    body(name, mass, [0.0, 0.0, -0.5 * length], [across, across, 0.5 * mass * radius * radius])
}

/// A solid box with edges of `size` m and a mass of `mass` kg.
pub fn block(name: &str, mass: f64, size: [f64; 3]) -> Value {
    let [x, y, z] = size.map(|edge| edge * edge * mass / 12.0);
    let solid = body(name, mass, [0.0; 3], [y + z, x + z, x + y]);
    with(solid, &json!({ "shapes": [{ "kind": "box", "size": size }] }))
}

/// A hinge of `child` about `axis` at `position` in `parent`.
pub fn hinge(name: &str, parent: &str, child: &str, position: [f64; 3], axis: [f64; 3]) -> Value {
    json!({ "name": name, "kind": "continuous", "parent": parent, "child": child,
            "origin": { "position": position }, "axis": axis })
}

/// `document` with the entries of `more`.
pub fn with(document: Value, more: &Value) -> Value {
    match (document, more) {
        (Value::Object(mut document), Value::Object(more)) => {
            document.extend(more.iter().map(|(name, value)| (name.clone(), value.clone())));
            Value::Object(document)
        }
        (document, _) => document,
    }
}

/// Ten seconds of `character` in `scene`, its joints passive.
pub fn scenario(character: CharacterSource, scene: Scene) -> Scenario {
    Scenario {
        format: ScenarioFormat::V1,
        character,
        fixed_base: false,
        scene,
        accuracy: Accuracy::default().into(),
        start: Start::default(),
        drive: Drive::default(),
        duration: 10.0,
        sample_every: 0.04,
    }
}

/// The same with the integrator of second order.
pub fn second_order(scenario: Scenario) -> Scenario {
    tuned(scenario, |accuracy| accuracy.integrator = Integrator::MoreauJean)
}

/// The same with its settings changed.
pub fn tuned(mut scenario: Scenario, change: impl FnOnce(&mut Accuracy)) -> Scenario {
    if let AskedAccuracy::Settings(accuracy) = &mut scenario.accuracy {
        change(accuracy);
    }
    scenario
}

/// The same with the root fixed to the world.
pub fn fixed_base(character: CharacterSource, scene: Scene) -> Scenario {
    Scenario { fixed_base: true, ..scenario(character, scene) }
}

/// Gravity without ground.
pub fn air() -> Scene {
    Scene { ground: None, ..Scene::default() }
}

/// Neither gravity nor ground.
pub fn space() -> Scene {
    Scene { gravity: [0.0; 3], ..air() }
}

/// A root at `position` (m) with the angular velocity `turning` (rad/s).
pub fn turning(position: [f64; 3], turning: [f64; 3]) -> RootMotion {
    RootMotion { angular_velocity: turning, ..resting(position) }
}

/// A root at rest at `position`, m.
pub fn resting(position: [f64; 3]) -> RootMotion {
    RootMotion {
        position,
        orientation: [1.0, 0.0, 0.0, 0.0],
        linear_velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
    }
}

/// Joints by name, each with its angle and velocity at the start.
pub fn moving<'a>(joints: impl IntoIterator<Item = (&'a str, f64, f64)>) -> BTreeMap<String, JointStart> {
    let start = |(name, angle, velocity): (&str, _, _)| {
        (name.to_owned(), JointStart { angle: Some(angle), velocity })
    };
    joints.into_iter().map(start).collect()
}

/// Springs and dampers that hold all joints of `targets` there, without feedforward.
pub fn hold<'a>(
    stiffness: f64,
    damping: f64,
    max_torque: MaxTorque,
    targets: impl IntoIterator<Item = (&'a str, f64)>,
) -> Drive {
    Drive::Hold {
        stiffness: Some(stiffness),
        damping: Some(damping),
        feedforward: Feedforward::None,
        feedforward_period: DEFAULT_FEEDFORWARD_PERIOD,
        max_torque,
        offset: BTreeMap::new(),
        joints: targets.into_iter().map(|(name, target)| (name.to_owned(), target)).collect(),
    }
}

/// A range of motion, as entries of a joint.
pub fn limits(lower: f64, upper: f64) -> Value {
    json!({ "kind": "revolute", "limits": { "lower": lower, "upper": upper } })
}
