//! What a reward is made of, measured in the simulator, against closed forms.

use std::sync::Arc;

use gaitwright_learning::learn::evaluation::{SimulatedWorld, World};
use gaitwright_learning::learn::{Learning, Stop, Terms};
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::sim::State;
use gaitwright_physics::stance::Stance;
use nalgebra::Vector3;

use super::parameters;
use crate::bodies::{Bar, Hanging, chain, cube};

const GRAVITY: f64 = 9.81;

/// What `model` does in so many steps from its standing pose as `change` makes it, with the targets over time (s), and where it then is.
fn tracked(
    model: &Arc<Model>,
    change: impl Fn(&mut State),
    targets: impl Fn(f64) -> f64,
    steps: u64,
) -> (Terms, State) {
    let scene = Scene::default();
    let stance = Stance::find(model, &scene);
    let parameters = parameters(&Learning::default(), &stance);
    let around = (&scene, &Accuracy::default(), [1.0, 0.0, 0.0]);
    let mut world = SimulatedWorld::new(model, &stance, around, None, &parameters).unwrap();
    let mut state = world.standing().clone();
    change(&mut state);
    let targets = |time: f64, angles: &mut [f64]| angles.fill(targets(time));
    let outcome = world.track(&state, &targets, 0..steps, &Stop::default()).unwrap();
    (outcome.terms, outcome.after.unwrap())
}

/// A weight that falls is stopped by a push of m v beside its weight: the excess over the weight, over the weight, is v / g, and so the
/// time that the fall takes.
#[test]
fn an_impact_is_what_stops_the_fall() {
    let height: f64 = 0.05;
    let step = Accuracy::default().step;
    let (terms, _) = tracked(&cube(), |state| state.root.position.z += height, |_| 0.0, 200);
    let fall = (2.0 * height / GRAVITY).sqrt();
    // It lands up to a step late or early, and by a step faster than it touches.
    assert!((terms.impact - fall).abs() < 2.0 * step, "{} s instead of {fall}", terms.impact);
    let (standing, _) = tracked(&cube(), |_| {}, |_| 0.0, 200);
    assert!(standing.impact < 0.1 * step && standing.sway < 1e-6, "{standing:?}");
}

/// In flight a cube keeps turning as it does about any axis.
#[test]
fn turn_and_sway_are_the_ways_about_the_vertical_and_about_horizontal_axes() {
    let spun = |axis: Vector3<f64>| {
        let change = |state: &mut State| {
            state.root.position.z += 1.0;
            state.root.angular_velocity = 0.5 * axis;
        };
        let (Terms { turn, sway, .. }, _) = tracked(&cube(), change, |_| 0.0, 50);
        [turn, sway]
    };
    let way = 0.5 * 50.0 * Accuracy::default().step;
    for (axis, expected) in [
        (Vector3::z(), [way, 0.0]),
        (-Vector3::z(), [-way, 0.0]),
        (Vector3::x(), [0.0, way]),
        (-Vector3::y(), [0.0, way]),
    ] {
        for (found, expected) in spun(axis).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "about {axis}: {found} instead of {expected}");
        }
    }
}

/// A bar that is lifted slowly takes a torque of m g c sin θ, which only grows.
#[test]
fn the_torque_of_a_slow_lift_varies_by_what_it_comes_to() {
    let bar = Bar { mass: 1.5, center: 0.4, length: 0.8, inertia: 0.08 };
    let model = chain(Hanging::Bolted, &[bar], "");
    let seconds = 8.0;
    // As slow at its ends as cos is.
    let lift = |time: f64| 0.35 * (1.0 - (std::f64::consts::PI * time / seconds).cos());
    let steps = (seconds / Accuracy::default().step) as u64;
    let (terms, after) = tracked(&model, |_| {}, lift, steps);
    let Stance { root_height, gains, .. } = Stance::find(&model, &Scene::default());
    let held = bar.mass * GRAVITY * bar.center * after.angles[0].sin();
    // In the end the spring holds the bar.
    let spring = gains.stiffness[0] * (lift(seconds) - after.angles[0]);
    assert!((spring / held - 1.0).abs() < 0.02, "{spring} N m for {held}");
    // Its root hangs at no height: torques are related to a tenth of the distance of the bar's mass from the joint.
    assert!(root_height < 0.01);
    // About the centre of mass half the trace of its inertia, which is i, i and 0.2 i.
    let size = (bar.center * bar.center + 1.1 * bar.inertia / bar.mass).sqrt();
    let expected = held / (bar.mass * GRAVITY * 0.1 * size);
    // Beside that, what accelerates it is (m c² + i) θ̈ at either end, at most 0.32 · 0.054 N m: 1.4 % of 2.5 N m.
    let share = terms.torque_variation / expected;
    assert!((share - 1.0).abs() < 0.02, "{share}");
}
