//! CSV and ROS 2 trajectories.

use gaitwright::export::{ExportFormat, SampledMotion};
use serde_json::Value;

use super::{Example, assert_near, at};

#[test]
fn csv_has_a_row_for_every_frame() {
    let example = Example::with_poses();
    let file = example.export(ExportFormat::Csv, at(60.0));
    let mut reader = csv::Reader::from_reader(&*file);
    let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    let column = |name: &str| names.iter().position(|other| other == name).unwrap();
    let value = |row: &csv::StringRecord, name: &str| row[column(name)].parse::<f64>().unwrap();
    let sampled = SampledMotion::new(&example.motion, example.character(), 60.0).unwrap();
    let entry = sampled.entry.as_ref().unwrap();
    assert_eq!(rows.len(), entry.frames.len() + sampled.cycle.frames.len());
    let clips = [("entry", &entry.frames, 0.0), ("loop", &sampled.cycle.frames, entry.duration())];
    let mut found = rows.iter();
    for (clip, frames, start) in clips {
        for frame in frames {
            let row = found.next().unwrap();
            assert_eq!(&row[0], clip);
            assert!((value(row, "time") - start - frame.time).abs() < 1e-12);
            let root = frame.placed_root(false);
            assert_eq!(value(row, "root_x"), root.translation.x);
            assert_eq!(value(row, "root_qw"), root.rotation.w);
            for (joint, (angle, target)) in
                sampled.joints().iter().zip(frame.angles.iter().zip(&frame.targets))
            {
                assert_eq!(value(row, joint), *angle);
                assert_eq!(value(row, &format!("{joint}_target")), *target);
            }
        }
    }
    // The travel of the loop is the motion's.
    let of_loop: Vec<_> = rows.iter().filter(|row| &row[0] == "loop").collect();
    let root = |row: &csv::StringRecord| {
        let [x, y, z, w, i, j, k] =
            ["x", "y", "z", "qw", "qx", "qy", "qz"].map(|part| value(row, &format!("root_{part}")));
        nalgebra::Isometry3::from_parts(
            nalgebra::Translation3::new(x, y, z),
            nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, i, j, k)),
        )
    };
    let [start, end] = example.ends();
    assert_near(&root(of_loop[0]), &start, 1e-6);
    assert_near(&root(of_loop[of_loop.len() - 1]), &end, 1e-6);
}

/// The numbers behind `key` in a line of the YAML, in flow style, which is JSON.
fn list(line: &str, key: &str) -> Value {
    serde_json::from_str(line.trim_start_matches("- ").trim().strip_prefix(key).unwrap().trim()).unwrap()
}

#[test]
fn a_ros_trajectory_holds_the_targets_and_their_rates() {
    let example = Example::with_poses();
    let text = String::from_utf8(example.export(ExportFormat::Ros, at(250.0 / 3.0))).unwrap();
    let messages: Vec<&str> = text.split("---\n").collect();
    assert_eq!(messages.len(), 2, "the entry and the loop");
    let motion = &example.motion;
    for (message, keyframes) in [(messages[0], &motion.entry), (messages[1], &motion.keyframes)] {
        let mut lines = message.lines().filter(|line| !line.starts_with('#'));
        let header: Vec<&str> = lines.by_ref().take(3).collect();
        assert_eq!(header, ["header:", "  stamp: {sec: 0, nanosec: 0}", "  frame_id: ''"]);
        assert_eq!(list(lines.next().unwrap(), "joint_names:"), serde_json::json!(motion.joints));
        assert_eq!(lines.next(), Some("points:"));
        let rest: Vec<&str> = lines.collect();
        let points: Vec<[&str; 3]> = rest.chunks(3).map(|point| point.try_into().unwrap()).collect();
        assert_eq!(points.len(), 15);
        // The keyframes lie on the first, the middle and the last point.
        for (point, keyframe) in [0, 7, 14].into_iter().zip(keyframes) {
            let [positions, velocities, time] = points[point];
            let near = |found: Value, wanted: &[f64]| {
                let found: Vec<f64> = serde_json::from_value(found).unwrap();
                assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {wanted:?}");
            };
            near(list(positions, "positions:"), &keyframe.angles);
            near(list(velocities, "velocities:"), &keyframe.velocities);
            let nanoseconds = (keyframe.time * 1e9).round() as u64;
            assert_eq!(time.trim(), format!("time_from_start: {{sec: 0, nanosec: {nanoseconds}}}"));
        }
    }
}
