//! Shared by the tests: the real robots and reference numbers, where they are at hand.

#![allow(dead_code)] // each test file uses its own part of this

use std::path::PathBuf;
use std::sync::Arc;

use gaitwright::character::{self, Character, Options};
use gaitwright::model::Model;
use gaitwright::scene::{Accuracy, Effect, Gains, Scene, StepPlan, Switch};

/// Folder of real robots: `ROBOT_URDF_DIR`, or `../shared/robots` beside the package.
pub fn robots() -> Option<PathBuf> {
    let folder = match std::env::var_os("ROBOT_URDF_DIR") {
        Some(folder) => PathBuf::from(folder),
        None => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/robots"),
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
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
    Arc::new(Model::new(character(&path), false))
}

/// A plan in which only gravity and velocity forces act.
pub fn free_flight(model: &Model, step: f64) -> Arc<StepPlan> {
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
pub fn plan(model: &Model, scene: &Scene, accuracy: &Accuracy, gains: Option<&Gains>) -> Arc<StepPlan> {
    Arc::new(StepPlan::compile(scene, accuracy, gains, model).unwrap_or_else(|error| panic!("{error}")))
}
