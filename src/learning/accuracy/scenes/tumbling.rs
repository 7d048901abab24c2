//! A free body without symmetry: Euler's equations I ω̇ = I ω × ω in the body frame, and q̇ = ½ q ω.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use serde_json::json;

use super::closed_form::{ClosedForm, at, body, moving, scenario};
use super::ode::followed;
use crate::accuracy::measure::Measure;
use crate::scenario::Scenario;
use gaitwright_physics::motion::RootMotion;
use gaitwright_physics::scene::Scene;
use gaitwright_physics::sim::State;

/// Principal moments of inertia, kg m².
const INERTIA: [f64; 3] = [0.01, 0.02, 0.03];
/// Angular velocity at the start, when the body frame is the world's, rad/s; mostly about the unstable axis.
const SPIN: [f64; 3] = [0.5, 5.0, 0.3];

pub(super) const SCENE: ClosedForm = ClosedForm {
    name: "tumbling",
    about: "a free body with three different moments of inertia turning about its unstable axis for three seconds",
    truth: "Euler's equations and the quaternion's, by Runge-Kutta with steps of 5e-5 s",
    measure: Measure::ROOT_ORIENTATION,
    scenario: document,
    solution,
};

fn document() -> Scenario {
    let [xx, yy, zz] = INERTIA;
    let body = body("body", &json!({ "mass": 1.0, "inertia": { "xx": xx, "yy": yy, "zz": zz } }));
    let scene = Scene { gravity: [0.0; 3], ground: None, ..Scene::default() };
    let root = RootMotion { angular_velocity: SPIN, ..moving([0.0; 3], [0.0; 3]) };
    scenario(body, scene, root, 3.072)
}

fn solution(start: &State, times: &[f64]) -> Vec<State> {
    let [x, y, z] = SPIN;
    let path = followed(rates, [1.0, 0.0, 0.0, 0.0, x, y, z], times);
    let turned = |(&time, [w, i, j, k, x, y, z]): (&f64, [f64; 7])| {
        let mut state = at(start, time);
        state.root.orientation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        state.root.angular_velocity = state.root.orientation * Vector3::new(x, y, z);
        state
    };
    times.iter().zip(path).map(turned).collect()
}

fn rates(&[w, i, j, k, x, y, z]: &[f64; 7]) -> [f64; 7] {
    let [a, b, c] = INERTIA;
    let turn = Quaternion::new(w, i, j, k) * Quaternion::new(0.0, 0.5 * x, 0.5 * y, 0.5 * z);
    [turn.w, turn.i, turn.j, turn.k, (b - c) * y * z / a, (c - a) * z * x / b, (a - b) * x * y / c]
}
