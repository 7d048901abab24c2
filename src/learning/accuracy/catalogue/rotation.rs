//! Bodies that turn: tumbling, spinning, precessing.

use super::case::Case;
use super::quantity::Quantity;
use super::sketch::{
    GRAVITY, air, body, character, fixed_base, hinge, moving, scenario, second_order, space, turning,
};
use crate::scenario::Scenario;

const Z: [f64; 3] = [0.0, 0.0, 1.0];
/// Share of the angular momentum that may be lost: rounding in each of some 10⁵ steps, in one direction all the while, is 10⁻¹¹ of it;
/// a thousand times that for what is lost of nearly equal numbers.
const KEPT: f64 = 1e-8;

/// The cases of rotation.
pub fn cases() -> Vec<Case> {
    vec![tumbling(), spinning("spin-1e3", 0.0), spinning("spin-1e3-unbalanced", 0.02), precessing()]
}

/// A body of 1, 2 and 3 kg m² about the axis of the middle moment, which is unstable: it flips over
/// periodically. Energy and angular momentum are conserved.
fn tumbling() -> Case {
    let spin: f64 = 5.0;
    let mut scenario =
        scenario(character("tumbler", &[body("body", 1.0, [0.0; 3], [1.0, 2.0, 3.0])], &[]), space());
    scenario.start.root = Some(turning([0.0; 3], [0.01, spin, 0.01]));
    scenario.duration = 100.0;
    scenario.sample_every = 0.08;
    Case::new("tumbling", "a free body tumbles about its middle axis for 100 s", second_order(scenario))
        .at_most(0.01 * spin * spin, Quantity::EnergyChange)
        .at_most(KEPT * 2.0 * spin, Quantity::AngularMomentumChange)
}

/// A flywheel at 1000 rad/s on a free rotating body; the flywheel's centre of mass is `offset` m off its axis.
fn spinning(name: &str, offset: f64) -> Case {
    let (speed, across, mass) = (1e3, 2e-4, 0.1);
    let links = [
        body("body", 1.0, [0.0; 3], [0.1; 3]),
        body("wheel", mass, [offset, 0.0, 0.0], [1e-4, 1e-4, across]),
    ];
    let mut scenario =
        scenario(character("flywheel", &links, &[hinge("axle", "body", "wheel", [0.0; 3], Z)]), space());
    scenario.start.root = Some(turning([0.0; 3], [0.0, 0.1, 0.0]));
    scenario.start.joints = moving([("axle", 0.0, speed)]);
    let inertia = across + mass * offset * offset;
    let about = if offset > 0.0 { "an unbalanced" } else { "a balanced" };
    Case::new(name, format!("a free body with {about} flywheel at 1000 rad/s"), scenario)
        .at_most(0.05 * 0.5 * inertia * speed * speed, Quantity::EnergyGain)
        .at_most(KEPT * inertia * speed, Quantity::AngularMomentumChange)
        .at_most(1.5 * speed, Quantity::JointSpeed { after: 0.0 })
}

/// A fast top with a level axis: gravity makes it precess at m g r / (I ω); its nutation is small.
fn precessing() -> Case {
    let (mass, arm, along, across, spin) = (0.1, 0.1, 2e-4, 1e-4, 1e3);
    let ring = |name: &str| body(name, 1e-3, [0.0; 3], [1e-6; 3]);
    let links = [
        body("stand", 1.0, [0.0; 3], [0.1; 3]),
        ring("fork"),
        ring("ring"),
        body("wheel", mass, [0.0; 3], [along, across, across]),
    ];
    let joints = [
        hinge("turn", "stand", "fork", [0.0; 3], Z),
        hinge("nod", "fork", "ring", [0.0; 3], [0.0, 1.0, 0.0]),
        hinge("spin", "ring", "wheel", [arm, 0.0, 0.0], [1.0, 0.0, 0.0]),
    ];
    let mut scenario: Scenario = fixed_base(character("top", &links, &joints), air());
    let rate = mass * GRAVITY * arm / (along * spin);
    // Gravity turns the spin (along x) towards y: the torque m g r about +y.
    scenario.start.joints = moving([("turn", 0.0, rate), ("nod", 0.0, 0.0), ("spin", 0.0, spin)]);
    let transverse = across + mass * arm * arm;
    let nod = 2.0 * transverse * mass * GRAVITY * arm / (along * spin).powi(2);
    let wanted = rate * scenario.duration;
    Case::new("gyroscope", "a level top at 1000 rad/s goes round without sinking", scenario)
        .at_most(2.0 * nod, Quantity::FinalAngle { joint: "nod".into(), wanted: 0.0 })
        .at_most(0.02 * wanted, Quantity::FinalAngle { joint: "turn".into(), wanted })
        .at_most(0.05 * mass * GRAVITY * arm, Quantity::EnergyGain)
}
