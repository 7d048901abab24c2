//! Shared by the tests: the real robots and reference numbers, where they are at hand.

#![allow(dead_code)] // each test file uses its own part of this

use std::path::{Path, PathBuf};
use std::sync::Arc;

use gaitwright_physics::character::{self, Character, Options};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Effect, Gains, Scene, StepPlan, Switch};

/// The top folder of the repository, which is above or the same as that of the crate under test.
pub fn repository() -> &'static Path {
    let mut above = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    above.find(|folder| folder.join("examples").is_dir()).expect("the folder of the examples")
}

/// The path of a shipped example.
pub fn example_path(name: &str) -> PathBuf {
    repository().join("examples").join(name)
}

/// The number in an environment variable, where it is set.
pub fn number(variable: &str) -> Option<u64> {
    let text = std::env::var(variable).ok()?;
    Some(text.parse().unwrap_or_else(|error| panic!("{variable}={text}: {error}")))
}

/// Folder of real robots: `ROBOT_URDF_DIR`, or `../shared/robots` beside the package.
pub fn robots() -> Option<PathBuf> {
    let folder = match std::env::var_os("ROBOT_URDF_DIR") {
        Some(folder) => PathBuf::from(folder),
        None => repository().join("../shared/robots"),
    };
    if folder.is_dir() {
        Some(folder)
    } else {
        println!("no real robots found; set ROBOT_URDF_DIR to a folder of URDF files");
        None
    }
}

/// Reference numbers for those robots, in the folder `reference` beside theirs.
pub fn reference() -> Option<PathBuf> {
    let folder = robots()?.parent()?.join("reference");
    if folder.is_dir() {
        Some(folder)
    } else {
        println!("no reference numbers found beside the robots");
        None
    }
}

/// The character in `path`.
pub fn character(path: &std::path::Path) -> Arc<Character> {
    let reading = character::read_file(path, Options::default())
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    Arc::new(reading.character)
}

/// The model of a shipped example.
pub fn example(name: &str) -> Arc<Model> {
    Arc::new(Model::new(character(&example_path(name)), Base::Floating))
}

/// A plan in which only gravity and velocity forces act.
pub fn free_flight(model: &Arc<Model>, step: f64) -> Arc<StepPlan> {
    let scene = Scene {
        ground: None,
        ..without(&[Effect::SelfCollision, Effect::JointLimits, Effect::JointDamping, Effect::JointFriction])
    };
    plan(model, &scene, &Accuracy { step, ..Accuracy::default() }, None)
}

/// The default scene with some effects switched off.
pub fn without(effects: &[Effect]) -> Scene {
    let mut scene = Scene::default();
    scene.effects.extend(effects.iter().map(|effect| (*effect, Switch::Off)));
    scene
}

/// A compiled plan.
pub fn plan(model: &Arc<Model>, scene: &Scene, accuracy: &Accuracy, gains: Option<&Gains>) -> Arc<StepPlan> {
    Arc::new(StepPlan::compile(scene, accuracy, gains, model).unwrap_or_else(|error| panic!("{error}")))
}
