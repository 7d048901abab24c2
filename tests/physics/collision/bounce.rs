//! How contacts rebound.
//!
//! Free flight in semi-implicit steps keeps e = v² / 2 + g z − g h v / 2. A ball that comes at speed u within the
//! step in which it meets the ground, at height s ≤ h (u + g h) at the step's beginning, leaves it with
//! ε u at s + h ε u. So after a fall from H it has e / g = ε² H + (1 − ε²) s + ε (1 − ε) h u / 2, and the highest of its
//! positions lies between that and g h² / 8 above it.

use gaitwright_physics::scene::Scene;
use gaitwright_physics::sim::{Command, Simulator, State};

use super::{GRAVITY, body, obstacle, run, simulator};

const RADIUS: f64 = 0.1;
const DROP: f64 = 0.8;
const ROUNDING: f64 = 1e-9;
/// What the solver may leave of a velocity at its default tolerance of 1e-9, in a few rows together, m/s.
const SOLVER: f64 = 1e-8;

fn dropped(restitution: f64, step: f64, height: f64) -> Simulator {
    let model = body(&format!(r#"<sphere radius="{RADIUS}"/>"#));
    let mut state = State::new(&model);
    state.root.position.z = RADIUS + height;
    simulator(&model, &Scene { restitution, ..Scene::default() }, step, state)
}

fn height(simulator: &Simulator) -> f64 {
    simulator.state().root.position.z - RADIUS
}

/// Heights of the first `count` apexes after a bounce.
fn apexes(simulator: &mut Simulator, count: usize) -> Vec<f64> {
    let mut found = Vec::new();
    let mut rising = false;
    let mut last = height(simulator);
    for _ in 0..100_000 {
        simulator.step(Command::Passive).unwrap();
        let now = height(simulator);
        assert!(now > -ROUNDING, "{now} m below the ground");
        if rising && now <= last {
            found.push(last);
            if found.len() == count {
                return found;
            }
        }
        rising = now > last;
        last = now;
    }
    panic!("{} of {count} bounces", found.len())
}

#[test]
fn a_ball_rises_to_the_square_of_its_restitution_with_an_error_of_first_order() {
    for restitution in [0.25, 0.5, 0.9, 1.0] {
        for step in [0.004, 0.002, 0.001] {
            let apex = apexes(&mut dropped(restitution, step, DROP), 1)[0];
            let speed = (2.0 * GRAVITY * DROP).sqrt();
            let square: f64 = restitution * restitution;
            let above = apex - square * DROP;
            let bound = (1.0 - square) * step * (speed + GRAVITY * step)
                + restitution * (1.0 - restitution) * step * speed / 2.0
                + GRAVITY * step * step / 8.0;
            assert!(
                above > -ROUNDING && above < bound + ROUNDING,
                "{restitution} {step}: {above} of {bound} m"
            );
        }
    }
}

#[test]
fn an_elastic_ball_neither_gains_nor_loses_height() {
    let step = 0.002;
    for apex in apexes(&mut dropped(1.0, step, DROP), 20) {
        assert!((apex - DROP).abs() < GRAVITY * step * step / 8.0 + ROUNDING, "{apex} m");
    }
}

/// Without weight nothing keeps a slow collision from rebounding: there is no rest for it to disturb.
#[test]
fn without_weight_the_slowest_ball_rebounds() {
    for speed in [1.0, 0.05, 1e-4] {
        let model = body(&format!(r#"<sphere radius="{RADIUS}"/>"#));
        let mut state = State::new(&model);
        state.root.position.z = RADIUS + 0.01 * speed;
        state.root.linear_velocity.z = -speed;
        let scene = Scene { restitution: 0.5, gravity: [0.0; 3], ..Scene::default() };
        let mut simulator = simulator(&model, &scene, 0.002, state);
        run(&mut simulator, 0.1);
        let rising = simulator.state().root.linear_velocity.z;
        assert!((rising - 0.5 * speed).abs() < SOLVER, "{rising} m/s after {speed}");
    }
}

#[test]
fn without_restitution_a_ball_stays_where_it_lands() {
    let mut simulator = dropped(0.0, 0.002, DROP);
    run(&mut simulator, 0.5);
    for _ in 0..500 {
        simulator.step(Command::Passive).unwrap();
        assert!(height(&simulator).abs() < ROUNDING, "{} m", height(&simulator));
    }
}

/// The times of flight are a geometric series: the ball rests after √(2 H / g) (1 + ε) / (1 − ε). In each of n
/// bounces the step's error moves the speed by no more than g h / ε, which later bounces carry on, and the
/// time by h / ε and one step; after the last, slower than 4 g h, no more than 8 steps are left of the series.
#[test]
fn a_ball_comes_to_rest_when_the_series_of_its_bounces_ends() {
    let restitution: f64 = 0.5;
    let limit = (2.0 * DROP / GRAVITY).sqrt() * (1.0 + restitution) / (1.0 - restitution);
    for step in [0.002, 0.001] {
        let mut simulator = dropped(restitution, step, DROP);
        let mut moving = 0.0;
        while simulator.state().time < 2.0 * limit {
            simulator.step(Command::Passive).unwrap();
            if simulator.state().root.linear_velocity.norm() > SOLVER {
                moving = simulator.state().time;
            }
        }
        let speed = (2.0 * GRAVITY * DROP).sqrt();
        let bounces = ((speed / (4.0 * GRAVITY * step)).ln() / (1.0 / restitution).ln()).ceil();
        let bound = (11.0 * bounces + 16.0) * step;
        assert!((moving - limit).abs() < bound, "{moving} s instead of {limit}, bound {bound}");
        assert!(height(&simulator).abs() < ROUNDING);
    }
}

#[test]
fn what_rests_does_not_jitter_however_elastic() {
    let model = body(r#"<box size="0.2 0.2 0.2"/>"#);
    for (scene, ground) in [
        (Scene::default(), 0.0),
        (
            Scene {
                ground: None,
                obstacles: vec![obstacle(r#"{"kind": "box", "size": [1, 1, 0.5]}"#)],
                ..Scene::default()
            },
            0.25,
        ),
    ] {
        let mut state = State::new(&model);
        state.root.position.z = ground + 0.1;
        let mut simulator = simulator(&model, &Scene { restitution: 1.0, ..scene }, 0.002, state);
        for _ in 0..2000 {
            simulator.step(Command::Passive).unwrap();
            let root = simulator.state().root;
            assert!((root.position.z - ground - 0.1).abs() < ROUNDING, "{} m", root.position.z);
            assert!(root.linear_velocity.norm() < SOLVER, "{} m/s", root.linear_velocity.norm());
        }
    }
}
