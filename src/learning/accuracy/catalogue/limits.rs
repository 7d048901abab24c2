//! Limits against targets and torques, and actuators that can do no more.

use std::collections::BTreeMap;

use serde_json::Value;

use super::case::Case;
use super::quantity::Quantity;
use super::sketch::{
    GRAVITY, air, body, character, fixed_base, hinge, hold, limits, moving, rod, space, with,
};
use crate::scenario::Scenario;
use gaitwright_physics::scene::{Drive, MaxTorque, Scene};

/// The end of the hinge's range, rad.
const END: f64 = 0.5;

/// Greatest violation of a limit, rad: a limit may be approached but not crossed.
const OVERSHOOT: f64 = 1e-3;

/// The cases of limits.
pub fn cases() -> Vec<Case> {
    let stopped = |name: &str, about: &str, scenario: Scenario| {
        Case::new(name, about, scenario)
            .at_most(OVERSHOOT, Quantity::LimitOvershoot)
            .at_most(OVERSHOOT, Quantity::FinalAngle { joint: "hinge".into(), wanted: END })
            .at_most(1e-3, Quantity::JointSpeed { after: 5.0 })
    };
    let mut target = bar(air());
    target.drive = hold(1000.0, 20.0, MaxTorque::All(50.0), [("hinge", 2.0)]);
    let mut torque = bar(air());
    torque.drive = Drive::Torque { joints: BTreeMap::from([("hinge".to_owned(), 100.0)]) };
    vec![
        stopped("limit-against-target", "a hinge is driven to a target beyond its limit", target)
            .at_most(1e-9, Quantity::TorqueExcess),
        stopped("limit-against-torque", "a hinge is pushed against its limit with 100 N m", torque),
        violated(),
        saturated(),
    ]
}

/// A rod of 1 kg and 0.5 m on a hinge between -0.5 and 0.5 rad.
fn bar(scene: Scene) -> Scenario {
    let links = [body("base", 1.0, [0.0; 3], [0.1; 3]), rod("bar", 1.0, 0.5)];
    let joints: [Value; 1] =
        [with(hinge("hinge", "base", "bar", [0.0; 3], [0.0, 1.0, 0.0]), &limits(-END, END))];
    fixed_base(character("bar", &links, &joints), scene)
}

/// The joint returns by correction of its position, which leaves no velocity, and stays.
fn violated() -> Case {
    let mut scenario = bar(space());
    scenario.start.joints = moving([("hinge", 1.0, 0.0)]);
    Case::new("limit-violated-at-start", "a hinge starts half a radian beyond its limit", scenario)
        .at_most(1e-6, Quantity::JointSpeed { after: 0.0 })
        .at_most(1e-2, Quantity::FinalAngle { joint: "hinge".into(), wanted: END })
        .at_most(1e-2, Quantity::JointSpeed { after: 5.0 })
}

/// Three rods whose motors are too weak to reach their targets.
fn saturated() -> Case {
    let (most, stiffness) = (0.5, 1e4);
    let names = ["first", "second", "third"];
    let mut links = vec![body("base", 1.0, [0.0; 3], [0.1; 3])];
    let mut joints = Vec::new();
    let mut parent = ("base".to_owned(), [0.0; 3]);
    for name in names {
        let link = format!("{name}_rod");
        joints.push(hinge(name, &parent.0, &link, parent.1, [0.0, 1.0, 0.0]));
        links.push(rod(&link, 1.0, 0.5));
        parent = (link, [0.0, 0.0, -0.5]);
    }
    let mut scenario = fixed_base(character("weak", &links, &joints), air());
    scenario.start.joints = moving(names.map(|name| (name, 0.0, 2.0)));
    scenario.drive = hold(stiffness, 10.0, MaxTorque::All(most), names.map(|name| (name, 2.0)));
    // The potential energy of three rods from hanging to upright, and the work of the motors over two radians each.
    let available = 3.0 * GRAVITY * 1.5 + 3.0 * most * 2.0;
    Case::new("torque-saturated", "three motors that cannot reach their targets", scenario)
        .at_most(1e-9, Quantity::TorqueExcess)
        .at_most(0.05 * available, Quantity::EnergyGain)
}
