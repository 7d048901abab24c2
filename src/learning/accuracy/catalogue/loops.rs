//! Closed loops, and loops that cannot all be closed.

use serde_json::{Value, json};

use super::case::Case;
use super::quantity::Quantity;
use super::sketch::{GRAVITY, LONGEST, air, body, closed, fixed_base, hinge, moving, resting, rod, scenario};
use crate::scenario::{CharacterSource, InlineCharacter, Scenario};
use gaitwright_physics::scene::Scene;

/// The bundled four-bar: a frame on two cranks whose ends a coupler joins.
const FOURBAR: &str = include_str!("../../../../examples/fourbar.json");

/// Length of the cranks, m.
const CRANK: f64 = 0.3;

/// Length of the frame and of the coupler, m.
const COUPLER: f64 = 0.4;

/// Amplitude of the swing, rad.
const AMPLITUDE: f64 = 1.0;

/// The cases of loops.
pub fn cases() -> Vec<Case> {
    vec![swinging(), conflicting(), dropped()]
}

/// Two cranks of 1 kg that hang 0.4 m apart and a coupler of 1 kg between their ends, deflected to `angle` (rad),
/// with the joints `ties` in addition to the one that closes the loop.
fn fourbar(angle: f64, ties: &[Value]) -> Scenario {
    let across = COUPLER * COUPLER / 12.0;
    let links = [
        body("frame", 1.0, [0.0; 3], [0.1; 3]),
        rod("left", 1.0, CRANK),
        body("coupler", 1.0, [0.5 * COUPLER, 0.0, 0.0], [1e-4, across, across]),
        rod("right", 1.0, CRANK),
    ];
    let (y, end) = ([0.0, 1.0, 0.0], [0.0, 0.0, -CRANK]);
    let joints = [
        hinge("left_shoulder", "frame", "left", [0.0; 3], y),
        hinge("left_elbow", "left", "coupler", end, y),
        hinge("right_shoulder", "frame", "right", [COUPLER, 0.0, 0.0], y),
    ];
    let mut loops = vec![json!({ "name": "right_elbow", "kind": "revolute", "a": "right", "b": "coupler",
                                 "origin": { "position": end }, "axis": y })];
    loops.extend_from_slice(ties);
    let mut scenario = fixed_base(closed("fourbar", &links, &joints, &loops), air());
    scenario.start.joints =
        moving([("left_shoulder", angle, 0.0), ("left_elbow", -angle, 0.0), ("right_shoulder", angle, 0.0)]);
    scenario
}

/// The coupler of a parallelogram does not rotate: for the energy it is a point mass at the ends of two rods.
fn swinging() -> Case {
    let inertia = 2.0 * CRANK * CRANK / 3.0 + CRANK * CRANK;
    let energy = GRAVITY * (CRANK + CRANK) * (1.0 - AMPLITUDE.cos());
    let fastest = (2.0 * energy / inertia).sqrt();
    // A link end that moves straight on for a step leaves its circle by (ω h)² / 2 of the radius. Each step corrects a
    // fifth of the gap.
    let open = 2.5 * (fastest * LONGEST).powi(2) * CRANK;
    Case::new("four-bar", "a parallelogram of four bars swings from 1 rad", fourbar(AMPLITUDE, &[]))
        .at_most(open, Quantity::LimitOvershoot)
        .at_most(fastest * LONGEST * energy, Quantity::EnergyChange)
}

/// When deflected, the two loops contradict each other. What they have in common is no loop open by more than the one of them that is
/// open at the start: with the coupler not rotated, its point of the tie has gone along with the ends of the cranks. Each is
/// corrected at no more than 4 √(ℓ g), here some 5 m/s, with moment arms of 0.1 m, and two corrections may add up.
fn conflicting() -> Case {
    let angle: f64 = 0.6;
    let open = 2.0 * CRANK * (0.5 * angle).sin();
    let tie = json!({ "name": "tie", "kind": "ball", "a": "frame", "b": "coupler",
                      "origin": { "position": [0.1, 0.0, -CRANK] } });
    let about = "a four-bar swung out to 0.6 rad, with a tie that only fits when it hangs";
    Case::new("conflicting-loops", about, fourbar(angle, &[tie]))
        .at_most(open, Quantity::LimitOvershoot)
        .at_most(100.0, Quantity::JointSpeed { after: 0.0 })
}

/// The parallelogram folds under its frame until the coupler meets it, between the frame and the ground: both its
/// ends and the ground's contacts act on one degree of freedom.
fn dropped() -> Case {
    let (height, mass): (f64, f64) = (0.6, 2.0);
    // The document is part of the program. If it were not JSON, the case would fail as a character without a link.
    let document = serde_json::from_str(FOURBAR).unwrap_or_default();
    let mut scenario = scenario(CharacterSource::Inline(InlineCharacter::Json(document)), Scene::default());
    scenario.start.root = Some(resting([0.0, 0.0, height]));
    let energy = mass * GRAVITY * height;
    let fastest = (2.0 * GRAVITY * height).sqrt() / CRANK;
    let open = 2.5 * (fastest * LONGEST).powi(2) * CRANK;
    Case::new("four-bar-dropped", "the bundled four-bar falls on its coupler and collapses", scenario)
        .at_most(open, Quantity::LimitOvershoot)
        .at_most(1e-6, Quantity::Penetration)
        .at_most(fastest * LONGEST * energy, Quantity::EnergyGain)
        // It has lain still for seven seconds: what the solver's tolerance leaves.
        .at_most(1e-6, Quantity::RootSpeed { after: 8.0 })
        .at_most(1e-6, Quantity::JointSpeed { after: 8.0 })
}
