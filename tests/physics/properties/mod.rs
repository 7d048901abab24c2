//! Random characters in random scenes at random settings: what must hold whatever is simulated.
//!
//! Every case is made from its number alone. `CASES=n` runs n cases of every kind instead of the usual
//! number, `CASE=n` the n-th alone.

mod check;
mod draw;

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Coordinates, Effect, Ground, Scene, Switch};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::common;
use check::Broken;
use draw::Drawing;

/// Cases of each kind.
const CASES: u64 = 400;

/// Draws the cases of a kind, checks each, and fails with all that are broken.
fn all_hold(
    kind: u64,
    draw: impl Fn(&mut ChaCha8Rng) -> Drawing + Sync,
    check: impl Fn(&Drawing) -> Result<(), String> + Sync,
) {
    let cases: Vec<u64> = match common::number("CASE") {
        Some(case) => vec![case],
        None => (0..common::number("CASES").unwrap_or(CASES)).collect(),
    };
    let broken = common::in_parallel(&cases, |case| {
        let drawing = draw(&mut ChaCha8Rng::seed_from_u64((kind << 32) | case));
        check(&drawing).err().map(|reason| format!("CASE={case}: {reason} [{drawing}]"))
    });
    let broken: Vec<String> = broken.into_iter().flatten().collect();
    assert!(broken.is_empty(), "{} cases:\n{}", broken.len(), broken.join("\n"));
}

/// Greatest error of a step where the drawn step is too coarse for what was drawn, rad or m.
///
/// An error e in the angle that a step of h ends with is one of e / h in the rate. Should those of all 120 steps add up, then rates of 5 rad/s
/// (up to 10 are drawn) keep their energy to 5 % if 120 e / h is at most 2.5 % of them: at 8 ms, if e is at most 8e-6 rad.
const TOLERANCE: f64 = 8e-6;

/// Every bound holds, and a second run ends in the same bits. A step that is too coarse for what was drawn may
/// break a bound on accuracy, but then the same case holds it when the step's error is controlled.
fn bounds_hold_twice(drawing: &Drawing) -> Result<(), String> {
    let plan = drawing.plan();
    let end = match check::run(drawing, &plan) {
        Ok(end) => end,
        Err(Broken::Accuracy(coarse)) => {
            let accuracy = Accuracy { step_tolerance: Some(TOLERANCE), ..drawing.accuracy };
            let finely = Drawing { accuracy, ..drawing.clone() };
            let fine = check::run(&finely, &finely.plan());
            return fine.map(|_| ()).map_err(|broken| format!("{broken}, and with its step alone {coarse}"));
        }
        Err(broken) => return Err(broken.to_string()),
    };
    let again = check::end(drawing, &plan)?;
    if end == again { Ok(()) } else { Err("the second run ended elsewhere".into()) }
}

#[test]
fn characters_that_fly() {
    all_hold(1, draw::flying, bounds_hold_twice);
}

#[test]
fn characters_that_fall_and_lie() {
    all_hold(2, draw::falling, bounds_hold_twice);
}

#[test]
fn characters_that_are_driven() {
    all_hold(3, draw::driven, bounds_hold_twice);
}

#[test]
fn characters_that_bounce() {
    all_hold(5, draw::bouncing, bounds_hold_twice);
}

#[test]
fn characters_with_motors() {
    all_hold(6, draw::motorised, bounds_hold_twice);
}

/// The drawing with everything idle in it: limits and torque limits far off, no damping, no dry friction.
fn idle(mut drawing: Drawing) -> Drawing {
    let mut model = Model::clone(&drawing.model);
    model.limits.fill(Some([-1e6, 1e6]));
    model.damping.fill(0.0);
    model.friction.fill(0.0);
    drawing.model = Arc::new(model);
    if let Some(gains) = &mut drawing.gains {
        gains.max_torque.fill(Some(1e30));
    }
    drawing
}

#[test]
fn effects_that_never_act_change_no_bit() {
    let effects = [
        Effect::GroundContact,
        Effect::Friction,
        Effect::JointLimits,
        Effect::TorqueLimits,
        Effect::JointDamping,
        Effect::JointFriction,
        Effect::Stabilization,
    ];
    let draw = |rng: &mut ChaCha8Rng| {
        let drawing = if rng.random_bool(0.5) { draw::flying(rng) } else { draw::driven(rng) };
        let ground = Some(Ground::Plane { height: -1e4 });
        // In maximal coordinates a motor with a limit always has a row of its own, which rounds differently.
        let accuracy = Accuracy { coordinates: Coordinates::Reduced, ..drawing.accuracy };
        idle(Drawing { accuracy, scene: Scene { ground, ..drawing.scene.clone() }, ..drawing })
    };
    all_hold(4, draw, |drawing| {
        // The end, or how the simulation fails: a chain may whip too fast to be followed, with the effects as without.
        let with = |switch: Switch| {
            let mut scene = drawing.scene.clone();
            scene.effects.extend(effects.map(|effect| (effect, switch)));
            let drawing = Drawing { scene, ..drawing.clone() };
            check::end(&drawing, &drawing.plan())
        };
        if with(Switch::On) == with(Switch::Off) { Ok(()) } else { Err("the ends differ".into()) }
    });
}
