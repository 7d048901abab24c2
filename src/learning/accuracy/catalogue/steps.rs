//! The same pendulum and the same dropped block at steps from 1 µs to a thirtieth of a second.

use super::case::Case;
use super::contacts::dropped_block;
use super::quantity::Quantity;
use super::sketch::{GRAVITY, air, body, character, fixed_base, hinge, moving, rod, tuned};

/// Steps, s, and their names.
const STEPS: [(&str, f64); 6] =
    [("1e-6", 1e-6), ("1e-5", 1e-5), ("1e-4", 1e-4), ("1e-3", 1e-3), ("1e-2", 1e-2), ("1-30", 1.0 / 30.0)];

/// Finest step at which the block is dropped as well, s: ten seconds of contact in a million steps.
const FINEST_DROP: f64 = 1e-5;

/// The cases of step lengths.
pub fn cases() -> Vec<Case> {
    let own_step = |mut case: Case, step: f64| {
        case.scenario = tuned(case.scenario, |accuracy| accuracy.step = step);
        case.scenario.sample_every = step.max(0.04);
        case.at_its_own_step()
    };
    let mut cases = Vec::new();
    for (name, step) in STEPS {
        let links = [body("base", 1.0, [0.0; 3], [0.1; 3]), rod("bob", 1.0, 1.0)];
        let hinge = hinge("hinge", "base", "bob", [0.0; 3], [0.0, 1.0, 0.0]);
        let mut pendulum = fixed_base(character("pendulum", &links, &[hinge]), air());
        pendulum.start.joints = moving([("hinge", 2.0, 0.0)]);
        let available = GRAVITY * 0.5 * (1.0 - 2.0_f64.cos());
        // The energy of the first-order method oscillates by h/2 times the power of the weight.
        let power = GRAVITY * 0.5 * (3.0 * GRAVITY * (1.0 - 2.0_f64.cos())).sqrt();
        cases.push(own_step(
            Case::new(format!("step-{name}-swing"), format!("a pendulum at steps of {name} s"), pendulum)
                .at_most(0.01 * available + 0.5 * step * power, Quantity::EnergyGain)
                .at_most(0.01 * available + 0.5 * step * power, Quantity::EnergyChange),
            step,
        ));
        if step >= FINEST_DROP {
            let about = format!("a tilted block dropped from 1 m at steps of {name} s");
            cases.push(own_step(dropped_block(&format!("step-{name}-drop"), &about), step));
        }
    }
    cases
}
