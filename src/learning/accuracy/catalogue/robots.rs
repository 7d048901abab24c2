//! Whole characters: dropped, resting, on straight legs, sunk into the ground.

use std::collections::BTreeMap;

use serde_json::json;

use super::case::Case;
use super::quantity::Quantity;
use super::sketch::{GRAVITY, LONGEST, block, character, hinge, hold, resting, rod, scenario, with};
use crate::scenario::{CharacterSource, InlineCharacter, Scenario};
use gaitwright_physics::scene::{DEFAULT_FEEDFORWARD_PERIOD, Drive, Feedforward, MaxTorque, Scene};

/// The bundled quadruped.
const QUADRUPED: &str = include_str!("../../../../examples/quadruped.urdf");

/// Height of the quadruped's root when it stands, m.
const STANDING: f64 = 0.28;

/// The cases of whole characters.
pub fn cases() -> Vec<Case> {
    vec![dropped(), sunk(), rest(), straight_legs()]
}

/// The quadruped that holds its standing pose with its own motors, in the default scene.
fn holding() -> Scenario {
    let character = CharacterSource::Inline(InlineCharacter::Urdf(QUADRUPED.to_owned()));
    let mut scenario = scenario(character, Scene::default());
    scenario.drive = Drive::Hold {
        stiffness: None,
        damping: None,
        feedforward: Feedforward::None,
        feedforward_period: DEFAULT_FEEDFORWARD_PERIOD,
        max_torque: MaxTorque::Character,
        offset: BTreeMap::new(),
        joints: BTreeMap::new(),
    };
    scenario
}

fn dropped() -> Case {
    let height: f64 = 5.0;
    let mut scenario = holding();
    scenario.start.root = Some(resting([0.0, 0.0, height]));
    let landing = (2.0 * GRAVITY * height).sqrt();
    Case::new("drop-5-m", "the quadruped falls from 5 m and comes to rest", scenario)
        .at_most(1e-6, Quantity::Penetration)
        .at_most(1e-6, Quantity::LimitOvershoot)
        // The energy in the springs that carry the weight at the start is less than this.
        .at_most(1.0, Quantity::EnergyGain)
        // A step may end up to its own length later than the fall.
        .at_most(landing + GRAVITY * LONGEST, Quantity::RootSpeed { after: 0.0 })
        // It stands as still as the one that stands for a minute.
        .at_most(1e-4, Quantity::RootSpeed { after: 8.0 })
}

fn sunk() -> Case {
    let mut scenario = holding();
    scenario.start.root = Some(resting([0.0, 0.0, 0.1]));
    // No higher than its standing height, but for a sixth of it.
    let rise = 0.05;
    Case::new("sunk-quadruped", "the quadruped starts with its legs in the ground and rises", scenario)
        // Whoever is faster than this when it stands rises higher.
        .at_most((2.0 * GRAVITY * rise).sqrt(), Quantity::RootSpeed { after: 0.0 })
        .at_most(rise, Quantity::Rise { over: STANDING })
        .at_most(1e-2, Quantity::RootSpeed { after: 8.0 })
}

fn rest() -> Case {
    let mut scenario = holding();
    scenario.duration = 60.0;
    scenario.sample_every = 0.08;
    Case::new("rest-quadruped", "the quadruped stands for a minute", scenario)
        .at_most(1e-4, Quantity::Creep { after: 5.0 })
        .at_most(1e-4, Quantity::RootSpeed { after: 5.0 })
        .at_most(1e-4, Quantity::Penetration)
}

/// A table on four legs of two rods each, dropped with its legs stretched out, so that the feet cannot move
/// along them and the knees do not soften the impact.
fn straight_legs() -> Case {
    let (trunk, thigh, shank, length, foot, fall) = (10.0, 1.0, 0.5, 0.2, 0.02, 0.05);
    let mut links = vec![block("trunk", trunk, [0.5, 0.3, 0.1])];
    let mut joints = Vec::new();
    let mut names = Vec::new();
    for (leg, [x, y]) in [[0.2, 0.1], [0.2, -0.1], [-0.2, 0.1], [-0.2, -0.1]].into_iter().enumerate() {
        let [upper, lower] = ["thigh", "shank"].map(|part| format!("{part}_{leg}"));
        let [hip, knee] = ["hip", "knee"].map(|joint| format!("{joint}_{leg}"));
        let ball = json!({ "kind": "sphere", "radius": foot, "pose": { "position": [0.0, 0.0, -length] } });
        links.push(rod(&upper, thigh, length));
        links.push(with(rod(&lower, shank, length), &json!({ "shapes": [ball] })));
        joints.push(hinge(&hip, "trunk", &upper, [x, y, 0.0], [0.0, 1.0, 0.0]));
        joints.push(hinge(&knee, &upper, &lower, [0.0, 0.0, -length], [0.0, 1.0, 0.0]));
        names.extend([hip, knee]);
    }
    let mut scenario = scenario(character("table", &links, &joints), Scene::default());
    let height = 2.0 * length + foot + fall;
    scenario.start.root = Some(resting([0.0, 0.0, height]));
    let (stiffness, damping) = (100.0, 5.0);
    scenario.drive =
        hold(stiffness, damping, MaxTorque::Unlimited, names.iter().map(|name| (name.as_str(), 0.0)));
    let weight = GRAVITY * (trunk + 4.0 * (thigh + shank));
    Case::new("straight-legs", "a table on jointed legs is dropped with its legs stretched out", scenario)
        .at_most(1e-4, Quantity::Penetration)
        .at_most(0.01 * weight * height, Quantity::EnergyGain)
        .at_most((2.0 * GRAVITY * fall).sqrt() + 0.1, Quantity::RootSpeed { after: 0.0 })
        .at_most(1e-4, Quantity::RootSpeed { after: 8.0 })
}
