//! A rigid pendulum released at rest: sin(θ/2) = k cd(ω₀ t, k) with k = sin(θ₀/2) and Jacobi's cd = cn / dn.
//!
//! ω₀² = m g l / (I + m l²) for the mass m at the distance l from the joint. From d cd(u)/du = −(1 − k²) sn / dn²
//! follows θ̇ = −2 k ω₀ (1 − k²) sn / (dn² cos(θ/2)).

use serde_json::json;

use super::closed_form::{ClosedForm, GRAVITY, at, free_space, moving, scenario};
use super::elliptic::Jacobi;
use crate::accuracy::measure::Measure;
use crate::scenario::{JointStart, Scenario};
use gaitwright_physics::sim::State;

/// Mass, kg.
const MASS: f64 = 1.0;
/// Distance of the centre of mass from the joint, m.
const LENGTH: f64 = 0.5;
/// Moment of inertia about the centre of mass, kg m².
const INERTIA: f64 = 0.01;
/// Initial angle, rad.
const RELEASED: f64 = 2.0;

pub(super) const SCENE: ClosedForm = ClosedForm {
    name: "pendulum",
    about: "a rigid pendulum released at rest 2 rad from hanging, for three seconds",
    truth: "sin(θ/2) = k cd(ω₀ t, k), k = sin(θ₀/2), with Jacobi's elliptic functions",
    measure: Measure::JOINT_ANGLE,
    scenario: document,
    solution,
};

fn document() -> Scenario {
    let character = json!({
        "format": "gaitwright/character@1",
        "name": "pendulum",
        "links": [
            { "name": "post", "mass": 1.0, "inertia": { "xx": 0.01, "yy": 0.01, "zz": 0.01 } },
            { "name": "bob", "mass": MASS, "center_of_mass": [0, 0, -LENGTH],
              "inertia": { "xx": INERTIA, "yy": INERTIA, "zz": INERTIA } }],
        "joints": [{ "name": "swing", "kind": "continuous", "parent": "post", "child": "bob", "axis": [0, 1, 0] }]
    });
    let mut scenario = scenario(character, free_space(), moving([0.0; 3], [0.0; 3]), 3.072);
    scenario.fixed_base = true;
    scenario.start.joints.insert("swing".to_owned(), JointStart { angle: Some(RELEASED), velocity: 0.0 });
    scenario
}

fn solution(start: &State, times: &[f64]) -> Vec<State> {
    let rate = (MASS * GRAVITY * LENGTH / (INERTIA + MASS * LENGTH * LENGTH)).sqrt();
    let k = (0.5 * RELEASED).sin();
    let swung = |&time: &f64| {
        let Jacobi { sn, cn, dn } = Jacobi::new(rate * time, k);
        let half = (k * cn / dn).asin();
        let mut state = at(start, time);
        state.angles[0] = 2.0 * half;
        state.velocities[0] = -2.0 * k * rate * (1.0 - k * k) * sn / (dn * dn * half.cos());
        state
    };
    times.iter().map(swung).collect()
}
