//! Orders of convergence on smooth scenes, against motions integrated from other equations in other
//! coordinates.

use crate::bodies;
use crate::common;
mod control;
mod reference;

use std::sync::Arc;

use bodies::{Bar, Hanging};
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Feedforward, Gains, Integrator, Scene, SolverChoice};
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{Point3, UnitQuaternion, Vector3};
use reference::{Chain, GRAVITY};

/// Slopes log₂(error(h) / error(h/2)) that count as an order.
const ORDERS: [(Integrator, std::ops::Range<f64>); 2] =
    [(Integrator::SemiImplicitEuler, 0.8..1.3), (Integrator::MoreauJean, 1.8..2.3)];

const STEPS: [f64; 4] = [8e-3, 4e-3, 2e-3, 1e-3];

/// The same under error control, where a smooth motion of second order is extrapolated.
const EXTRAPOLATED_ORDER: std::ops::Range<f64> = 3.7..4.3;

const EXTRAPOLATED_STEPS: [f64; 2] = [16e-3, 8e-3];

/// A smooth motion whose end is known.
struct Smooth<'a> {
    name: &'a str,
    model: Arc<Model>,
    scene: Scene,
    gains: Option<Gains>,
    target: Option<&'a dyn Fn(f64) -> Vec<f64>>,
    start: State,
    seconds: f64,
    /// What is compared.
    measure: &'a dyn Fn(&State) -> Vec<f64>,
    /// What it is at the end.
    end: Vec<f64>,
}

impl Smooth<'_> {
    fn simulator(&self, accuracy: Accuracy) -> Simulator {
        let plan = common::plan(&self.model, &self.scene, &accuracy, self.gains.as_ref());
        Simulator::new(plan, self.start.clone())
    }

    fn advance(&self, simulator: &mut Simulator, index: usize) {
        let step = simulator.plan().step();
        let targets = self.target.map(|target| [index, index + 1].map(|index| target(index as f64 * step)));
        let command = match &targets {
            None => Command::Passive,
            Some([now, next]) => Command::Track { now, next },
        };
        simulator.step(command).unwrap_or_else(|failure| panic!("{}: {failure}", self.name));
    }

    /// Greatest difference at the end.
    fn error(&self, accuracy: Accuracy) -> f64 {
        self.end_error(&mut self.simulator(accuracy))
    }

    fn end_error(&self, simulator: &mut Simulator) -> f64 {
        for index in 0..(self.seconds / simulator.plan().step()).round() as usize {
            self.advance(simulator, index);
        }
        let found = (self.measure)(simulator.state());
        assert_eq!(found.len(), self.end.len());
        found.iter().zip(&self.end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    fn has_its_orders(&self) {
        for (integrator, order) in ORDERS {
            self.has_order(order, &STEPS, Accuracy { integrator, ..Accuracy::default() });
        }
    }

    /// With a tolerance that nothing exceeds, so that each step is taken as a whole and in halves.
    fn has_its_extrapolated_order(&self) {
        let integrator = Integrator::MoreauJean;
        let controlled = Accuracy { integrator, step_tolerance: Some(1.0), ..Accuracy::default() };
        self.has_order(EXTRAPOLATED_ORDER, &EXTRAPOLATED_STEPS, controlled);
    }

    fn has_order(&self, order: std::ops::Range<f64>, steps: &[f64], accuracy: Accuracy) {
        // What a solver leaves must not hide what a step adds.
        let solver = SolverChoice { iterations: 1000, tolerance: 1e-13, ..SolverChoice::default() };
        let error = |step: &f64| self.error(Accuracy { step: *step, solver, ..accuracy });
        let errors: Vec<f64> = steps.iter().map(error).collect();
        for pair in errors.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            assert!(order.contains(&slope), "{}, {accuracy:?}: {errors:?}", self.name);
        }
    }
}

fn joints(state: &State) -> Vec<f64> {
    state.angles.iter().chain(&state.velocities).copied().collect()
}

fn no_ground() -> Scene {
    Scene { ground: None, ..Scene::default() }
}

const BARS: [Bar; 3] = [
    Bar { mass: 1.0, center: 0.25, length: 0.5, inertia: 0.02 },
    Bar { mass: 0.7, center: 0.15, length: 0.4, inertia: 0.01 },
    Bar { mass: 0.5, center: 0.2, length: 0.4, inertia: 0.008 },
];

#[test]
fn passive_pendulums_of_two_and_three_bars() {
    for count in [1, 2, 3] {
        let bars = &BARS[..count];
        let model = bodies::chain(Hanging::Bolted, bars, "");
        let mut start = State::new(&model);
        start.angles.copy_from_slice(&[1.2, 0.5, -0.4][..count]);
        start.velocities.copy_from_slice(&[-1.0, 2.0, 1.0][..count]);
        let seconds = 0.48;
        let end =
            Chain::hanging(bars).swing(&start.angles, &start.velocities, seconds, |_, _, _| vec![0.0; count]);
        let scene = Smooth {
            name: "pendulum",
            model,
            scene: no_ground(),
            gains: None,
            target: None,
            start,
            seconds,
            measure: &joints,
            end,
        };
        scene.has_its_orders();
    }
}

/// Damped joints that follow a moving target, within torque limits that they do not reach.
#[test]
fn driven_bars_without_contact() {
    let (stiffness, damper, damping) = (30.0, 1.5, 0.1);
    let bars = &BARS[..2];
    let model = bodies::chain(Hanging::Bolted, bars, r#"<dynamics damping="0.1"/>"#);
    let target = |time: f64| vec![0.6 * (3.0 * time).sin(), -0.4 * (5.0 * time).sin()];
    let speed = |time: f64| [1.8 * (3.0 * time).cos(), -2.0 * (5.0 * time).cos()];
    let seconds = 0.8;
    let end = Chain::hanging(bars).swing(&[0.3, -0.2], &[0.0, 0.0], seconds, |time, angles, rates| {
        let (wanted, moving) = (target(time), speed(time));
        (0..2)
            .map(|joint| {
                stiffness * (wanted[joint] - angles[joint]) + damper * (moving[joint] - rates[joint])
                    - damping * rates[joint]
            })
            .collect()
    });
    let mut start = State::new(&model);
    start.angles.copy_from_slice(&[0.3, -0.2]);
    let gains = Gains {
        stiffness: vec![stiffness; 2],
        damping: vec![damper; 2],
        max_torque: vec![Some(1e3); 2],
        feedforward: Feedforward::None,
        ..Gains::default()
    };
    Smooth {
        name: "driven bars",
        model,
        scene: no_ground(),
        gains: Some(gains),
        target: Some(&target),
        start,
        seconds,
        measure: &joints,
        end,
    }
    .has_its_orders();
}

/// An asymmetric body thrown with a spin, whose origin is not its centre of mass.
#[test]
fn a_thrown_brick() {
    let principal = Vector3::new(0.01, 0.03, 0.035);
    let center = Vector3::new(0.1, -0.05, 0.2);
    let model = bodies::brick(principal.into(), center.into());
    let mut start = State::new(&model);
    let root = &mut start.root;
    root.position = Point3::new(1.0, 2.0, 3.0);
    root.orientation = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.0, 0.3));
    root.linear_velocity = Vector3::new(2.0, 0.5, 3.0);
    root.angular_velocity = Vector3::new(4.0, 3.0, -5.0);
    let seconds = 0.48;
    let (turned, spin) = reference::tumble(
        root.orientation,
        root.orientation.inverse() * root.angular_velocity,
        principal,
        seconds,
    );
    let arm = root.orientation * center;
    let thrown = root.linear_velocity + root.angular_velocity.cross(&arm);
    let fall = Vector3::new(0.0, 0.0, -0.5 * GRAVITY * seconds * seconds);
    let origin = root.position + arm + thrown * seconds + fall - turned * center;
    // Origin, the directions of two of its axes, and the angular velocity.
    let axes = |turned: UnitQuaternion<f64>| [turned * Vector3::x(), turned * Vector3::y()];
    let gather = move |origin: Point3<f64>, turned: UnitQuaternion<f64>, spin: Vector3<f64>| -> Vec<f64> {
        let [x, y] = axes(turned);
        [origin.coords, x, y, spin].iter().flat_map(|vector| vector.iter().copied()).collect()
    };
    let measure =
        |state: &State| gather(state.root.position, state.root.orientation, state.root.angular_velocity);
    let scene = Smooth {
        name: "brick",
        model,
        scene: no_ground(),
        gains: None,
        target: None,
        start,
        seconds,
        measure: &measure,
        end: gather(origin, turned, spin),
    };
    scene.has_its_orders();
    scene.has_its_extrapolated_order();
}

/// Two bars, hinged together and thrown.
#[test]
fn thrown_bars() {
    let bars = [BARS[0], BARS[1]];
    let [first, second] = bars;
    let model = bodies::chain(Hanging::Free, &bars, "");
    let (angles, rates, seconds) = ([0.7, -1.1], [3.0, -5.0], 0.48);
    let thrown = Vector3::new(1.0, 0.0, 2.0);
    let mut start = State::new(&model);
    start.root.orientation = UnitQuaternion::from_axis_angle(&-Vector3::y_axis(), angles[0]);
    start.root.angular_velocity = Vector3::new(0.0, -rates[0], 0.0);
    start.root.linear_velocity = thrown;
    start.angles[0] = angles[1];
    start.velocities[0] = rates[1];

    let along = |angle: f64| Vector3::new(angle.sin(), 0.0, -angle.cos());
    let across = |angle: f64| Vector3::new(angle.cos(), 0.0, angle.sin());
    let share = second.mass / (first.mass + second.mass);
    // From the root's origin to the common centre of mass, with `direction` of a bar's angle.
    let to_center = |angles: [f64; 2], direction: &dyn Fn(f64, usize) -> Vector3<f64>| {
        let one = direction(angles[0], 0);
        let other = direction(angles[0] + angles[1], 1);
        one * (first.center + share * (first.length - first.center)) + other * (share * second.center)
    };
    let at_start = to_center(angles, &|angle, _| along(angle));
    let absolute = [rates[0], rates[0] + rates[1]];
    let drift = thrown + to_center(angles, &|angle, bar| across(angle) * absolute[bar]);
    let swung = Chain::flying(&bars).swing(&angles, &rates, seconds, |_, _, _| vec![0.0; 2]);
    let fall = Vector3::new(0.0, 0.0, -0.5 * GRAVITY * seconds * seconds);
    let origin =
        at_start + drift * seconds + fall - to_center([swung[0], swung[1]], &|angle, _| along(angle));
    let down = along(swung[0]);
    let end = vec![origin.x, origin.z, down.x, down.z, swung[1], swung[2], swung[3]];
    let measure = |state: &State| {
        let down = state.root.orientation * -Vector3::z();
        let position = state.root.position;
        let spin = -state.root.angular_velocity.y;
        vec![position.x, position.z, down.x, down.z, state.angles[0], spin, state.velocities[0]]
    };
    let scene = Smooth {
        name: "thrown bars",
        model,
        scene: no_ground(),
        gains: None,
        target: None,
        start,
        seconds,
        measure: &measure,
        end,
    };
    scene.has_its_orders();
    scene.has_its_extrapolated_order();
}

/// A cart that slides on four corners while a bar swings from it and loads and unloads its contacts.
#[test]
fn a_sliding_cart_with_a_swinging_bar() {
    let (mass, half, friction) = (5.0, [0.3, 0.3, 0.05], 0.3);
    let bar = BARS[0];
    let model = bodies::chain(Hanging::Cart(mass, half), &[bar], "");
    let mut start = State::new(&model);
    start.root.position.z = half[2];
    start.root.linear_velocity.x = 3.0;
    start.angles[0] = 1.0;
    let seconds = 0.48;
    let end = reference::slide(mass, bar, friction, [0.0, 1.0, 3.0, 0.0], seconds);
    let measure = |state: &State| {
        let root = &state.root;
        vec![root.position.x, state.angles[0], root.linear_velocity.x, state.velocities[0]]
    };
    Smooth {
        name: "sliding cart",
        model,
        scene: Scene { friction, ..Scene::default() },
        gains: None,
        target: None,
        start,
        seconds,
        measure: &measure,
        end,
    }
    .has_its_orders();
}
