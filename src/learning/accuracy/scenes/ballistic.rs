//! A ball thrown in empty space: x = x₀ + v₀ t + ½ g t².

use nalgebra::Vector3;
use serde_json::json;

use super::closed_form::{ClosedForm, GRAVITY, at, body, free_space, moving, scenario};
use crate::accuracy::measure::Measure;
use crate::scenario::Scenario;
use gaitwright_physics::sim::State;

pub(super) const SCENE: ClosedForm = ClosedForm {
    name: "ballistic",
    about: "a ball thrown forward and up in empty space for a second",
    truth: "x = x₀ + v₀ t + ½ g t²",
    measure: Measure::ROOT_POSITION,
    scenario: document,
    solution,
};

fn document() -> Scenario {
    let ball = body("ball", &json!({ "density": 1000, "shapes": [{ "kind": "sphere", "radius": 0.05 }] }));
    scenario(ball, free_space(), moving([0.0, 0.0, 1.0], [3.0, 0.5, 4.0]), 1.024)
}

fn solution(start: &State, times: &[f64]) -> Vec<State> {
    let gravity = Vector3::new(0.0, 0.0, -GRAVITY);
    let flown = |&time: &f64| {
        let mut state = at(start, time);
        state.root.position += start.root.linear_velocity * time + gravity * (0.5 * time * time);
        state.root.linear_velocity += gravity * time;
        state
    };
    times.iter().map(flown).collect()
}
