//! Shared by the tests: where the examples, the reference numbers and robots from elsewhere are, and common plans.

#![allow(dead_code)] // each test file uses its own part of this

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use gaitwright_physics::character::{self, Character, JointKind, Limits, Options, Shape};
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

/// Robot descriptions from elsewhere: the folder that the variable `ROBOT_URDF_DIR` names. The tests that need them are
/// ignored unless asked for, and then fail where there are none.
pub fn robots() -> PathBuf {
    let folder = std::env::var_os("ROBOT_URDF_DIR").map(PathBuf::from);
    let folder = folder.expect("ROBOT_URDF_DIR names no folder of robot descriptions (URDF files)");
    assert!(!urdf_files(&folder).is_empty(), "ROBOT_URDF_DIR={}: no URDF file there", folder.display());
    folder
}

/// The URDF files in a folder, by name.
pub fn urdf_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "urdf"))
        .collect();
    paths.sort();
    paths
}

/// Reference numbers for [`robots`]: the folder that `ROBOT_REFERENCE_DIR` names, or `reference` beside theirs.
pub fn robot_reference() -> PathBuf {
    let folder = match std::env::var_os("ROBOT_REFERENCE_DIR") {
        Some(folder) => PathBuf::from(folder),
        None => robots().join("../reference"),
    };
    assert!(folder.is_dir(), "{}: no such folder; set ROBOT_REFERENCE_DIR", folder.display());
    folder
}

/// The path of a file in `tests/reference`.
pub fn reference_path(name: &str) -> PathBuf {
    repository().join("tests/reference").join(name)
}

/// A JSON document.
pub fn json(path: &Path) -> serde_json::Value {
    let text = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_slice(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
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

/// `character` with its lengths multiplied by `s`, of the same density and strength.
pub fn scaled(character: &Character, s: f64) -> Character {
    let mut scaled = character.clone();
    for link in &mut scaled.links {
        if let Some(inertial) = &mut link.inertial {
            inertial.mass *= s.powi(3);
            inertial.center_of_mass *= s;
            inertial.inertia *= s.powi(5);
        }
        if let Some(joint) = &mut link.joint {
            joint.origin.translation.vector *= s;
            // What slides has a force where others have a torque, and a metre where they have a radian.
            let length = if joint.kind == JointKind::Prismatic { s } else { 1.0 };
            joint.limits = joint
                .limits
                .map(|limits| Limits { lower: limits.lower * length, upper: limits.upper * length });
            let length_squared = length * length;
            joint.effort = joint.effort.map(|effort| effort * s.powi(4) / length);
            joint.velocity = joint.velocity.map(|velocity| velocity * length / s.sqrt());
            joint.damping *= s.powf(4.5) / length_squared;
            joint.friction *= s.powi(4) / length;
            joint.armature *= s.powi(5) / length_squared;
        }
        for placed in link.collisions.iter_mut().chain(&mut link.visuals) {
            placed.pose.translation.vector *= s;
            match &mut placed.shape {
                Shape::Sphere { radius } => *radius *= s,
                Shape::Box { half_extents } => *half_extents *= s,
                Shape::Cylinder { radius, half_length } | Shape::Capsule { radius, half_length } => {
                    *radius *= s;
                    *half_length *= s;
                }
                Shape::Hull { vertices, .. } => vertices.iter_mut().for_each(|vertex| *vertex *= s),
            }
        }
    }
    for frame in scaled.loops.iter_mut().flat_map(|closing| &mut closing.frames) {
        frame.translation.vector *= s;
    }
    scaled
}

/// A compiled plan.
pub fn plan(model: &Arc<Model>, scene: &Scene, accuracy: &Accuracy, gains: Option<&Gains>) -> Arc<StepPlan> {
    Arc::new(StepPlan::compile(scene, accuracy, gains, model).unwrap_or_else(|error| panic!("{error}")))
}

/// Does `work` for each item, on all processors; the results are in the items' order.
pub fn in_parallel<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let worker = || {
        let mut done = Vec::new();
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { return done };
            done.push((index, work(item)));
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut results: Vec<(usize, R)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
        let results = workers.into_iter().map(|worker| worker.join());
        results.flat_map(|done| done.unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    });
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}
