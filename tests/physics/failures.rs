//! What a simulation that cannot go on says: the time, the place and the cause.

use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::sim::{Command, Failure, FailureCause, Simulator, State};
use gaitwright_physics::stance::Stance;

use crate::common;

/// The bundled quadruped on its feet, without a drive.
fn standing() -> Simulator {
    let (model, scene) = (common::example("quadruped.urdf"), Scene::default());
    let stance = Stance::find(&model, &scene);
    Simulator::new(common::plan(&model, &scene, &Accuracy::default(), None), stance.state)
}

/// What a step says after the state was changed by `change`.
fn changed(start: &Simulator, change: impl Fn(&mut State)) -> Failure {
    let mut simulator = start.clone();
    let mut state = simulator.state().clone();
    change(&mut state);
    simulator.set_state(&state);
    simulator.step(Command::Passive).unwrap_err()
}

#[test]
fn a_state_that_is_not_finite_is_refused_where_it_is_given() {
    let start = standing();
    let joint = &start.model().joint_names[3];
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let of_root = [
            changed(&start, |state| state.root.position.z = number),
            changed(&start, |state| state.root.linear_velocity.x = number),
            changed(&start, |state| state.root.angular_velocity.y = number),
        ];
        let of_joint = [
            changed(&start, |state| state.angles[3] = number),
            changed(&start, |state| state.velocities[3] = number),
        ];
        for failure in of_root {
            let expected =
                Failure { time: 0.0, place: "root link trunk".into(), cause: FailureCause::NonFiniteStart };
            assert_eq!(failure, expected);
        }
        for failure in of_joint {
            assert_eq!(
                (failure.place, failure.cause),
                (format!("body of joint {joint}"), FailureCause::NonFiniteStart)
            );
        }
    }
    // Also the first state of all.
    let mut state = start.state().clone();
    state.angles[3] = f64::NAN;
    let failure = Simulator::new(start.plan().clone(), state).step(Command::Passive).unwrap_err();
    assert_eq!(failure.cause, FailureCause::NonFiniteStart);
}

#[test]
fn a_command_that_is_not_finite_is_refused_and_names_the_joint() {
    let start = standing();
    let model = start.model();
    for joint in [0, 7, model.joint_count() - 1] {
        let mut numbers = start.state().angles.clone();
        let good = numbers.clone();
        numbers[joint] = f64::NAN;
        let wanted: Vec<Option<f64>> = numbers.iter().map(|number| Some(*number)).collect();
        let commands = [
            Command::Torque(&numbers),
            Command::Velocity(&wanted),
            Command::Track { now: &numbers, next: &good },
            Command::Track { now: &good, next: &numbers },
        ];
        for command in commands {
            let mut simulator = start.clone();
            let failure = simulator.step(command).unwrap_err();
            let place = format!("joint {}", model.joint_names[joint]);
            assert_eq!(failure, Failure { time: 0.0, place, cause: FailureCause::NonFiniteCommand });
            // Nothing has happened yet, so a better command may follow.
            assert!(simulator.step(Command::Passive).is_ok());
        }
    }
}

#[test]
fn a_problem_that_overflows_names_a_row_that_is_not_finite() {
    let failure = changed(&standing(), |state| state.root.linear_velocity.z = -1e300);
    assert_eq!(failure.cause, FailureCause::NonFiniteProblem);
    // The trunk comes down as fast as the feet, and its contacts are the first rows.
    assert_eq!(failure.place, "a contact of link trunk");
}
