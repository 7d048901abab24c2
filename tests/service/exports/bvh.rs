//! BVH, read by a small reader of its own.

use std::collections::BTreeMap;
use std::str::SplitWhitespace;

use gaitwright::export::{ExportFormat, ExportOptions, SampledMotion};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::{Example, assert_near, at, y_up};

struct Joint {
    name: String,
    parent: Option<usize>,
    offset: Vector3<f64>,
    channels: Vec<String>,
}

struct Bvh {
    joints: Vec<Joint>,
    frame_time: f64,
    frames: Vec<Vec<f64>>,
}

fn number(words: &mut SplitWhitespace<'_>) -> f64 {
    words.next().unwrap().parse().unwrap()
}

fn read(text: &str) -> Bvh {
    let (hierarchy, motion) = text.split_once("MOTION").unwrap();
    let mut words = hierarchy.split_whitespace();
    assert_eq!(words.next(), Some("HIERARCHY"));
    let (mut joints, mut open): (Vec<Joint>, Vec<Option<usize>>) = (Vec::new(), Vec::new());
    while let Some(word) = words.next() {
        match word {
            "ROOT" | "JOINT" => {
                let parent = open.last().copied().flatten();
                let name = words.next().unwrap().to_owned();
                joints.push(Joint { name, parent, offset: Vector3::zeros(), channels: Vec::new() });
                open.push(Some(joints.len() - 1));
            }
            "End" => open.push(None),
            "{" | "Site" => {}
            "}" => drop(open.pop().unwrap()),
            "OFFSET" => {
                let offset = Vector3::from_fn(|_, _| number(&mut words));
                match open.last().unwrap() {
                    Some(joint) => joints[*joint].offset = offset,
                    None => assert!(offset.norm() > 0.01, "a bone has a length"),
                }
            }
            "CHANNELS" => {
                let count = number(&mut words) as usize;
                let joint = open.last().unwrap().unwrap();
                joints[joint].channels = (0..count).map(|_| words.next().unwrap().to_owned()).collect();
            }
            other => panic!("{other}"),
        }
    }
    assert!(open.is_empty());
    let mut lines = motion.trim().lines();
    let mut value =
        |name: &str| lines.next().unwrap().strip_prefix(name).unwrap().trim().parse::<f64>().unwrap();
    let (count, frame_time) = (value("Frames:") as usize, value("Frame Time:"));
    let numbers = |line: &str| line.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let frames: Vec<Vec<f64>> = lines.map(numbers).collect();
    assert_eq!(frames.len(), count);
    Bvh { joints, frame_time, frames }
}

fn poses(bvh: &Bvh, frame: &[f64]) -> BTreeMap<String, Isometry3<f64>> {
    let mut values = frame.iter();
    let mut poses: Vec<Isometry3<f64>> = Vec::new();
    for joint in &bvh.joints {
        let mut position = Vector3::zeros();
        let mut rotation = UnitQuaternion::identity();
        for channel in &joint.channels {
            let value = *values.next().unwrap();
            let axis = usize::from(channel.as_bytes()[0] - b'X');
            if channel.ends_with("position") {
                position[axis] = value;
            } else {
                let axis = Vector3::ith_axis(axis);
                rotation *= UnitQuaternion::from_axis_angle(&axis, value.to_radians());
            }
        }
        let local = Isometry3::from_parts(Translation3::from(joint.offset + position), rotation);
        poses.push(joint.parent.map_or(Isometry3::identity(), |parent| poses[parent]) * local);
    }
    assert!(values.next().is_none(), "a value for every channel");
    bvh.joints.iter().map(|joint| joint.name.clone()).zip(poses).collect()
}

#[test]
fn its_frames_are_the_link_poses() {
    for example in [Example::new(), Example::with_poses()] {
        for in_place in [false, true] {
            let options = ExportOptions { in_place, ..at(30.0) };
            let bvh = read(&String::from_utf8(example.export(ExportFormat::Bvh, options)).unwrap());
            let sampled = SampledMotion::new(&example.motion, example.character(), 30.0).unwrap();
            assert_eq!(bvh.frames.len(), sampled.cycle.frames.len());
            assert!((bvh.frame_time * (bvh.frames.len() - 1) as f64 - sampled.cycle.duration()).abs() < 1e-7);
            for (found, frame) in bvh.frames.iter().zip(&sampled.cycle.frames) {
                let found = poses(&bvh, found);
                let wanted = example.link_poses(&frame.placed_root(in_place), &frame.angles);
                for (link, wanted) in example.character().links.iter().zip(&wanted) {
                    let turned = Isometry3::from_parts(Translation3::identity(), y_up()) * wanted;
                    assert_near(&found[&link.name], &turned, 1e-6);
                }
            }
            if in_place {
                assert_eq!(bvh.frames.first(), bvh.frames.last());
            }
            // No angle jumps by a turn.
            for pair in bvh.frames.windows(2) {
                assert!(pair[0].iter().zip(&pair[1]).all(|(a, b)| (a - b).abs() < 90.0));
            }
        }
    }
}
