//! What a simulation that cannot go on says: the time, the place and the cause.

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::sim::{Command, FailureCause, Simulator, State};

use crate::bodies::ball;
use crate::common;

/// Resting on the ground, to be pushed by a constant torque of `torque` N m.
fn standing() -> (Arc<Model>, Simulator) {
    let model = common::example("quadruped.urdf");
    let state = gaitwright_physics::stance::Stance::find(&model, &Scene::default()).state.clone();
    let plan = common::plan(&model, &Scene::default(), &Accuracy::default(), None);
    (model.clone(), Simulator::new(plan, state))
}

#[test]
fn x() {
    let (model, start) = standing();
    for value in [f64::NAN, f64::INFINITY, 1e300, 1e160, 1e100, 1e30] {
        for place in 0..6 {
            let mut simulator = start.clone();
            let mut state: State = simulator.state().clone();
            match place {
                0 => state.root.position.z = value,
                1 => state.root.linear_velocity.z = -value,
                2 => state.root.angular_velocity.y = value,
                3 => state.angles[3] = value,
                4 => state.velocities[3] = value,
                _ => {}
            }
            simulator.set_state(&state);
            let torque = vec![if place == 5 { value } else { 0.0 }; model.joint_count()];
            let r = simulator.step(Command::Torque(&torque));
            println!("{value} {place}: {:?}", r.map_err(|e| e.to_string()));
        }
    }
    let _ = (ball(), FailureCause::NoSolution);
}
