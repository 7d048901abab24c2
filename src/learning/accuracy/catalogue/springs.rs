//! Springs from soft to far stiffer than a step can resolve, without damping and critically damped, and a
//! damper that stops everything.

use super::case::Case;
use super::quantity::Quantity;
use super::sketch::{GRAVITY, air, body, character, fixed_base, hinge, hold, moving, rod};
use crate::scenario::Scenario;
use gaitwright_physics::scene::MaxTorque;

/// Share of the energy that can be released which a simulation may gain by its numerical errors.
const GAIN: f64 = 0.01;

/// Angles from which the two joints start, rad.
const START: [(&str, f64); 2] = [("upper", 0.3), ("lower", -0.3)];

/// Inertia of both rods, straight, about the upper joint, kg m².
const INERTIA: f64 = 4.0 / 3.0;

/// The cases of springs.
pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for exponent in 2..=9 {
        let stiffness = 10.0_f64.powi(exponent);
        let stored: f64 = START.iter().map(|(_, angle)| 0.5 * stiffness * angle * angle).sum();
        // Each rod's centre starts less than 0.05 m above its lowest position.
        let available = stored + 2.0 * GRAVITY * 0.05;
        cases.push(
            Case::new(
                format!("spring-1e{exponent}"),
                format!("two rods on springs of 1e{exponent} N m/rad, undamped"),
                pulled(stiffness, 0.0, 0.0),
            )
            .at_most(GAIN * available, Quantity::EnergyGain),
        );
        let damping = 2.0 * (stiffness * INERTIA).sqrt();
        let settled = |joint: &str| Quantity::FinalAngle { joint: joint.into(), wanted: 0.0 };
        cases.push(
            Case::new(
                format!("spring-1e{exponent}-critical"),
                format!("two rods on springs of 1e{exponent} N m/rad, critically damped"),
                pulled(stiffness, damping, 0.0),
            )
            .at_most(GAIN * available, Quantity::EnergyGain)
            .at_most(1e-6, settled("upper"))
            .at_most(1e-6, settled("lower"))
            .at_most(1e-6, Quantity::JointSpeed { after: 9.0 }),
        );
    }
    // Under a moment of the weight of at most about 10 N m.
    let creep = 10.0 / 1e9;
    cases.push(
        Case::new(
            "damper-1e9",
            "two rods at 5 rad/s against dampers of 1e9 N m s/rad",
            pulled(0.0, 1e9, 5.0),
        )
        .at_most(2.0 * creep, Quantity::JointSpeed { after: 0.1 })
        .at_most(GAIN * 0.5 * INERTIA * 25.0, Quantity::EnergyGain),
    );
    cases
}

/// Two rods of 1 kg and 0.5 m, one below the other, off their targets at 0 and moving apart at `speed` rad/s.
fn pulled(stiffness: f64, damping: f64, speed: f64) -> Scenario {
    let links = [body("base", 1.0, [0.0; 3], [0.1; 3]), rod("arm", 1.0, 0.5), rod("hand", 1.0, 0.5)];
    let axis = [0.0, 1.0, 0.0];
    let joints = [
        hinge("upper", "base", "arm", [0.0; 3], axis),
        hinge("lower", "arm", "hand", [0.0, 0.0, -0.5], axis),
    ];
    let mut scenario = fixed_base(character("rods", &links, &joints), air());
    scenario.start.joints = moving(START.map(|(name, angle)| (name, angle, speed * angle.signum())));
    scenario.drive = hold(stiffness, damping, MaxTorque::Unlimited, START.map(|(name, _)| (name, 0.0)));
    scenario
}
