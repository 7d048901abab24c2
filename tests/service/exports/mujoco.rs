//! MuJoCo: the model as text, and replayed by MuJoCo itself.

use std::process::Command;
use std::sync::Arc;

use gaitwright::export::{ExportFormat, SampledMotion, export};
use gaitwright_physics::character::{self, Options, Source};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::{Player, TargetLimits};
use gaitwright_physics::scene::{Accuracy, Effect, Feedforward, Scene};
use gaitwright_physics::sim::{Command as SimulatorCommand, Simulator, State};
use gaitwright_physics::stance::Stance;
use nalgebra::Vector3;
use serde_json::Value;

use super::{Example, at};
use crate::common;

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
    let entry = &sampled.entry.as_ref().unwrap().frames;
    let frames = entry[..entry.len() - 1].iter().chain(&sampled.cycle.frames);
    let times: Vec<f64> = all("key").map(|key| numbers(key, "time")[0]).collect();
    assert!(times[0] == 0.0 && times.windows(2).all(|pair| pair[0] < pair[1]), "{times:?}");
    let actuators: Vec<_> = all("position").collect();
    for (key, frame) in all("key").zip(frames.clone()) {
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
    assert_eq!(all("key").count(), frames.count());
}

/// A foot of no moments of inertia, which MuJoCo refuses, counts with the shank that it is fixed to; all others keep their own.
#[test]
fn inertias_that_mujoco_refuses_count_with_the_whole() {
    let example = Example::new();
    let mut character = example.character().clone();
    let foot = character.links.iter_mut().find(|link| link.name == "LF_foot").unwrap();
    foot.inertial.as_mut().unwrap().inertia.fill(0.0);
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let changed = Example { motion: example.motion.clone(), model };
    let given = |example: &Example| {
        let text = String::from_utf8(example.export(ExportFormat::Mujoco, at(60.0))).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let bodies = document.descendants().filter(|node| node.has_tag_name("body"));
        let named = bodies.map(|body| {
            let inertial = body.children().find(|child| child.has_tag_name("inertial"));
            let values = ["pos", "mass", "fullinertia"];
            let own = inertial.map(|inertial| values.map(|value| numbers(inertial, value)));
            (body.attribute("name").unwrap().to_owned(), own)
        });
        named.collect::<std::collections::BTreeMap<_, _>>()
    };
    let (before, after) = (given(&example), given(&changed));
    assert!(before["LF_foot"].is_some() && after["LF_foot"].is_none());
    let joined = after["LF_shank"].as_ref().unwrap();
    let [shank, foot] = ["LF_shank", "LF_foot"].map(|link| before[link].clone().unwrap());
    // The foot is 0.2 m below the knee: mass, centre of mass and the moments about it by Steiner's theorem.
    let (m, n) = (shank[1][0], foot[1][0]);
    let (a, b) = (shank[0][2], foot[0][2] - 0.2);
    let center = (m * a + n * b) / (m + n);
    let moment = shank[2][0] + m * (a - center).powi(2) + n * (b - center).powi(2);
    assert!((joined[1][0] - m - n).abs() < 1e-12);
    assert!((joined[0][2] - center).abs() < 1e-12);
    assert!((joined[2][0] - moment).abs() < 1e-12 && (joined[2][2] - shank[2][2]).abs() < 1e-12);
    let others = before.iter().filter(|(link, _)| !link.starts_with("LF_shank") && *link != "LF_foot");
    others.for_each(|(link, own)| assert_eq!(&after[link], own, "{link}"));
}

/// Replays the controls as the guide says, and prints angles and the state of the root in the end.
const REPLAY: &str = r#"
import json, sys
import numpy as np, mujoco
model = mujoco.MjModel.from_xml_path(sys.argv[1])
data = mujoco.MjData(model)
seconds = float(sys.argv[2])
mujoco.mj_resetDataKeyframe(model, data, 0)
begin, end = model.key("loop_0").time[0], model.key_time[-1]
upright, open = 1.0, 0.0
while data.time < seconds - 1e-9:
    t = data.time if data.time < end else begin + (data.time - begin) % (end - begin)
    data.ctrl[:] = [np.interp(t, model.key_time, model.key_ctrl[:, a]) for a in range(model.nu)]
    mujoco.mj_step(model, data)
    upright = min(upright, 1 - 2 * (data.qpos[4] ** 2 + data.qpos[5] ** 2))
    loops = data.efc_type[:data.nefc] == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    open = max(open, np.abs(data.efc_pos[:data.nefc][loops]).max(initial=0.0))
angles = {model.joint(j).name: data.joint(j).qpos[0] for j in range(1, model.njnt)}
print(json.dumps({"upright": upright, "open": open, "height": data.qpos[2], "angles": angles}))
"#;

fn replayed(example: &Example, seconds: f64) -> Value {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("walk.xml");
    std::fs::write(&path, example.export(ExportFormat::Mujoco, at(1000.0))).unwrap();
    let arguments = [path.to_str().unwrap(), &seconds.to_string()];
    let output = Command::new("python3").args(["-c", REPLAY]).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The bundled motion in MuJoCo, which is without its feedforward there: it stays upright.
#[test]
#[ignore = "needs MuJoCo: pip install mujoco numpy"]
fn mujoco_keeps_it_upright() {
    let found = replayed(&Example::new(), 5.0);
    assert!(found["upright"].as_f64().unwrap() > 0.8, "{found}");
    assert!(found["height"].as_f64().unwrap() > 0.15, "{found}");
}

/// Without ground both engines drive the same limbs with the same servos: after the entry and two cycles the
/// joints stand at the same angles.
#[test]
#[ignore = "needs MuJoCo: pip install mujoco numpy"]
fn mujoco_moves_the_joints_as_the_simulator_does() {
    const SECONDS: f64 = 0.5;
    let mut example = Example::new();
    example.motion.scene.ground = None;
    example.motion.drive.feedforward = Feedforward::None;
    let found = replayed(&example, SECONDS);
    let motion = &example.motion;
    let player =
        Player::new(motion, &example.model.joint_names, &TargetLimits::of(&example.model.character)).unwrap();
    let step = 1e-4;
    let accuracy = Accuracy { step, ..Accuracy::default() };
    let scene = Scene { ground: None, ..common::without(&[Effect::SelfCollision]) };
    let plan = common::plan(&example.model, &scene, &accuracy, Some(&motion.drive));
    let mut state = State::new(&example.model);
    player.targets(0.0, &mut state.angles);
    let mut simulator = Simulator::new(plan, state);
    let (mut now, mut next) = (vec![0.0; 12], vec![0.0; 12]);
    for index in 0..(SECONDS / step).round() as usize {
        player.targets(index as f64 * step, &mut now);
        player.targets((index + 1) as f64 * step, &mut next);
        simulator.step(SimulatorCommand::Track { now: &now, next: &next }).unwrap();
    }
    let start = &motion.entry[0].angles;
    for ((name, angle), start) in example.model.joint_names.iter().zip(&simulator.state().angles).zip(start) {
        let found = found["angles"][name].as_f64().unwrap();
        assert!((found - angle).abs() < 0.01, "{name}: {found}, {angle}; it began at {start}");
    }
}

/// The bundled pantograph, standing.
fn standing_pantograph() -> Example {
    let model = common::example("pantograph.json");
    let stance = Stance::find(&model, &Scene::default());
    let mut motion = Example::new().motion;
    motion.character.digest = model.character.digest.clone();
    motion.joints = model.joint_names.clone();
    motion.drive = stance.gains;
    motion.poses = None;
    motion.stances.clear();
    motion.cycle.root_advance.translation[2] = 0.0;
    for keyframe in motion.entry.iter_mut().chain(&mut motion.keyframes) {
        keyframe.angles = stance.angles.clone();
        keyframe.velocities = vec![0.0; stance.angles.len()];
        keyframe.root.position[2] = stance.root_height;
    }
    Example { motion, model }
}

#[test]
fn loops_are_closed_where_their_joints_are() {
    let example = standing_pantograph();
    let text = String::from_utf8(example.export(ExportFormat::Mujoco, at(60.0))).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let held: Vec<_> = document.descendants().filter(|node| node.has_tag_name("connect")).collect();
    let loops = &example.character().loops;
    assert_eq!(held.len(), 2 * loops.len());
    for (pair, closed) in held.chunks(2).zip(loops) {
        for (end, link) in ["body1", "body2"].iter().zip(closed.links) {
            let name = &example.character().links[link].name;
            assert!(pair.iter().all(|connect| connect.attribute(*end) == Some(name)));
        }
        let [first, second] = [0, 1].map(|index| Vector3::from_vec(numbers(pair[index], "anchor")));
        // The ankles turn about y, 0.014 m aside and 0.13 m below the knees.
        assert!((0.5 * (first + second) - Vector3::new(0.0, -0.014, -0.13)).norm() < 1e-12);
        assert!((second - first).cross(&Vector3::y()).norm() < 1e-12 && (second - first).norm() > 0.1);
    }
    // What slides cannot be held.
    let text = std::fs::read_to_string(common::example_path("pantograph.json")).unwrap();
    let mut document: Value = serde_json::from_str(&text).unwrap();
    let slide = document["loops"][2].as_object_mut().unwrap();
    slide["kind"] = "prismatic".into();
    slide.remove("origin_in_b");
    let reading = character::read(document.to_string().as_bytes(), Source::Json, Options::default()).unwrap();
    let mut motion = example.motion.clone();
    motion.character.digest = reading.character.digest.clone();
    let refused = export(&motion, &reading.character, ExportFormat::Mujoco, &at(60.0)).unwrap_err();
    assert!(refused.to_string().contains("hind_left_ankle"), "{refused}");
}

#[test]
#[ignore = "needs MuJoCo: pip install mujoco numpy"]
fn mujoco_keeps_loops_closed() {
    let found = replayed(&standing_pantograph(), 2.0);
    assert!(found["upright"].as_f64().unwrap() > 0.99 && found["height"].as_f64().unwrap() > 0.2, "{found}");
    // Under a quarter of the weight MuJoCo's soft constraints give way by less than a millimetre.
    assert!(found["open"].as_f64().unwrap() < 1e-3, "{found}");
}

/// MuJoCo has a body `world` of its own, and refuses two things of one kind with the same name.
#[test]
fn names_are_those_of_one_thing_only() {
    let mut example = Example::new();
    let text = std::fs::read_to_string(common::example_path("quadruped.urdf")).unwrap();
    let root = &example.character().links[0].name;
    let text = text.replace(&format!("\"{root}\""), "\"world\"").replace("\"LF_knee\"", "\"root\"");
    let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
    example.model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    example.motion.character.digest = example.character().digest.clone();
    for name in &mut example.motion.joints {
        if name == "LF_knee" {
            "root".clone_into(name);
        }
    }
    let text = String::from_utf8(example.export(ExportFormat::Mujoco, at(60.0))).unwrap();
    let document = roxmltree::Document::parse(&text).unwrap();
    let names = |tags: &[&str]| {
        let things = document.descendants().filter(|node| tags.contains(&node.tag_name().name()));
        things.filter_map(|node| node.attribute("name")).collect::<Vec<_>>()
    };
    let joints = names(&["joint", "freejoint"]);
    assert_eq!(joints.iter().filter(|name| **name == "root").count(), 1);
    assert_eq!(joints.iter().collect::<std::collections::BTreeSet<_>>().len(), joints.len());
    assert!(!names(&["body"]).contains(&"world"));
}

/// What stands at a shape is what holds in its contacts: the smaller friction of link and scene, and the scene's softness, which
/// MuJoCo divides by its greatest impedance of 0.95.
#[test]
fn shapes_have_the_friction_and_softness_of_their_contacts() {
    let mut example = Example::new();
    let text = std::fs::read_to_string(common::example_path("quadruped.urdf")).unwrap();
    let gazebo = |link: &str, friction: f64| {
        format!(r#"<gazebo reference="{link}"><mu1>{friction}</mu1><mu2>{friction}</mu2></gazebo>"#)
    };
    let (rough, smooth) = (gazebo("LF_shank", 2.0), gazebo("RH_shank", 0.1));
    let of = |more: &str| {
        let text = text.replace("</robot>", &format!("{more}</robot>"));
        let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
        Arc::new(Model::new(Arc::new(reading.character), Base::Floating))
    };
    example.model = of(&format!("{rough}{smooth}"));
    example.motion.character.digest = example.character().digest.clone();
    let scene = example.motion.scene.friction;
    assert!(0.1 < scene && scene < 2.0);
    for (time_constant, solref) in [(0.0, None), (0.019, Some(0.02))] {
        example.motion.scene.contact_time_constant = time_constant;
        let text = String::from_utf8(example.export(ExportFormat::Mujoco, at(60.0))).unwrap();
        let document = roxmltree::Document::parse(&text).unwrap();
        let shapes = document
            .descendants()
            .filter(|it| it.has_tag_name("geom"))
            .filter(|it| it.attribute("name").is_none());
        let mut found = Vec::new();
        for shape in shapes {
            let link = shape.parent().unwrap().attribute("name").unwrap();
            assert_eq!(shape.attribute("priority"), Some("1"));
            let wanted = if link == "RH_shank" { 0.1 } else { scene };
            assert_eq!(numbers(shape, "friction")[0], wanted, "{link}");
            let softness = shape.attribute("solref").map(|_| numbers(shape, "solref"));
            assert_eq!(softness.as_ref().map(|it| it[1]), solref.map(|_| 1.0));
            assert!(softness.is_none_or(|it| (it[0] - 0.02).abs() < 1e-12));
            found.push(link);
        }
        assert!(found.contains(&"RH_shank") && found.contains(&"LF_shank"), "{found:?}");
    }
    let grain = r#"<gazebo reference="LF_shank"><mu1>0.9</mu1><mu2>0.2</mu2><fdir1>1 0 0</fdir1></gazebo>"#;
    example.model = of(grain);
    example.motion.character.digest = example.character().digest.clone();
    let error = export(&example.motion, example.character(), ExportFormat::Mujoco, &at(60.0)).unwrap_err();
    let link = example.character().links.iter().position(|link| link.name == "LF_shank").unwrap();
    assert!(error.to_string().contains(&format!("/character/links/{link}/friction")), "{error}");
}
