//! Contact with obstacles, height fields and the character itself, and how contacts rebound: against closed
//! forms and properties.

use crate::common;

mod bounce;
mod geometry;
mod ground;
mod itself;
mod obstacles;
mod refusals;
mod round;
mod travel;

use std::sync::Arc;

use gaitwright_physics::character::{self, Options, ShapeDocument, Source};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Obstacle, Scene};
use gaitwright_physics::sim::{Command, Simulator, State};

pub const GRAVITY: f64 = 9.81;

/// A free body of 2 kg, about as hard to turn as a cube of 0.2 m, with one shape (an element of URDF).
pub fn body(geometry: &str) -> Arc<Model> {
    read(
        &format!(
            r#"<robot name="body"><link name="body">
              <inertial><mass value="2"/><inertia ixx="0.0133" ixy="0" ixz="0" iyy="0.0133" iyz="0" izz="0.0133"/></inertial>
              <collision><geometry>{geometry}</geometry></collision>
            </link></robot>"#
        ),
        Source::Urdf,
    )
}

pub fn read(text: &str, source: Source) -> Arc<Model> {
    let reading = character::read(text.as_bytes(), source, Options::default())
        .unwrap_or_else(|error| panic!("{error}"));
    Arc::new(Model::new(Arc::new(reading.character), Base::Floating))
}

pub fn obstacle(shape: &str) -> Obstacle {
    let shape: ShapeDocument = serde_json::from_str(shape).unwrap();
    Obstacle { name: None, shape, friction: None, restitution: None }
}

pub fn simulator(model: &Arc<Model>, scene: &Scene, step: f64, state: State) -> Simulator {
    let accuracy = Accuracy { step, ..Accuracy::default() };
    Simulator::new(common::plan(model, scene, &accuracy, None), state)
}

pub fn run(simulator: &mut Simulator, seconds: f64) {
    for _ in 0..(seconds / simulator.plan().step()).round() as usize {
        simulator.step(Command::Passive).unwrap_or_else(|failure| panic!("{failure}"));
    }
}
