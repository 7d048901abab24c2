//! Reads a robot, lets it stand, and steps it for a second.
//!
//! `cargo run --release -p gaitwright-physics --example step`

use std::error::Error;
use std::path::Path;
use std::sync::Arc;

use gaitwright_physics::character::{Options, read_file};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Scene, StepPlan};
use gaitwright_physics::sim::{Command, Simulator};
use gaitwright_physics::stance::Stance;

fn main() -> Result<(), Box<dyn Error>> {
    let reading = read_file(Path::new("examples/quadruped.urdf"), Options::default())?;
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let (scene, accuracy) = (Scene::default(), Accuracy::default());
    let stance = Stance::find(&model, &scene);
    let plan = StepPlan::compile(&scene, &accuracy, Some(&stance.gains), &model)?;
    let mut simulator = Simulator::new(Arc::new(plan), stance.state);
    for _ in 0..500 {
        simulator.step(Command::Track { now: &stance.angles, next: &stance.angles })?;
    }
    println!(
        "{:.3} m above the ground after {:.1} s",
        simulator.state().root.position.z,
        simulator.state().time
    );
    Ok(())
}
