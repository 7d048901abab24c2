//! Exported motions, read back by readers that know nothing of the writers and compared with the motion.

mod bvh;
mod commands;
mod feet;
mod frames;
mod glb;
mod mujoco;
mod tables;
mod three;

use std::path::Path;
use std::sync::Arc;

use gaitwright::export::{ExportFormat, ExportOptions, export};
use gaitwright_physics::character::Character;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{Motion, RootPose, SampledPose};
use gaitwright_physics::sim::{Simulator, State};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::common;

/// The file of the motion.
const MOTION: &str = "tests/service/exports/two_beats.motion.json";

/// A motion of two keyframes a round, 168 ms long, and its character.
struct Example {
    motion: Motion,
    model: Arc<Model>,
}

impl Example {
    fn new() -> Self {
        let motion = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(MOTION)).unwrap();
        Self { motion: Motion::parse(&motion).unwrap(), model: common::example("quadruped.urdf") }
    }

    /// The same with simulated poses that lag behind the targets, do not quite close, and lie off the frames.
    fn with_poses() -> Self {
        let mut example = Self::new();
        let sampled =
            gaitwright::export::SampledMotion::new(&example.motion, example.character(), 250.0).unwrap();
        let period = sampled.cycle.duration();
        let poses = sampled.cycle.frames.iter().map(|frame| {
            let root = frame.placed_root(false);
            let q = root.rotation;
            let lag = |(joint, angle): (usize, &f64)| {
                angle
                    + 0.02 * (frame.time / period * std::f64::consts::TAU + joint as f64).sin()
                    + 0.003 * frame.time
            };
            SampledPose {
                time: frame.time,
                angles: frame.angles.iter().enumerate().map(lag).collect(),
                root: RootPose {
                    position: root.translation.vector.into(),
                    orientation: [q.w, q.i, q.j, q.k],
                },
            }
        });
        let poses: Vec<SampledPose> = poses.collect();
        drop(sampled);
        example.motion.poses = Some(poses);
        assert!(example.motion.faults().is_empty());
        example
    }

    fn character(&self) -> &Character {
        &self.model.character
    }

    fn export(&self, format: ExportFormat, options: ExportOptions) -> Vec<u8> {
        export(&self.motion, self.character(), format, &options).unwrap().file
    }

    /// The frames of all links by the simulator's own kinematics.
    fn link_poses(&self, root: &Isometry3<f64>, angles: &[f64]) -> Vec<Isometry3<f64>> {
        let plan = common::free_flight(&self.model, 1e-3);
        let mut state = State::new(&self.model);
        state.root.position = root.translation.vector.into();
        state.root.orientation = root.rotation;
        state.angles.copy_from_slice(angles);
        Simulator::new(plan, state).link_poses()
    }

    /// The root at the start and the end of the loop, as the document has it.
    fn ends(&self) -> [Isometry3<f64>; 2] {
        let keyframes = &self.motion.keyframes;
        [&keyframes[0], &keyframes[keyframes.len() - 1]].map(|keyframe| {
            let root = gaitwright_physics::sim::Root::from(&keyframe.root);
            Isometry3::from_parts(root.position.into(), root.orientation)
        })
    }
}

fn at(fps: f64) -> ExportOptions {
    ExportOptions { fps, in_place: false }
}

/// From z up to y up, written anew: x goes to z, y to x, z to y.
fn y_up() -> UnitQuaternion<f64> {
    let from = nalgebra::Matrix3::from_columns(&[Vector3::z(), Vector3::x(), Vector3::y()]);
    UnitQuaternion::from_matrix(&from)
}

#[track_caller]
fn assert_near(found: &Isometry3<f64>, wanted: &Isometry3<f64>, bound: f64) {
    let distance = (found.translation.vector - wanted.translation.vector).norm();
    let angle = found.rotation.angle_to(&wanted.rotation);
    assert!(distance < bound && angle < bound, "{distance} m, {angle} rad apart");
}
