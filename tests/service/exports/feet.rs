//! Feet that stand stand still in what is exported, and what was changed for it is told.
//!
//! The slide is measured on the rows of the exported table, by the simulator's own kinematics, and by the rule of a ball that
//! rolls: while it turns by φ its centre moves by φ × r z, and what it moves beyond that it slides.

use std::collections::BTreeMap;
use std::process::Command;
use std::sync::Arc;

use gaitwright::export::{ExportFormat, ExportOptions, export};
use gaitwright_physics::character::Shape;
use gaitwright_physics::model::Model;
use gaitwright_physics::motion::Motion;
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};
use tempfile::TempDir;

use super::Example;
use crate::common::{self, example_path};

/// Greatest slide of a standing foot over one stance, m.
const SLIDE: f64 = 1e-3;

/// Greatest distance of a standing foot from the ground, m.
const GAP: f64 = 2e-4;

/// Distance from the ground within which a foot of an exported entry stands on it, m: at twice that it has lifted off.
const GROUNDED: f64 = 1e-5;

pub(super) fn bundled(name: &str) -> Example {
    let motion = std::fs::read(example_path(&format!("quadruped-{name}.motion.json"))).unwrap();
    Example { motion: Motion::parse(&motion).unwrap(), model: common::example("quadruped.urdf") }
}

/// A foot of the exported loop: over each stance how far it slides, and how far it is off the ground at most.
struct Stood {
    link: String,
    slides: Vec<f64>,
    gap: f64,
}

/// The rows of the loop, or the entry, of an exported table: time, root and angles by the simulator's order.
fn rows(example: &Example, fps: f64, stretch: &str) -> Vec<(f64, Isometry3<f64>, Vec<f64>)> {
    let table = example.export(ExportFormat::Csv, ExportOptions { fps, in_place: false });
    let mut reader = csv::Reader::from_reader(&*table);
    let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let read = |row: &csv::StringRecord| {
        let value = |name: &str| {
            let column = names.iter().position(|other| other == name).unwrap();
            row[column].parse::<f64>().unwrap()
        };
        let [x, y, z, w, i, j, k] =
            ["x", "y", "z", "qw", "qx", "qy", "qz"].map(|p| value(&format!("root_{p}")));
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        let angles = example.model.joint_names.iter().map(|name| value(name)).collect();
        (value("time"), Isometry3::from_parts(Translation3::new(x, y, z), rotation), angles)
    };
    let of_stretch = reader.records().map(Result::unwrap).filter(|row| &row[0] == stretch);
    let mut rows: Vec<_> = of_stretch.map(|row| read(&row)).collect();
    let start = rows[0].0;
    rows.iter_mut().for_each(|row| row.0 -= start);
    rows
}

/// How the feet stand over two rounds of the exported loop, the seam in the middle.
fn stood(example: &Example, fps: f64) -> Vec<Stood> {
    let rows = rows(example, fps, "loop");
    let (first, last) = (&rows[0].1, &rows[rows.len() - 1].1);
    // From one round to the next.
    let onward = last * first.inverse();
    let period = example.motion.cycle.end - example.motion.cycle.start;
    let mut frames: Vec<(f64, Vec<Isometry3<f64>>)> = Vec::new();
    for round in 0..2 {
        for (time, root, angles) in &rows[..rows.len() - 1] {
            let root = if round == 1 { onward * root } else { *root };
            frames.push((time + f64::from(round) * period, example.link_poses(&root, angles)));
        }
    }
    let links = &example.character().links;
    let names: BTreeMap<&str, ()> = example.motion.stances.iter().map(|stance| (&*stance.link, ())).collect();
    let foot = |(name, ()): (&str, ())| {
        let index = links.iter().position(|link| link.name == name).unwrap();
        let ball = links[index].collisions.iter().find_map(|placed| match placed.shape {
            Shape::Sphere { radius } => Some((Point3::from(placed.pose.translation.vector), radius)),
            _ => None,
        });
        let (center, radius) = ball.expect("a foot is a ball here");
        let stands = |time: f64| {
            let time = time % period;
            let of_foot = example.motion.stances.iter().filter(|stance| stance.link == name);
            of_foot.into_iter().any(|stance| stance.start <= time && time <= stance.end)
        };
        let mut found = Stood { link: name.to_owned(), slides: vec![0.0], gap: 0.0 };
        for pair in frames.windows(2) {
            let [before, after] = [&pair[0], &pair[1]];
            if !(stands(before.0) && stands(after.0)) {
                found.slides.push(0.0);
                continue;
            }
            let turned = after.1[index].rotation * before.1[index].rotation.inverse();
            let moved = after.1[index] * center - before.1[index] * center;
            let slid = moved - turned.scaled_axis().cross(&(radius * Vector3::z()));
            *found.slides.last_mut().unwrap() += slid.xy().norm();
            found.gap = found.gap.max(((before.1[index] * center).z - radius).abs());
        }
        found
    };
    names.into_iter().map(foot).collect()
}

fn assert_stands(example: &Example, what: &str) {
    for fps in [30.0, 60.0, 500.0] {
        let feet = stood(example, fps);
        assert!(feet.len() >= 2, "{what}");
        for Stood { link, slides, gap } in feet {
            assert!(slides.iter().filter(|slide| **slide > 0.0).count() >= 2, "{what}: {link} stands twice");
            let worst = slides.iter().fold(0.0, |worst: f64, slide| worst.max(*slide));
            assert!(worst < SLIDE, "{what}, {fps} frames a second: {link} slides by {worst} m");
            assert!(gap < GAP, "{what}, {fps} frames a second: {link} is {gap} m off the ground");
        }
    }
}

#[test]
fn bundled_feet_stand_over_the_seam_too() {
    for name in ["walk", "trot"] {
        assert_stands(&bundled(name), name);
    }
}

/// On the way from the standing pose into the loop, too: a foot that is on the ground in two rows has not slid in between, and
/// where the entry ends it is where the loop has it.
#[test]
fn feet_of_an_entry_stand() {
    for name in ["walk", "trot"] {
        let example = bundled(name);
        let options = ExportOptions::default();
        let exported = export(&example.motion, example.character(), ExportFormat::Csv, &options).unwrap();
        let certificate = exported.certificate.unwrap().entry.unwrap();
        assert_eq!(certificate.feet.len(), 4, "{name}");
        for foot in &certificate.feet {
            assert!(foot.held && foot.slide.simulated > SLIDE, "{name}: {foot:?}");
            assert!(foot.slide.exported < SLIDE && foot.gap.exported < GAP, "{name}: {foot:?}");
        }
        assert!(certificate.held.angle < 0.2, "{name}: {certificate:?}");
        let links = &example.character().links;
        for fps in [60.0, 500.0] {
            let [entry, cycle] = ["entry", "loop"].map(|stretch| rows(&example, fps, stretch));
            let poses: Vec<_> = entry
                .iter()
                .chain(&cycle[..cycle.len() / 4])
                .map(|(_, root, angles)| example.link_poses(root, angles))
                .collect();
            for foot in &certificate.feet {
                let index = links.iter().position(|link| link.name == foot.link).unwrap();
                let ball = links[index].collisions.iter().find_map(|placed| match placed.shape {
                    Shape::Sphere { radius } => Some((Point3::from(placed.pose.translation.vector), radius)),
                    _ => None,
                });
                let (center, radius) = ball.unwrap();
                let (mut rows, mut slides) = (0, vec![0.0]);
                for pair in poses.windows(2) {
                    let [before, after] = [&pair[0][index], &pair[1][index]];
                    let down = |pose: &Isometry3<f64>| ((pose * center).z - radius).abs() < GROUNDED;
                    if !(down(before) && down(after)) {
                        slides.push(0.0);
                        continue;
                    }
                    let turned = after.rotation * before.rotation.inverse();
                    let moved = after * center - before * center;
                    let slid = moved - turned.scaled_axis().cross(&(radius * Vector3::z()));
                    *slides.last_mut().unwrap() += slid.xy().norm();
                    rows += 1;
                }
                let worst = slides.iter().fold(0.0, |worst: f64, slide| worst.max(*slide));
                assert!(worst < SLIDE, "{name}, {fps} frames a second: {} slides by {worst} m", foot.link);
                assert!(rows > 5, "{name}, {fps} frames a second: {} is down in {rows} rows", foot.link);
            }
        }
    }
}

/// A root that sways and bobs although the feet stood drags them along by what it sways; they are held all the same, and
/// the certificate tells by how much they slid.
#[test]
fn feet_that_slide_are_held() {
    let mut example = bundled("trot");
    let period = example.motion.cycle.end;
    for pose in example.motion.poses.as_mut().unwrap() {
        let angle = std::f64::consts::TAU * pose.time / period;
        pose.root.position[0] += 0.004 * angle.sin();
        pose.root.position[1] += 0.003 * angle.cos();
        pose.root.position[2] += 0.002 * (2.0 * angle).sin();
    }
    assert_stands(&example, "a trot that sways");
    let exported =
        export(&example.motion, example.character(), ExportFormat::Glb, &ExportOptions::default()).unwrap();
    let certificate = exported.certificate.unwrap();
    assert_eq!(certificate.feet.len(), 4);
    for foot in &certificate.feet {
        assert!(foot.held && foot.stances == 1, "{foot:?}");
        // Half a round of the sway is at least as long as its chord.
        assert!(foot.slide.simulated > 0.005 && foot.gap.simulated > 0.001, "{foot:?}");
        assert!(foot.slide.exported < SLIDE && foot.gap.exported < GAP, "{foot:?}");
    }
    assert!(certificate.held.angle > 0.005 && certificate.held.angle < 0.2, "{:?}", certificate.held);
    // In the file as well.
    let file = gltf::Gltf::from_slice(&exported.file).unwrap();
    let extras = file.animations().next().unwrap().extras().clone().unwrap();
    let extras: serde_json::Value = serde_json::from_str(extras.get()).unwrap();
    let told = &extras["certificate"]["feet"][0];
    assert_eq!(told["link"], certificate.feet[0].link.as_str());
    assert_eq!(told["slide"]["simulated"].as_f64(), Some(certificate.feet[0].slide.simulated));
}

/// Targets are for controllers, and stay as they were learned.
#[test]
fn targets_stay_as_they_are() {
    let example = bundled("walk");
    let mut silent = bundled("walk");
    silent.motion.stances.clear();
    let ros = |example: &Example| example.export(ExportFormat::Ros, ExportOptions::default());
    assert_eq!(ros(&example), ros(&silent));
    let controls = |example: &Example| {
        let text = String::from_utf8(example.export(ExportFormat::Mujoco, ExportOptions::default())).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let keys = document.descendants().filter(|node| node.has_tag_name("key"));
        keys.map(|key| key.attribute("ctrl").unwrap().to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(controls(&example), controls(&silent));
}

/// A foot that is dragged over the ground does so in the simulation, and is left.
#[test]
fn a_foot_that_is_dragged_is_left() {
    let mut example = bundled("trot");
    // The swinging feet count as standing for a time of their own.
    for stance in &mut example.motion.stances {
        (stance.start, stance.end) = (0.0, example.motion.cycle.end);
    }
    let exported =
        export(&example.motion, example.character(), ExportFormat::Csv, &ExportOptions::default()).unwrap();
    let certificate = exported.certificate.unwrap();
    assert!(certificate.feet.iter().all(|foot| !foot.held), "{certificate:?}");
    assert_eq!(certificate.held.angle, 0.0);
    for foot in &certificate.feet {
        assert_eq!(foot.slide.simulated, foot.slide.exported);
    }
}

/// Motions as they are learned: of a leg of three joints, and of one whose chain is closed and that cannot move sideways.
#[test]
fn learned_feet_stand() {
    let learned = [("quadruped.urdf", r#"{"gait": "trot", "froude": 0.4}"#), ("pantograph.json", "{}")];
    for (name, task) in learned {
        let folder = TempDir::new().unwrap();
        let job = format!(r#"{{"task": {task}, "seed": 1, "learning": {{"generations": 4}}}}"#);
        std::fs::write(folder.path().join("job.json"), job).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_gaitwright"));
        command.current_dir(folder.path()).arg("train").arg(example_path(name));
        let output = command.args(["--job", "job.json", "--out", "out"]).output().unwrap();
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        let motion = Motion::parse(&std::fs::read(folder.path().join("out/motion.json")).unwrap()).unwrap();
        assert!(!motion.stances.is_empty(), "{name}");
        let model: Arc<Model> = common::example(name);
        let exported =
            export(&motion, &model.character, ExportFormat::Csv, &ExportOptions::default()).unwrap();
        let certificate = exported.certificate.unwrap();
        let held: Vec<_> = certificate.feet.iter().filter(|foot| foot.held).collect();
        assert!(held.len() >= 2, "{name}: {certificate:?}");
        for foot in held {
            assert!(foot.slide.exported < SLIDE && foot.gap.exported < GAP, "{name}: {foot:?}");
        }
        if name == "quadruped.urdf" {
            assert_stands(&Example { motion, model }, name);
        }
    }
}
