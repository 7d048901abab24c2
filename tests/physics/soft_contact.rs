//! Soft contacts, critically damped springs that push with whatever force their motion takes: against closed forms, MuJoCo's
//! numbers, and rigid contacts as their limit.

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Coordinates, Effect, Scene, StepPlan};
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{UnitQuaternion, Vector3};

use crate::bodies::{ball, cube, urdf};
use crate::common;

const GRAVITY: f64 = 9.81;
/// Time constant, s.
const T: f64 = 0.02;
const ROUNDING: f64 = 1e-9;

fn soft(friction: f64) -> Scene {
    Scene { contact_time_constant: T, friction, ..Scene::default() }
}

fn simulator(model: &Arc<Model>, scene: &Scene, accuracy: Accuracy, state: State) -> Simulator {
    Simulator::new(common::plan(model, scene, &accuracy, None), state)
}

fn at_step(step: f64) -> Accuracy {
    Accuracy { step, ..Accuracy::default() }
}

/// Height of the centre of [`ball`] that lies on the ground, m.
fn radius(model: &Arc<Model>) -> f64 {
    let mut simulator = resting(model);
    for _ in 0..1000 {
        simulator.step(Command::Passive).unwrap();
    }
    simulator.state().root.position.z
}

/// A body that falls onto rigid ground from a little above.
fn resting(model: &Arc<Model>) -> Simulator {
    let mut start = State::new(model);
    start.root.position.z = 0.5;
    simulator(model, &Scene::default(), at_step(0.002), start)
}

/// A ball that arrives at u has the gap −u t e^(−t/T), and in steps of implicit Euler −u n h / (1 + h/T)^(n+1) after n of them: gravity
/// does not matter as long as the spring need not pull, u e⁻³ < g T.
#[test]
fn a_ball_sinks_in_and_rises_as_a_critically_damped_spring_does() {
    let model = ball();
    let radius = radius(&model);
    for speed in [0.3_f64, 1.0, 3.0] {
        assert!(speed * (-3.0_f64).exp() < GRAVITY * T);
        for step in [0.004, 0.001, 0.00025] {
            let mut start = State::new(&model);
            start.root.position.z = radius;
            start.root.linear_velocity.z = -speed;
            let mut simulator = simulator(&model, &soft(0.5), at_step(step), start);
            let mut worst: f64 = 0.0;
            for n in 1..=(0.2 / step).round() as i32 {
                simulator.step(Command::Passive).unwrap();
                let gap = simulator.state().root.position.z - radius;
                let (n, t) = (f64::from(n), f64::from(n) * step);
                let exact = -speed * n * step * (1.0 + step / T).powf(-n - 1.0);
                assert!((gap - exact).abs() < ROUNDING, "{speed} m/s, {step} s: {gap} m, not {exact}");
                worst = worst.max((gap + speed * t * (-t / T).exp()).abs());
            }
            // The greatest difference of the two closed forms is below u h.
            assert!(worst < speed * step, "{worst} m");
        }
    }
}

/// A ball that meets the ground within a step sinks in as from the moment of that. In a step of flight it errs by g h² / 2 and at the
/// moment by no more than a step of the spring's greatest acceleration, 2 u / T: all in all first order.
#[test]
fn a_ball_that_lands_within_a_step_is_caught_from_the_touch_down_on() {
    let model = ball();
    let radius = radius(&model);
    let speed: f64 = 1.0;
    for step in [0.004, 0.001, 0.00025] {
        for part in [0.1, 0.5, 0.9] {
            let mut start = State::new(&model);
            // It closes the gap in a part of the third step.
            let flight = (2.0 + part) * step;
            start.root.position.z = radius + speed * flight;
            start.root.linear_velocity.z = -speed;
            let mut scene = soft(0.5);
            scene.gravity = [0.0; 3];
            let mut simulator = simulator(&model, &scene, at_step(step), start);
            // Without weight the spring lets go at 2 T.
            for n in 1..=((2.0 * T) / step).round() as i32 {
                simulator.step(Command::Passive).unwrap();
                let gap = simulator.state().root.position.z - radius;
                let t = f64::from(n) * step - flight;
                let exact = if t < 0.0 { -speed * t } else { -speed * t * (-t / T).exp() };
                let bound = 2.0 * speed / T * step * step + speed * step;
                assert!((gap - exact).abs() < bound, "{step} {part}: {gap} m, not {exact}");
            }
        }
    }
}

/// A character that tumbles onto soft ground gains no energy but for a hundredth of what it falls with, whatever the step, and comes to
/// rest.
#[test]
fn what_falls_on_soft_ground_gains_no_energy() {
    let model = common::example("quadruped.urdf");
    for step in [0.004, 0.002, 0.0005] {
        let mut start = State::new(&model);
        start.root.position.z = 0.6;
        start.root.orientation = UnitQuaternion::from_euler_angles(0.4, 0.3, 0.0);
        let mut simulator = simulator(&model, &soft(0.7), at_step(step), start);
        let energy = |simulator: &Simulator| simulator.energy().kinetic + simulator.energy().potential;
        let whole = energy(&simulator);
        let fallen = whole - model.mass * GRAVITY * 0.3;
        for _ in 0..(1.5 / step).round() as usize {
            simulator.step(Command::Passive).unwrap();
            assert!(energy(&simulator) < whole + 0.01 * model.mass * GRAVITY * 0.6, "{step} s");
        }
        assert!(energy(&simulator) < fallen, "{step} s: it lost nothing");
        assert!(simulator.energy().kinetic < 0.05, "{} J", simulator.energy().kinetic);
    }
}

/// A tip at the end of a rod of 1 kg: MuJoCo 4.0 with `solref` T / 0.99999, `solimp` 0.99999 throughout, elliptic cones and steps of 10 µs.
/// Each row: t, then x, z and pitch of the rod; s, m, rad.
const SMOOTH: [[f64; 4]; 4] = [
    [0.005, 0.0002500, 0.1194328, -0.0004452],
    [0.01, 0.0005000, 0.1187197, -0.0016855],
    [0.02, 0.0010000, 0.1168052, -0.0061468],
    [0.04, 0.0020000, 0.1108374, -0.0215161],
];
const STICKING: [[f64; 4]; 4] = [
    [0.005, 0.0001501, 0.1194556, -0.0003881],
    [0.01, 0.0001387, 0.1188021, -0.0014794],
    [0.02, -0.0002180, 0.1170825, -0.0054540],
    [0.04, -0.0017808, 0.1116941, -0.0193816],
];

/// Greatest differences from `wanted` at this step: of positions, m, and of the angle, rad.
fn apart(friction: f64, wanted: &[[f64; 4]], step: f64) -> [f64; 2] {
    let model = urdf(
        r#"<robot name="rod"><link name="rod"><inertial><mass value="1"/>
        <inertia ixx="0.05" ixy="0" ixz="0" iyy="0.05" iyz="0" izz="0.05"/></inertial>
        <collision><origin xyz="0.4 0 -0.1"/><geometry><sphere radius="0.02"/></geometry></collision>
        </link></robot>"#,
        false,
    );
    let mut start = State::new(&model);
    start.root.position.z = 0.12;
    start.root.linear_velocity = Vector3::new(0.05, 0.0, -0.1);
    let mut simulator = simulator(&model, &soft(friction), at_step(step), start);
    let mut apart = [0.0_f64; 2];
    for [time, x, z, pitch] in wanted {
        while simulator.state().time < time - 0.5 * step {
            simulator.step(Command::Passive).unwrap();
        }
        let root = &simulator.state().root;
        let along = (root.position.x - x).abs().max((root.position.z - z).abs());
        let turned = (root.orientation.scaled_axis().y - pitch).abs();
        apart = [apart[0].max(along), apart[1].max(turned)];
    }
    apart
}

const POINT: f64 = 1.4e-5;

/// The scheme errs by what moves in a step, at up to 0.4 m/s and 1 rad/s. MuJoCo's force acts half as deep as the ball sinks in, at
/// most 0.7 mm / 2 from ours, where 1 rad/s is another 0.35 mm/s of slip for 40 ms: 14 µm.
#[test]
fn a_rods_tip_moves_as_in_mujoco() {
    for (friction, wanted) in [(0.0, SMOOTH), (100.0, STICKING)] {
        let mut before = [f64::INFINITY; 2];
        for step in [4e-4, 2e-4, 1e-4] {
            let now = apart(friction, &wanted, step);
            assert!(
                now[0] < 0.4 * step + POINT && now[1] < step + POINT,
                "friction {friction}, {step} s: {now:?}"
            );
            // First order: half the step, half the error, but for that.
            for (now, before) in now.iter().zip(before) {
                assert!(*now < 0.6 * before + POINT, "friction {friction}, {step} s: {now} after {before}");
            }
            before = now;
        }
    }
}

/// On a slope that friction can hold a cube stays, and does not creep as on springs along the ground.
#[test]
fn a_cube_rests_on_a_slope() {
    let model = cube();
    let slope: f64 = 0.4;
    let mut scene = soft(0.6);
    scene.gravity = [GRAVITY * slope.sin(), 0.0, -GRAVITY * slope.cos()];
    assert!(slope.tan() < 0.6);
    let mut start = State::new(&model);
    start.root.position.z = radius(&model);
    let mut simulator = simulator(&model, &scene, at_step(0.002), start);
    for _ in 0..1000 {
        simulator.step(Command::Passive).unwrap();
    }
    let root = &simulator.state().root;
    assert!(root.position.x.abs() < 1e-6 && root.linear_velocity.norm() < 1e-8, "{root:?}");
    assert!((root.position.z - radius(&model)).abs() < 1e-6, "{root:?}");
}

/// With a time constant T that vanishes beside the step h the velocity asked for, (n · v − h g / T²) / (1 + h / T)², is −g / h: that of
/// rigid contacts, but that these do not correct a penetration by themselves.
#[test]
fn contacts_of_a_vanishing_time_constant_are_rigid() {
    let model = common::example("quadruped.urdf");
    let play = |time_constant: f64| {
        let mut start = State::new(&model);
        start.root.position.z = 0.45;
        let scene =
            Scene { contact_time_constant: time_constant, ..common::without(&[Effect::Stabilization]) };
        let mut simulator = simulator(&model, &scene, at_step(0.002), start);
        for _ in 0..75 {
            simulator.step(Command::Passive).unwrap();
        }
        simulator.state().root.position
    };
    let (rigid, soft) = (play(0.0), play(1e-9));
    assert!((rigid - soft).norm() < 1e-4, "{rigid} and {soft}");
}

/// One step from the same state gives the same velocities in both coordinate systems.
#[test]
fn both_coordinate_systems_agree() {
    let model = cube();
    let radius = radius(&model);
    let step = |coordinates: Coordinates| {
        let mut start = State::new(&model);
        start.root.position.z = radius - 0.003;
        start.root.orientation = UnitQuaternion::from_euler_angles(0.02, 0.01, 0.3);
        start.root.linear_velocity = Vector3::new(0.4, -0.2, -0.5);
        let accuracy = Accuracy { coordinates, ..at_step(0.001) };
        let mut simulator = simulator(&model, &soft(0.5), accuracy, start);
        simulator.step(Command::Passive).unwrap();
        simulator.state().root
    };
    let (reduced, maximal) = (step(Coordinates::Reduced), step(Coordinates::Maximal));
    assert!((reduced.linear_velocity - maximal.linear_velocity).norm() < 1e-8);
    assert!((reduced.angular_velocity - maximal.angular_velocity).norm() < 1e-7);
}

#[test]
fn soft_contacts_do_not_rebound_and_say_what_they_are() {
    let scene = Scene { restitution: 0.9, ..soft(0.5) };
    let plan = StepPlan::compile(&scene, &Accuracy::default(), None, &ball()).unwrap();
    assert_eq!((plan.restitution, plan.contact_time_constant), (None, Some(T)));
    let because = &plan.decisions[&Effect::GroundContact].because;
    assert!(because.ends_with("; contacts are springs with a time constant of 0.02 s"), "{because}");
    for time_constant in [-0.01, f64::NAN, f64::INFINITY] {
        let faults = Scene { contact_time_constant: time_constant, ..Scene::default() }.faults();
        assert_eq!(faults.len(), 1);
        assert_eq!(faults[0].pointer, "/contact_time_constant");
    }
}
