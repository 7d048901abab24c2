//! Errors of trajectories whose error is known beforehand.

use std::cell::Cell;

use gaitwright_learning::accuracy::scenes::ClosedForm;
use gaitwright_learning::accuracy::{
    AccuracyProblem, Engine, ErrorSpread, TrialOutcome, TrialSettings, displacement,
};
use gaitwright_physics::scene::Accuracy;
use gaitwright_physics::sim::{Simulator, State};
use nalgebra::{Unit, UnitQuaternion, Vector3};

use crate::common;

const POINT: TrialSettings = TrialSettings { engine: Engine::Gaitwright, accuracy: COARSE };

const COARSE: Accuracy = Accuracy {
    step: 0.005,
    step_tolerance: None,
    integrator: gaitwright_physics::scene::Integrator::SemiImplicitEuler,
    solver: gaitwright_physics::scene::SolverChoice {
        kind: gaitwright_physics::scene::SolverKind::Newton,
        iterations: 50,
        tolerance: 1e-9,
    },
    coordinates: gaitwright_physics::scene::Coordinates::Reduced,
    joint_bias: gaitwright_physics::scene::JointBias::Consistent,
    friction_cone: gaitwright_physics::scene::FrictionCone::Cone,
};

fn measured(outcome: Option<TrialOutcome>) -> gaitwright_learning::accuracy::Figures {
    match outcome {
        Some(TrialOutcome::Measured(figures)) => figures,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_character_that_is_elsewhere_is_off_by_the_way() {
    for name in ["quadruped.urdf", "snake.json"] {
        let model = common::example(name);
        let state = State::new(&model);
        let mut moved = state.clone();
        moved.root.position += Vector3::new(0.3, -0.4, 1.2);
        assert!((displacement(&model, &moved, &state) - 1.3).abs() < 1e-14, "{name}");
        assert!(displacement(&model, &state, &state) < 1e-15, "{name}");
    }
}

/// A turn by φ about a principal axis moves mass at the distance r by 2 r sin(φ/2), and ∫ r² dm is the moment of
/// inertia about the axis.
#[test]
fn a_turned_body_is_off_by_its_radius_of_gyration() {
    let problem = ClosedForm::named("tumbling").unwrap().problem().unwrap();
    let model = &problem.setup.model;
    let state = State::new(model);
    for (axis, inertia) in
        [(Vector3::x_axis(), 0.01_f64), (Vector3::y_axis(), 0.02), (Vector3::z_axis(), 0.03)]
    {
        for angle in [1e-6, 0.3, 3.0] {
            let mut turned = state.clone();
            turned.root.orientation = UnitQuaternion::from_axis_angle(&axis, angle);
            let expected = 2.0 * (0.5 * angle).sin() * inertia.sqrt();
            assert!((displacement(model, &turned, &state) - expected).abs() < 1e-9 * expected);
            let error = (problem.measure.of)(model, &turned, &state);
            assert!((error - angle).abs() < 1e-9 * angle, "the scene's own measure is the angle");
        }
    }
}

/// Position and turn of a single body add up in squares when its frame sits at its centre of mass.
#[test]
fn displacement_is_the_mean_over_the_material() {
    let problem = ClosedForm::named("rolling-ball").unwrap().problem().unwrap();
    let model = &problem.setup.model;
    let state = State::new(model);
    let mut other = state.clone();
    other.root.position += Vector3::new(0.02, 0.0, 0.01);
    let axis = Unit::new_normalize(Vector3::new(1.0, 2.0, -0.5));
    other.root.orientation = UnitQuaternion::from_axis_angle(&axis, 0.2);
    let gyration = 0.4 * 0.1 * 0.1;
    let expected = (0.0005 + gyration * (2.0 * 0.1_f64.sin()).powi(2)).sqrt();
    assert!((displacement(model, &other, &state) - expected).abs() < 1e-6 * expected);
}

/// The truth of a problem replaced by what the simulator itself does at `accuracy`, moved by `offset`.
fn replaced(accuracy: &Accuracy, offset: Vector3<f64>) -> AccuracyProblem {
    let mut problem = ClosedForm::named("ballistic").unwrap().problem().unwrap();
    let accuracy = problem.divided(accuracy);
    let plan = std::sync::Arc::new(problem.setup.plan(&accuracy).unwrap());
    let mut simulator = Simulator::new(plan, problem.setup.start.clone());
    let steps = problem.steps(accuracy.step);
    for mark in &mut problem.pieces[0].marks {
        for _ in 0..steps {
            simulator.step(gaitwright_physics::sim::Command::Passive).unwrap();
        }
        mark.clone_from(simulator.state());
        mark.root.position += offset;
    }
    problem
}

#[test]
fn a_trial_finds_the_error_that_was_put_in() {
    let same = measured(replaced(&COARSE, Vector3::zeros()).try_out(&POINT, 1, &|| false));
    assert_eq!((same.error, same.spread.greatest, same.energy_error), (0.0, 0.0, 0.0));
    let moved = measured(replaced(&COARSE, Vector3::new(0.003, 0.0, 0.004)).try_out(&POINT, 1, &|| false));
    assert!((moved.error - 0.005).abs() < 1e-12 && (moved.spread.greatest - 0.005).abs() < 1e-12);
    // Lifted by 4 mm, 0.52 kg have m g · 4 mm more energy; nothing moves faster.
    let mass = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.05_f64.powi(3);
    assert!((moved.energy_error - mass * 9.81 * 0.004).abs() < 1e-12);
    assert_eq!(moved.momentum_error, 0.0);
    // One a step, and the few with which a simulation finds out how fast its bodies swing.
    let evaluations = moved.evaluations.unwrap() * 1.024;
    assert!((208.0..=212.0).contains(&evaluations), "{evaluations}");
}

#[test]
fn a_character_that_is_lost_has_diverged() {
    let outcome = replaced(&COARSE, Vector3::new(1000.0, 0.0, 0.0)).try_out(&POINT, 1, &|| false);
    let Some(TrialOutcome::Diverged(reason)) = outcome else { panic!("{outcome:?}") };
    assert!(reason.to_string().contains("1.000e3 m"), "{reason}");
}

#[test]
fn a_trial_ends_when_it_is_told_to() {
    let asked = Cell::new(0);
    let stop = || {
        asked.set(asked.get() + 1);
        asked.get() > 2
    };
    let problem = ClosedForm::named("ballistic").unwrap().problem().unwrap();
    assert_eq!(problem.try_out(&POINT, 5, &stop), None);
    assert_eq!(asked.get(), 3, "it is asked between repeats, and no more after it was told");
}

/// The quartiles that R and NumPy give by default.
#[test]
fn quartiles_are_those_of_definition_seven() {
    for (values, quartiles) in [
        (&[4.0, 1.0, 3.0, 2.0][..], [1.0, 1.75, 2.5, 3.25, 4.0]),
        (&[5.0, 1.0, 4.0, 2.0, 3.0], [1.0, 2.0, 3.0, 4.0, 5.0]),
        (&[7.0], [7.0; 5]),
        (&[1.0, 2.0], [1.0, 1.25, 1.5, 1.75, 2.0]),
    ] {
        let ErrorSpread { least, lower_quartile, median, upper_quartile, greatest } = ErrorSpread::of(values);
        assert_eq!([least, lower_quartile, median, upper_quartile, greatest], quartiles, "{values:?}");
    }
}
