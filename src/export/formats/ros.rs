//! ROS 2 `trajectory_msgs/msg/JointTrajectory`, as YAML.

use std::fmt::Write;

use super::sampled::{MotionClip, SampledMotion};

/// One message for the entry, where there is one, and one for a cycle of the loop, as the YAML documents that
/// `ros2 topic pub --yaml-file` reads. Positions and velocities are the targets (rad or m, and per second) of the
/// joints that have an actuator; a controller that joins them by cubics moves as the motion says.
pub(super) fn write(sampled: &SampledMotion<'_>) -> String {
    let mut text = String::new();
    if let Some(entry) = &sampled.entry {
        text += "# From the standing pose to the start of the loop.\n";
        message(&mut text, sampled, entry);
        text += "---\n";
    }
    text += "# One cycle of the loop; it may be sent again whenever it has ended.\n";
    message(&mut text, sampled, &sampled.cycle);
    text
}

fn message(text: &mut String, sampled: &SampledMotion<'_>, clip: &MotionClip) {
    let driven: Vec<usize> =
        sampled.skeleton.movable().enumerate().filter(|(_, joint)| joint.driven).map(|(at, _)| at).collect();
    let names = driven.iter().map(|&joint| quoted(&sampled.joints()[joint]));
    text.push_str("header:\n  stamp: {sec: 0, nanosec: 0}\n  frame_id: ''\n");
    // Writing to a string cannot fail.
    let _ = writeln!(text, "joint_names: [{}]\npoints:", names.collect::<Vec<_>>().join(", "));
    for frame in &clip.frames {
        let list = |values: &[f64]| {
            driven.iter().map(|&joint| format!("{:?}", values[joint])).collect::<Vec<_>>().join(", ")
        };
        let nanoseconds = (frame.time * 1e9).round() as u64;
        let _ = writeln!(
            text,
            "- positions: [{}]\n  velocities: [{}]\n  time_from_start: {{sec: {}, nanosec: {}}}",
            list(&frame.targets),
            list(&frame.target_rates),
            nanoseconds / 1_000_000_000,
            nanoseconds % 1_000_000_000,
        );
    }
}

/// A string as YAML and JSON both read it.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
