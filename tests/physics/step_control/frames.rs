//! Whoever looks at a motion from a frame that moves sees the same steps divided.

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Feedforward, Gains, Integrator, Scene};
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{UnitQuaternion, Vector3};

use crate::bodies::{self, Bar, Hanging};
use crate::common;

/// m/s.
const FRAME: Vector3<f64> = Vector3::new(40.0, -25.0, 15.0);

/// Greatest difference of the motions, rad. Positions of up to 60 m have a rounding of 1e-14 m in each of a thousand steps,
/// and the motions are chaotic: differences grow by some factor of e in each of ten rotations.
const APART: f64 = 1e-6;

fn tumbling(model: &Model) -> State {
    let mut state = State::new(model);
    state.root.orientation = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.5, 0.9));
    state.root.angular_velocity = Vector3::new(25.0, 40.0, -20.0);
    for joint in 0..model.joint_count() {
        let [lower, upper] = model.limits[joint].unwrap_or([-0.5, 0.5]);
        state.angles[joint] = 0.5 * (lower + upper);
        state.velocities[joint] = 30.0 * (joint as f64 + 0.3).sin();
    }
    state
}

/// Joint angles and number of substeps after each step of 4 ms, seen from a frame that moves at `-frame`.
fn seen(
    model: &Arc<Model>,
    frame: Vector3<f64>,
    gains: Option<&Gains>,
    integrator: Integrator,
) -> Vec<(Vec<f64>, u64)> {
    let accuracy = Accuracy { step: 0.004, integrator, ..Accuracy::default() };
    let scene = Scene { ground: None, ..Scene::default() };
    let plan = common::plan(model, &scene, &accuracy, gains);
    let mut start = tumbling(model);
    start.root.linear_velocity += frame;
    let mut simulator = Simulator::new(plan, start.clone());
    let mut before = 0;
    (0..250)
        .map(|_| {
            let held = Command::Track { now: &start.angles, next: &start.angles };
            let command = if gains.is_some() { held } else { Command::Passive };
            simulator.step(command).unwrap();
            let substeps = simulator.substeps() - before;
            before = simulator.substeps();
            (simulator.state().angles.clone(), substeps)
        })
        .collect()
}

fn same(what: &str, one: &[(Vec<f64>, u64)], other: &[(Vec<f64>, u64)]) {
    let divided = one.iter().filter(|(_, substeps)| *substeps > 1).count();
    assert!(divided > 10, "{what}: {divided} steps are divided");
    for (step, ((angles, substeps), (others, parts))) in one.iter().zip(other).enumerate() {
        assert_eq!(substeps, parts, "{what}, step {step}");
        let apart = angles.iter().zip(others).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart < APART, "{what}, step {step}: {apart} rad apart");
    }
}

fn characters() -> [(&'static str, Arc<Model>); 2] {
    let bar = Bar { mass: 0.5, center: 0.1, length: 0.2, inertia: 2e-3 };
    [("quadruped", common::example("quadruped.urdf")), ("chain", bodies::chain(Hanging::Free, &[bar; 6], ""))]
}

#[test]
fn a_moving_frame_sees_the_same_divisions() {
    for (name, model) in characters() {
        for integrator in [Integrator::SemiImplicitEuler, Integrator::MoreauJean] {
            let at_rest = seen(&model, Vector3::zeros(), None, integrator);
            same(&format!("{name}, {integrator:?}"), &at_rest, &seen(&model, FRAME, None, integrator));
        }
    }
}

/// Drives that have feedforward but no torque to give change nothing, whatever their period.
#[test]
fn feedforward_changes_no_division() {
    for (name, model) in characters() {
        for feedforward_period in [0.0, 0.01] {
            let none = vec![0.0; model.joint_count()];
            let gains = Gains {
                stiffness: none.clone(),
                damping: none,
                max_torque: vec![Some(0.0); model.joint_count()],
                feedforward: Feedforward::ContactFree,
                feedforward_period,
                ..Gains::default()
            };
            let still = Gains { feedforward: Feedforward::None, ..gains.clone() };
            let integrator = Integrator::SemiImplicitEuler;
            let without = seen(&model, Vector3::zeros(), Some(&still), integrator);
            let with = seen(&model, Vector3::zeros(), Some(&gains), integrator);
            same(&format!("{name}, period {feedforward_period} s"), &without, &with);
        }
    }
}
