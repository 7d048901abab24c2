//! MuJoCo: the model as text, and replayed by MuJoCo itself.

use std::process::Command;

use gaitwright::export::{ExportFormat, SampledMotion};
use serde_json::Value;

use super::{Example, at};

fn numbers(node: roxmltree::Node<'_, '_>, attribute: &str) -> Vec<f64> {
    node.attribute(attribute).unwrap().split(' ').map(|word| word.parse().unwrap()).collect()
}

#[test]
fn keys_hold_poses_and_controls() {
    let example = Example::with_poses();
    let text = String::from_utf8(example.export(ExportFormat::Mujoco, at(60.0))).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let all = |tag: &'static str| document.descendants().filter(move |node| node.has_tag_name(tag));
    assert_eq!(all("body").count(), example.character().links.len());
    let joints: Vec<&str> = all("joint").map(|joint| joint.attribute("name").unwrap()).collect();
    let mass: f64 = all("inertial").map(|inertial| numbers(inertial, "mass")[0]).sum();
    assert!((mass - example.character().mass()).abs() < 1e-9);
    let sampled = SampledMotion::new(&example.motion, example.character(), 60.0).unwrap();
    let frames = sampled.entry.iter().flat_map(|entry| &entry.frames).chain(&sampled.cycle.frames);
    let first = all("key").next().unwrap();
    assert_eq!(first.attribute("name"), Some("start"));
    let actuators: Vec<_> = all("position").collect();
    for (key, frame) in all("key").skip(1).zip(frames.clone()) {
        let state = numbers(key, "qpos");
        assert_eq!(state[0], frame.placed_root(false).translation.x);
        for (joint, angle) in joints.iter().zip(&state[7..]) {
            let own = sampled.joints().iter().position(|name| name == joint).unwrap();
            assert_eq!(*angle, frame.angles[own], "{joint}");
        }
        // A control is the target plus its rate times damping by stiffness.
        for (actuator, control) in actuators.iter().zip(numbers(key, "ctrl")) {
            let joint = actuator.attribute("joint").unwrap();
            let own = sampled.joints().iter().position(|name| name == joint).unwrap();
            let ahead = numbers(*actuator, "kv")[0] / numbers(*actuator, "kp")[0];
            assert!((control - frame.targets[own] - ahead * frame.target_rates[own]).abs() < 1e-9);
        }
    }
    assert_eq!(all("key").count(), 1 + frames.count());
}

/// Replays the controls as the file says, and measures the speed over ground.
const REPLAY: &str = r#"
import json, sys
import numpy as np, mujoco
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
seconds = float(sys.argv[2])
names = [model.key(k).name for k in range(model.nkey)]
times, controls = model.key_time[1:], model.key_ctrl[1:]
begin, end = model.key_time[names.index("loop_0")], model.key_time[-1]
mujoco.mj_resetDataKeyframe(model, data, names.index("start"))
# Two keys stand where the entry ends: the later one counts.
keep = np.append(np.diff(times) > 0, True)
times, controls = times[keep], controls[keep]
path = []
while data.time < seconds:
    t = data.time if data.time < end else begin + (data.time - begin) % (end - begin)
    data.ctrl[:] = [np.interp(t, times, controls[:, a]) for a in range(model.nu)]
    mujoco.mj_step(model, data)
    path.append([data.time, *data.qpos[:3], 1 - 2 * (data.qpos[4] ** 2 + data.qpos[5] ** 2)])
path = np.array(path)
loop = path[path[:, 0] >= begin]
speed = (loop[-1, 1] - loop[0, 1]) / (loop[-1, 0] - loop[0, 0])
print(json.dumps({"speed": speed, "lowest": loop[:, 3].min(), "upright": loop[:, 4].min(), "nq": model.nq}))
"#;

/// The bundled motion in MuJoCo, whose contacts are soft and which has no feedforward: upright, and forward.
#[test]
#[ignore = "needs MuJoCo: pip install mujoco numpy"]
fn mujoco_replays_it() {
    let example = Example::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.xml");
    std::fs::write(&path, example.export(ExportFormat::Mujoco, at(120.0))).unwrap();
    let output = Command::new("python3").args(["-c", REPLAY]).arg(&path).arg("5").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    let speed = found["speed"].as_f64().unwrap();
    assert!(found["upright"].as_f64().unwrap() > 0.8, "{found}");
    assert!((speed - example.motion.metrics.speed).abs() < 0.5 * example.motion.metrics.speed, "{found}");
}
