//! A ball that bounces: the speed after each impact is e times the speed before it.

use serde_json::json;

use super::closed_form::{ClosedForm, GRAVITY, at, body, moving, scenario};
use crate::accuracy::measure::Measure;
use crate::scenario::Scenario;
use gaitwright_physics::scene::{Ground, Scene};
use gaitwright_physics::sim::State;

/// Initial height of the lowest point above the ground, m.
const HEIGHT: f64 = 0.5;
/// m.
const RADIUS: f64 = 0.1;
/// Coefficient of restitution.
const REBOUND: f64 = 0.8;

pub(super) const SCENE: ClosedForm = ClosedForm {
    name: "bouncing-ball",
    about: "a ball dropped from 0.5 m bounces with a coefficient of restitution of 0.8",
    truth: "parabolas between impacts, the first at √(2 h / g), each rebound at 0.8 of the speed before it",
    measure: Measure::ROOT_POSITION,
    scenario: document,
    solution,
};

fn document() -> Scenario {
    let ball = body("ball", &json!({ "density": 500, "shapes": [{ "kind": "sphere", "radius": RADIUS }] }));
    let scene = Scene {
        gravity: [0.0, 0.0, -GRAVITY],
        ground: Some(Ground::Plane { height: 0.0 }),
        restitution: REBOUND,
        ..Scene::default()
    };
    scenario(ball, scene, moving([0.0, 0.0, RADIUS + HEIGHT], [0.0; 3]), 1.6)
}

fn solution(start: &State, times: &[f64]) -> Vec<State> {
    let bounced = |&time: &f64| {
        // The first flight, as if it had begun at the ground before time 0.
        let mut speed = (2.0 * GRAVITY * HEIGHT).sqrt();
        let mut since = time + speed / GRAVITY;
        while since > 2.0 * speed / GRAVITY {
            since -= 2.0 * speed / GRAVITY;
            speed *= REBOUND;
        }
        let mut state = at(start, time);
        state.root.position.z = RADIUS + speed * since - 0.5 * GRAVITY * since * since;
        state.root.linear_velocity.z = speed - GRAVITY * since;
        state
    };
    times.iter().map(bounced).collect()
}
