//! glTF, read by the reader of the crate `gltf`, and by the validator of Khronos.

use std::collections::BTreeMap;
use std::process::Command;

use gaitwright::export::{
    ExportFormat, ExportOptions, MotionClip, SampledMotion, animation_name, export_repertoire,
};
use gltf::animation::util::ReadOutputs;
use gltf::{Gltf, Node};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::feet::bundled;
use super::{Example, assert_near, at, y_up};

/// Position and quaternion of each node that an animation moves, key by key.
#[derive(Default)]
struct Keys {
    times: Vec<f32>,
    translations: BTreeMap<usize, Vec<[f32; 3]>>,
    rotations: BTreeMap<usize, Vec<[f32; 4]>>,
}

fn keys(file: &Gltf, name: &str) -> Keys {
    let bytes = file.blob.as_deref().unwrap();
    let animation = file.animations().find(|animation| animation.name() == Some(name)).unwrap();
    let mut keys = Keys::default();
    for channel in animation.channels() {
        let reader = channel.reader(|_| Some(bytes));
        keys.times = reader.read_inputs().unwrap().collect();
        let input = channel.sampler().input();
        assert_eq!(input.min().unwrap()[0].as_f64(), Some(f64::from(keys.times[0])));
        assert_eq!(input.max().unwrap()[0].as_f64(), Some(f64::from(*keys.times.last().unwrap())));
        let node = channel.target().node().index();
        match reader.read_outputs().unwrap() {
            ReadOutputs::Translations(values) => drop(keys.translations.insert(node, values.collect())),
            ReadOutputs::Rotations(values) => {
                drop(keys.rotations.insert(node, values.into_f32().collect()));
            }
            _ => panic!("a channel of another kind"),
        }
    }
    keys
}

/// World frames of a node and all below it, by name.
fn place(
    node: &Node<'_>,
    parent: &Isometry3<f64>,
    keys: &Keys,
    key: usize,
    found: &mut BTreeMap<String, Isometry3<f64>>,
) {
    let (translation, rotation, _) = node.transform().decomposed();
    let translation = keys.translations.get(&node.index()).map_or(translation, |values| values[key]);
    let rotation = keys.rotations.get(&node.index()).map_or(rotation, |values| values[key]);
    let [x, y, z, w] = rotation.map(f64::from);
    let pose = parent
        * Isometry3::from_parts(
            Translation3::from(Vector3::from(translation).cast::<f64>()),
            UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
        );
    node.children().for_each(|child| place(&child, &pose, keys, key, found));
    assert!(found.insert(node.name().unwrap().to_owned(), pose).is_none(), "names are unique");
}

fn assert_plays(file: &Gltf, name: &str, clip: &MotionClip, example: &Example, in_place: bool) {
    let keys = keys(file, name);
    assert_eq!(keys.times.len(), clip.frames.len());
    assert!((f64::from(*keys.times.last().unwrap()) - clip.duration()).abs() < 1e-6);
    let scene = file.default_scene().unwrap();
    let root = scene.nodes().next().unwrap();
    assert_eq!((scene.nodes().count(), root.name()), (1, Some("root_motion")));
    for (key, frame) in clip.frames.iter().enumerate() {
        let mut found = BTreeMap::new();
        place(&root, &Isometry3::identity(), &keys, key, &mut found);
        let wanted = example.link_poses(&frame.placed_root(in_place), &frame.angles);
        for (link, wanted) in example.character().links.iter().zip(&wanted) {
            let turned = Isometry3::from_parts(Translation3::identity(), y_up()) * wanted;
            assert_near(&found[&link.name], &turned, 2e-6);
        }
    }
    for rotations in keys.rotations.values() {
        for q in rotations {
            assert!((q.iter().map(|x| x * x).sum::<f32>().sqrt() - 1.0).abs() < 1e-6);
        }
        for pair in rotations.windows(2) {
            assert!(
                pair[0].iter().zip(&pair[1]).map(|(a, b)| a * b).sum::<f32>() > 0.0,
                "q and −q side by side"
            );
        }
    }
}

#[test]
fn its_animations_are_the_motion() {
    for example in [Example::new(), Example::with_poses()] {
        let file = Gltf::from_slice(&example.export(ExportFormat::Glb, at(60.0))).unwrap();
        let sampled = SampledMotion::new(&example.motion, example.character(), 60.0).unwrap();
        assert_plays(&file, "gallop", &sampled.cycle, &example, false);
        assert_plays(&file, "gallop_in_place", &sampled.cycle, &example, true);
        assert_plays(&file, "gallop_entry", sampled.entry.as_ref().unwrap(), &example, false);
        // In place, the last key is the first to the bit.
        let keys = keys(&file, "gallop_in_place");
        for values in keys.rotations.values() {
            assert_eq!(values.first(), values.last());
        }
        for values in keys.translations.values() {
            assert_eq!(values.first(), values.last());
        }
        // The travel is the root node's alone.
        let travel = self::keys(&file, "gallop");
        let root = file.default_scene().unwrap().nodes().next().unwrap().index();
        let moved = travel.translations[&root].last().unwrap();
        let [start, end] = example.ends();
        let wanted = y_up() * (end.translation.vector - start.translation.vector);
        assert!((Vector3::from(*moved).cast::<f64>() - wanted).norm() < 1e-5, "{moved:?} {wanted}");
    }
}

#[test]
fn in_place_leaves_out_the_root_motion() {
    let example = Example::new();
    let options = ExportOptions { in_place: true, ..ExportOptions::default() };
    let file = Gltf::from_slice(&example.export(ExportFormat::Glb, options)).unwrap();
    let names: Vec<_> = file.animations().map(|animation| animation.name().unwrap().to_owned()).collect();
    assert_eq!(names, ["gallop_in_place", "gallop_entry"]);
}

/// The bundled walk and trot in one file are what each is in a file of its own.
#[test]
fn a_repertoire_has_the_animations_of_each_motion() {
    let examples = ["walk", "trot"].map(bundled);
    let sampled = examples.each_ref().map(|example| {
        let one = SampledMotion::new(&example.motion, example.character(), 60.0).unwrap();
        let name = animation_name(&format!("1-fast {}.json", one.name));
        one.named(name)
    });
    let bytes = export_repertoire(&sampled, false).unwrap();
    let file = Gltf::from_slice(&bytes).unwrap();
    let names: Vec<_> = file.animations().map(|animation| animation.name().unwrap().to_owned()).collect();
    let kinds = ["fast_walk", "fast_trot"]
        .map(|name| ["", "_in_place", "_entry"].map(|kind| format!("{name}{kind}")));
    assert_eq!(names, kinds.concat());
    for (example, motion) in examples.iter().zip(&sampled) {
        assert_plays(&file, &motion.name, &motion.cycle, example, false);
        assert_plays(&file, &format!("{}_in_place", motion.name), &motion.cycle, example, true);
        assert_plays(
            &file,
            &format!("{}_entry", motion.name),
            motion.entry.as_ref().unwrap(),
            example,
            false,
        );
    }
    let [walk, trot] = sampled;
    let twice = export_repertoire(&[walk.clone(), trot.named(walk.name.clone())], false);
    assert!(twice.unwrap_err().to_string().contains("fast_walk: two motions have this name"));
    export_repertoire(&[], false).unwrap_err();
}

#[test]
fn animations_are_called_after_files() {
    for (file, name) in [
        ("3-running-trot.json", "running_trot"),
        ("quadruped-walk.motion.json", "quadruped_walk"),
        ("12.json", "12"),
        ("-", "motion"),
    ] {
        assert_eq!(animation_name(file), name);
    }
}

/// Every shape is there in its size, closed, and with its faces outward: the volume that they enclose is the shape's.
#[test]
fn its_meshes_are_the_shapes() {
    let character = r#"{ "format": "gaitwright/character@1", "name": "shapes", "links": [
        { "name": "ball", "density": 1000, "shapes": [{ "kind": "sphere", "radius": 0.1 }] },
        { "name": "brick", "density": 1000, "shapes": [{ "kind": "box", "size": [0.1, 0.2, 0.3] }] },
        { "name": "tin", "density": 1000, "shapes": [{ "kind": "cylinder", "radius": 0.1, "length": 0.3 }] },
        { "name": "pill", "density": 1000, "shapes": [{ "kind": "capsule", "radius": 0.1, "length": 0.3 }] }],
      "joints": [
        { "name": "a", "kind": "revolute", "parent": "ball", "child": "brick", "axis": [0, 1, 0] },
        { "name": "b", "kind": "prismatic", "parent": "brick", "child": "tin", "axis": [0, 0, 1],
          "limits": { "lower": -1, "upper": 1 } },
        { "name": "c", "kind": "revolute", "parent": "tin", "child": "pill", "axis": [1, 0, 0] }] }"#;
    let reading = gaitwright::jobs::read_character(character.as_bytes(), None, Default::default()).unwrap();
    let mut motion = Example::new().motion;
    motion.character.digest = reading.character.digest.clone();
    motion.joints = ["a", "b", "c"].map(str::to_owned).to_vec();
    for keyframe in motion.keyframes.iter_mut().chain(&mut motion.entry) {
        keyframe.angles.truncate(3);
        keyframe.velocities.truncate(3);
    }
    motion.drive.stiffness.truncate(3);
    motion.drive.damping.truncate(3);
    motion.drive.max_torque.truncate(3);
    let example = Example {
        motion,
        model: std::sync::Arc::new(gaitwright_physics::model::Model::new(
            std::sync::Arc::new(reading.character),
            gaitwright_physics::model::Base::Floating,
        )),
    };
    let file = Gltf::from_slice(&example.export(ExportFormat::Glb, at(60.0))).unwrap();
    // A link that slides is moved, and one that turns is turned.
    let sampled = SampledMotion::new(&example.motion, example.character(), 60.0).unwrap();
    assert_plays(&file, "gallop", &sampled.cycle, &example, false);
    let pi = std::f64::consts::PI;
    let ball = 4.0 / 3.0 * pi * 1e-3;
    let volumes = [("ball", ball), ("brick", 0.006), ("tin", pi * 0.003), ("pill", pi * 0.003 + ball)];
    for (name, volume) in volumes {
        let mesh = file.meshes().find(|mesh| mesh.name() == Some(name)).unwrap();
        let mut found = 0.0;
        for primitive in mesh.primitives() {
            let reader = primitive.reader(|_| file.blob.as_deref());
            let positions: Vec<Vector3<f64>> =
                reader.read_positions().unwrap().map(|p| Vector3::from(p).cast()).collect();
            let normals: Vec<Vector3<f64>> =
                reader.read_normals().unwrap().map(|n| Vector3::from(n).cast()).collect();
            assert!(normals.iter().all(|normal| (normal.norm() - 1.0).abs() < 1e-6));
            let indices: Vec<usize> =
                reader.read_indices().unwrap().into_u32().map(|at| at as usize).collect();
            for triangle in indices.chunks(3) {
                let [a, b, c] = [0, 1, 2].map(|corner| positions[triangle[corner]]);
                found += a.dot(&b.cross(&c)) / 6.0;
                let outward = (b - a).cross(&(c - a)).normalize();
                assert!(triangle.iter().all(|&corner| normals[corner].dot(&outward) > 0.8), "{name}");
            }
        }
        assert!((0.94 * volume..1.0001 * volume).contains(&found), "{name}: {found} of {volume} m³");
    }
}

/// The validator of Khronos; `NODE_PATH` names the folder of the package when it is not found by itself.
#[test]
#[ignore = "needs gltf-validator: npm install gltf-validator, and NODE_PATH"]
fn the_khronos_validator_finds_no_fault() {
    const SCRIPT: &str = "const v = require('gltf-validator'); const fs = require('fs'); \
        v.validateBytes(new Uint8Array(fs.readFileSync(process.argv[1]))) \
        .then(r => console.log(JSON.stringify(r.issues)));";
    let folder = tempfile::tempdir().unwrap();
    let one = |example: Example, in_place| {
        example.export(ExportFormat::Glb, ExportOptions { in_place, ..ExportOptions::default() })
    };
    let examples = ["walk", "trot"].map(bundled);
    let sampled =
        examples.each_ref().map(|one| SampledMotion::new(&one.motion, one.character(), 60.0).unwrap());
    let repertoire = export_repertoire(&sampled, false).unwrap();
    for bytes in [one(Example::new(), false), one(Example::with_poses(), true), repertoire] {
        let path = folder.path().join("motion.glb");
        std::fs::write(&path, bytes).unwrap();
        let output = Command::new("node").args(["-e", SCRIPT]).arg(&path).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let issues: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        for kind in ["numErrors", "numWarnings", "numInfos"] {
            assert_eq!(issues[kind], 0, "{issues}");
        }
    }
}
