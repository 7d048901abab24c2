//! Two rigid links hanging from each other: Lagrange's equations in the joint angles q₁, q₂.
//!
//! With the centres of mass at c₁, c₂ along the links and the second joint at l₁,
//!
//! M₁₁ = I₁ + m₁ c₁² + I₂ + m₂ (l₁² + c₂² + 2 l₁ c₂ cos q₂), M₁₂ = I₂ + m₂ (c₂² + l₁ c₂ cos q₂),
//! M₂₂ = I₂ + m₂ c₂², s = m₂ l₁ c₂ sin q₂,
//!
//! M q̈ = (s (2 q̇₁ q̇₂ + q̇₂²) − g₁, −s q̇₁² − g₂) with g₂ = m₂ g c₂ sin(q₁ + q₂) and
//! g₁ = (m₁ c₁ + m₂ l₁) g sin q₁ + g₂.

use serde_json::json;

use super::closed_form::{ClosedForm, GRAVITY, at, free_space, moving, scenario};
use super::ode::followed;
use crate::accuracy::measure::Measure;
use crate::scenario::{JointStart, Scenario};
use gaitwright_physics::sim::State;

/// Masses, kg.
const MASS: [f64; 2] = [1.0, 0.6];
/// Distances of the centres of mass from the joints, m.
const CENTER: [f64; 2] = [0.25, 0.2];
/// Distance between the joints, m.
const LENGTH: f64 = 0.5;
/// Moments of inertia about the centres of mass, kg m².
const INERTIA: [f64; 2] = [0.02, 0.01];
/// Initial joint angles, rad.
const RELEASED: [f64; 2] = [1.2, 0.8];

pub(super) const SCENE: ClosedForm = ClosedForm {
    name: "double-pendulum",
    about: "two links hanging from each other, released at rest far from hanging, for two seconds",
    truth: "Lagrange's equations of the two angles, by Runge-Kutta with steps of 5e-5 s",
    measure: Measure::JOINT_ANGLE,
    scenario: document,
    solution,
};

fn document() -> Scenario {
    let link = |name: &str, index: usize| {
        let inertia = INERTIA[index];
        json!({ "name": name, "mass": MASS[index], "center_of_mass": [0, 0, -CENTER[index]],
            "inertia": { "xx": inertia, "yy": inertia, "zz": inertia } })
    };
    let character = json!({
        "format": "gaitwright/character@1",
        "name": "double pendulum",
        "links": [{ "name": "post", "mass": 1.0, "inertia": { "xx": 0.01, "yy": 0.01, "zz": 0.01 } },
            link("upper", 0), link("lower", 1)],
        "joints": [
            { "name": "shoulder", "kind": "continuous", "parent": "post", "child": "upper", "axis": [0, 1, 0] },
            { "name": "elbow", "kind": "continuous", "parent": "upper", "child": "lower", "axis": [0, 1, 0],
              "origin": { "position": [0, 0, -LENGTH] } }]
    });
    let mut scenario = scenario(character, free_space(), moving([0.0; 3], [0.0; 3]), 2.048);
    scenario.fixed_base = true;
    for (name, angle) in ["shoulder", "elbow"].into_iter().zip(RELEASED) {
        scenario.start.joints.insert(name.to_owned(), JointStart { angle: Some(angle), velocity: 0.0 });
    }
    scenario
}

fn solution(start: &State, times: &[f64]) -> Vec<State> {
    let path = followed(rates, [RELEASED[0], RELEASED[1], 0.0, 0.0], times);
    let swung = |(&time, [q1, q2, v1, v2]): (&f64, [f64; 4])| {
        let mut state = at(start, time);
        state.angles.copy_from_slice(&[q1, q2]);
        state.velocities.copy_from_slice(&[v1, v2]);
        state
    };
    times.iter().zip(path).map(swung).collect()
}

fn rates(&[q1, q2, v1, v2]: &[f64; 4]) -> [f64; 4] {
    let ([m1, m2], [c1, c2], [i1, i2]) = (MASS, CENTER, INERTIA);
    let (sine, cosine) = q2.sin_cos();
    let m11 = i1 + m1 * c1 * c1 + i2 + m2 * (LENGTH * LENGTH + c2 * c2 + 2.0 * LENGTH * c2 * cosine);
    let m12 = i2 + m2 * (c2 * c2 + LENGTH * c2 * cosine);
    let m22 = i2 + m2 * c2 * c2;
    let s = m2 * LENGTH * c2 * sine;
    let g2 = m2 * GRAVITY * c2 * (q1 + q2).sin();
    let g1 = (m1 * c1 + m2 * LENGTH) * GRAVITY * q1.sin() + g2;
    let (f1, f2) = (s * (2.0 * v1 * v2 + v2 * v2) - g1, -s * v1 * v1 - g2);
    let determinant = m11 * m22 - m12 * m12;
    [v1, v2, (m22 * f1 - m12 * f2) / determinant, (m11 * f2 - m12 * f1) / determinant]
}
