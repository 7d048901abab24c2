//! glTF and BVH, loaded and played by three.js.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use gaitwright::export::{ExportFormat, ExportOptions, MotionClip, SampledMotion, export_repertoire};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use serde::Deserialize;

use super::feet::bundled;
use super::{Example, assert_near, at, y_up};

/// Position, and quaternion x, y, z, w, of a node in the world.
type Placed = ([f64; 3], [f64; 4]);

/// What three.js has made of an animation.
#[derive(Deserialize)]
struct Played {
    /// s.
    duration: f64,
    /// Every node by its name, at each time that was asked for.
    frames: Vec<BTreeMap<String, Placed>>,
}

/// Has three.js play an animation of a file at some times, s.
fn play(bytes: &[u8], extension: &str, animation: &str, times: &[f64]) -> Played {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("motion.{extension}"));
    std::fs::write(&path, bytes).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/service/exports/three.cjs");
    let times = serde_json::to_string(times).unwrap();
    let output = Command::new("node").arg(script).arg(&path).args([animation, &times]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The clip, as three.js plays it, has its length, and the links stand where the simulator's kinematics has them: `bound`
/// m and rad, the rounding of the file.
fn assert_plays(played: &Played, clip: &MotionClip, (example, in_place, bound): (&Example, bool, f64)) {
    assert!(
        (played.duration - clip.duration()).abs() < bound,
        "{} s of {}",
        played.duration,
        clip.duration()
    );
    assert_eq!(played.frames.len(), clip.frames.len());
    for (found, frame) in played.frames.iter().zip(&clip.frames) {
        let wanted = example.link_poses(&frame.placed_root(in_place), &frame.angles);
        for (link, wanted) in example.character().links.iter().zip(&wanted) {
            let (position, [x, y, z, w]) = found[&link.name];
            let found = Isometry3::from_parts(
                Translation3::from(Vector3::from(position)),
                UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
            );
            let turned = Isometry3::from_parts(Translation3::identity(), y_up()) * wanted;
            assert_near(&found, &turned, bound);
        }
    }
}

fn times(clip: &MotionClip) -> Vec<f64> {
    clip.frames.iter().map(|frame| frame.time).collect()
}

/// Numbers of glTF are of single precision: at some 0.5 m, half a millionth of a metre, and so through four links.
#[test]
#[ignore = "needs three.js: npm install three, and NODE_PATH"]
fn it_plays_every_animation_of_a_repertoire() {
    let examples = ["walk", "trot"].map(bundled);
    let sampled =
        examples.each_ref().map(|one| SampledMotion::new(&one.motion, one.character(), 60.0).unwrap());
    let file = export_repertoire(&sampled, false).unwrap();
    for (example, motion) in examples.iter().zip(&sampled) {
        let SampledMotion { name, cycle, entry, .. } = motion;
        let entry = entry.as_ref().unwrap();
        for (name, clip, in_place) in [
            (name.clone(), cycle, false),
            (format!("{name}_in_place"), cycle, true),
            (format!("{name}_entry"), entry, false),
        ] {
            assert_plays(&play(&file, "glb", &name, &times(clip)), clip, (example, in_place, 2e-6));
        }
    }
}

/// BVH has six decimals of a metre and of a degree.
#[test]
#[ignore = "needs three.js: npm install three, and NODE_PATH"]
fn it_plays_bvh() {
    for (example, in_place) in [(bundled("walk"), false), (Example::with_poses(), true)] {
        let file = example.export(ExportFormat::Bvh, ExportOptions { in_place, ..at(60.0) });
        let sampled = SampledMotion::new(&example.motion, example.character(), 60.0).unwrap();
        let played = play(&file, "bvh", "animation", &times(&sampled.cycle));
        assert_plays(&played, &sampled.cycle, (&example, in_place, 2e-6));
    }
}
