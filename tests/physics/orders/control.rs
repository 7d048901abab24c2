//! Steps divided by an error tolerance.

use super::bodies::{self, Hanging};
use super::common;
use super::reference::Chain;
use super::{BARS, Smooth, no_ground};
use gaitwright_physics::scene::{Accuracy, Integrator, Scene};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;

const INTEGRATORS: [Integrator; 2] = [Integrator::SemiImplicitEuler, Integrator::MoreauJean];

fn swinging() -> Smooth<'static> {
    let model = bodies::chain(Hanging::Bolted, &BARS, "");
    let mut start = State::new(&model);
    start.angles.copy_from_slice(&[1.2, 0.5, -0.4]);
    start.velocities.copy_from_slice(&[-1.0, 2.0, 1.0]);
    let seconds = 0.48;
    let end = Chain::hanging(&BARS).swing(&start.angles, &start.velocities, seconds, |_, _, _| vec![0.0; 3]);
    Smooth {
        name: "pendulum",
        model,
        scene: no_ground(),
        gains: None,
        target: None,
        start,
        seconds,
        measure: &super::joints,
        end,
    }
}

fn accuracy(step: f64, integrator: Integrator, tolerance: f64) -> Accuracy {
    Accuracy { step, integrator, step_tolerance: Some(tolerance), ..Accuracy::default() }
}

/// A method of order p is seen to add c h^(p+1) in a step, so that a tolerance ε makes steps of ε^(1/(p+1)).
/// In all that leaves an error of ε^(q/(p+1)), with q the order of what is kept: p, and for the method of second order,
/// which is extrapolated, 4.
#[test]
fn a_tighter_tolerance_buys_a_smaller_error_with_more_steps() {
    let scene = swinging();
    let tolerances = [1e-4, 1e-5, 1e-6, 1e-7];
    for (integrator, [order, kept]) in INTEGRATORS.into_iter().zip([[1.0, 1.0], [2.0, 4.0]]) {
        let runs = tolerances.map(|tolerance| {
            let mut simulator = scene.simulator(accuracy(0.02, integrator, tolerance));
            let error = scene.end_error(&mut simulator);
            (error, simulator.evaluations() as f64)
        });
        for pair in runs.windows(2) {
            assert!(pair[1].0 < pair[0].0, "{integrator:?}: {runs:?}");
            assert!(pair[1].1 > pair[0].1, "{integrator:?}: {runs:?}");
        }
        let decades = (tolerances.len() - 1) as f64;
        let (coarse, fine) = (runs[0], runs[runs.len() - 1]);
        let gained = (coarse.0 / fine.0).log10() / decades;
        let expected = kept / (order + 1.0);
        assert!((expected - 0.2..expected + 0.25).contains(&gained), "{integrator:?}: {gained}, {runs:?}");
        let paid = (fine.1 / coarse.1).log10() / decades;
        let expected = 1.0 / (order + 1.0);
        // Shorter steps need fewer passes, so that work grows by a little less than the number of steps.
        assert!((expected - 0.15..expected + 0.05).contains(&paid), "{integrator:?}: {paid}, {runs:?}");
    }
}

/// A tolerance that nothing exceeds takes each step in its two halves, and with the method of second order extrapolates
/// from the whole step through them.
#[test]
fn a_loose_tolerance_takes_whole_steps() {
    let scene = swinging();
    for (integrator, share) in INTEGRATORS.into_iter().zip([0.0, 1.0 / 3.0]) {
        let step = 0.01;
        let whole = Accuracy { step, integrator, ..Accuracy::default() };
        let simulators =
            [(accuracy(step, integrator, 1.0), 1), (Accuracy { step: 0.5 * step, ..whole }, 2), (whole, 1)];
        let [controlled, halves, whole] = simulators.map(|(accuracy, steps)| {
            let mut simulator = scene.simulator(accuracy);
            (0..steps).for_each(|index| scene.advance(&mut simulator, index));
            super::joints(simulator.state())
        });
        for (index, found) in controlled.iter().enumerate() {
            let expected = halves[index] + share * (halves[index] - whole[index]);
            assert!((found - expected).abs() < 1e-12, "{integrator:?}: {found} instead of {expected}");
        }
    }
}

/// However a step was divided, it ends on time, and a kept state goes on as it would have.
#[test]
fn divided_steps_end_on_time_and_can_be_taken_up_again() {
    let scene = swinging();
    for integrator in INTEGRATORS {
        let settings = accuracy(0.01, integrator, 1e-6);
        let mut whole = scene.simulator(settings);
        let mut resumed = scene.simulator(settings);
        for index in 0..40 {
            if index == 20 {
                let kept = resumed.state().clone();
                resumed = scene.simulator(settings);
                resumed.set_state(&kept);
            }
            scene.advance(&mut whole, index);
            scene.advance(&mut resumed, index);
            assert!((whole.state().time - 0.01 * (index + 1) as f64).abs() < 1e-12);
        }
        assert_eq!(whole.state(), resumed.state(), "{integrator:?}");
    }
}

/// An impact is no smooth motion: the step is divided as far as it goes and the ball comes to rest all the same.
#[test]
fn a_landing_is_passed() {
    let model = bodies::ball();
    for integrator in INTEGRATORS {
        let mut start = State::new(&model);
        start.root.position.z = 0.3;
        start.root.linear_velocity.x = 1.0;
        let tolerance = 1e-6;
        let plan = common::plan(&model, &Scene::default(), &accuracy(0.01, integrator, tolerance), None);
        let mut simulator = Simulator::new(plan, start);
        for _ in 0..100 {
            simulator.step(Command::Passive).unwrap_or_else(|failure| panic!("{failure}"));
            // It may sink by what a step may err, here taken a thousand times.
            assert!(simulator.state().root.position.z > 0.1 - 1e3 * tolerance, "{integrator:?}");
        }
        let root = simulator.state().root;
        assert!((root.position.z - 0.1).abs() < 1e3 * tolerance, "{integrator:?}: {root:?}");
        // It slips at first and then rolls, at 5/7 of the speed.
        assert!((root.linear_velocity.x - 5.0 / 7.0).abs() < 1e-3, "{integrator:?}: {root:?}");
    }
}

/// Feet that strike the ground at a time that no trial is short enough to resolve: the shortest is taken, and said to be too coarse.
#[test]
fn a_tolerance_that_cannot_be_kept_is_told() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let coarse = |tolerance: f64| {
        let accuracy = accuracy(0.002, Integrator::SemiImplicitEuler, tolerance);
        let plan = common::plan(&model, &Scene::default(), &accuracy, None);
        let mut start = stance.state.clone();
        start.root.position.z += 0.001;
        start.root.linear_velocity.z = -2.0;
        let mut simulator = Simulator::new(plan, start);
        simulator.step(Command::Passive).unwrap();
        simulator.record().coarse_steps
    };
    assert_eq!(coarse(1e-3), 0);
    assert_eq!(coarse(1e-11), 1);
}
