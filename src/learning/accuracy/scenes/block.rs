//! A block that slides to rest: it decelerates by μ g and stops after the distance v² / (2 μ g).

use serde_json::json;

use super::closed_form::{ClosedForm, GRAVITY, at, body, moving, scenario};
use crate::accuracy::measure::Measure;
use crate::scenario::Scenario;
use gaitwright_physics::scene::{Ground, Scene};
use gaitwright_physics::sim::State;

/// Initial speed, m/s.
const SPEED: f64 = 2.0;
const FRICTION: f64 = 0.4;
/// Edges, m.
const SIZE: [f64; 3] = [0.3, 0.2, 0.1];

pub(super) const SCENE: ClosedForm = ClosedForm {
    name: "sliding-block",
    about: "a block pushed along the ground slides to rest",
    truth: "x = v t − ½ μ g t² until it stands at v² / (2 μ g)",
    measure: Measure::ROOT_POSITION,
    scenario: document,
    solution,
};

fn document() -> Scenario {
    let block = body("block", &json!({ "density": 500, "shapes": [{ "kind": "box", "size": SIZE }] }));
    let scene = Scene {
        gravity: [0.0, 0.0, -GRAVITY],
        ground: Some(Ground::Plane { height: 0.0 }),
        friction: FRICTION,
        ..Scene::default()
    };
    scenario(block, scene, moving([0.0, 0.0, 0.5 * SIZE[2]], [SPEED, 0.0, 0.0]), 0.832)
}

fn solution(start: &State, times: &[f64]) -> Vec<State> {
    let slowing = FRICTION * GRAVITY;
    let slid = |&time: &f64| {
        let sliding = time.min(SPEED / slowing);
        let mut state = at(start, time);
        state.root.position.x += SPEED * sliding - 0.5 * slowing * sliding * sliding;
        state.root.linear_velocity.x = SPEED - slowing * sliding;
        state
    };
    times.iter().map(slid).collect()
}
