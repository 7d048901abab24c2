//! A ball that slips until it rolls: its speed decreases at μ g and its spin increases at 5 μ g / (2 r), until after the
//! time 2 v / (7 μ g) it rolls at 5/7 of the initial speed.

use nalgebra::{UnitQuaternion, Vector3};
use serde_json::json;

use super::closed_form::{ClosedForm, GRAVITY, at, body, moving, scenario};
use crate::accuracy::measure::Measure;
use crate::scenario::Scenario;
use gaitwright_physics::scene::{Ground, Scene};
use gaitwright_physics::sim::State;

/// Initial speed, m/s.
const SPEED: f64 = 2.0;
const FRICTION: f64 = 0.3;
/// m.
const RADIUS: f64 = 0.1;

pub(super) const SCENE: ClosedForm = ClosedForm {
    name: "rolling-ball",
    about: "a ball thrown along the ground slips, then rolls",
    truth: "slips for 2 v / (7 μ g), then rolls at 5 v / 7",
    measure: Measure::DISPLACEMENT,
    scenario: document,
    solution,
};

fn document() -> Scenario {
    let ball = body("ball", &json!({ "density": 500, "shapes": [{ "kind": "sphere", "radius": RADIUS }] }));
    let scene = Scene {
        gravity: [0.0, 0.0, -GRAVITY],
        ground: Some(Ground::Plane { height: 0.0 }),
        friction: FRICTION,
        ..Scene::default()
    };
    scenario(ball, scene, moving([0.0, 0.0, RADIUS], [SPEED, 0.0, 0.0]), 0.512)
}

fn solution(start: &State, times: &[f64]) -> Vec<State> {
    let slowing = FRICTION * GRAVITY;
    let spinning = 2.5 * slowing / RADIUS;
    let moved = |&time: &f64| {
        let slipping = time.min(2.0 * SPEED / (7.0 * slowing));
        let rolling = time - slipping;
        let (speed, spin) = (SPEED - slowing * slipping, spinning * slipping);
        let mut state = at(start, time);
        state.root.position.x += SPEED * slipping - 0.5 * slowing * slipping * slipping + speed * rolling;
        let turn = 0.5 * spinning * slipping * slipping + spin * rolling;
        state.root.orientation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), turn);
        state.root.linear_velocity.x = speed;
        state.root.angular_velocity.y = spin;
        state
    };
    times.iter().map(moved).collect()
}
