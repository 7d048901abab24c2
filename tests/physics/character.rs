//! Characters read from URDF, JSON and zip archives: what is understood, repaired, approximated.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::common::example_path;
use gaitwright_physics::character::{
    self, About, Character, JointKind, Note, NoteKind, Options, Placed, Reading, Shape, Source,
};
use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use proptest::prelude::*;

const STRICT: Options = Options { strict: true };

fn read_urdf(text: &str) -> Reading {
    character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap()
}

fn read_json(document: &serde_json::Value) -> Reading {
    character::read(document.to_string().as_bytes(), Source::Json, Options::default()).unwrap()
}

/// A robot from elsewhere, by its file's name.
fn robot(name: &str) -> Reading {
    let path = crate::common::robots().join(format!("{name}.urdf"));
    character::read_file(&path, Options::default())
        .unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn examples() -> Vec<PathBuf> {
    ["quadruped.urdf", "hexapod.json", "biped.urdf", "snake.json"].map(example_path).to_vec()
}

/// Everything that the documentation of `Character` promises.
fn assert_invariants(character: &Character) {
    assert!(!character.links.is_empty());
    let mut bodies: Vec<(usize, Isometry3<f64>)> = Vec::new();
    for (index, link) in character.links.iter().enumerate() {
        assert_eq!(link.joint.is_none(), index == 0, "only the root has no joint");
        assert!(character.links[..index].iter().all(|other| other.name != link.name));
        let mut body = (index, Isometry3::identity());
        if let Some(joint) = &link.joint {
            assert!(joint.parent < index);
            assert!((joint.axis.norm() - 1.0).abs() < 1e-12);
            assert!(joint.origin.to_matrix().iter().all(|x| x.is_finite()));
            assert!(joint.limits.is_none_or(|limits| limits.lower < limits.upper));
            assert!(joint.effort.is_none_or(|effort| effort > 0.0 && effort.is_finite()));
            assert!(joint.velocity.is_none_or(|velocity| velocity > 0.0 && velocity.is_finite()));
            for loss in [joint.damping, joint.friction, joint.armature] {
                assert!(loss >= 0.0 && loss.is_finite());
            }
            let earlier = character.links[..index].iter().filter_map(|link| link.joint.as_ref());
            assert!(earlier.into_iter().all(|other| other.name != joint.name));
            if joint.kind == JointKind::Fixed {
                let (first, pose) = bodies[joint.parent];
                body = (first, pose * joint.origin);
            }
        }
        bodies.push(body);
    }
    for first in 0..character.links.len() {
        if bodies[first].0 == first {
            let (mut mass, mut moment, mut about_origin) = (0.0, Vector3::zeros(), Matrix3::zeros());
            for (link, (body, pose)) in character.links.iter().zip(&bodies) {
                let Some(inertial) = link.inertial.as_ref().filter(|_| *body == first) else { continue };
                assert!(inertial.mass >= 0.0 && inertial.mass.is_finite());
                let center = (pose * inertial.center_of_mass).coords;
                let rotation = pose.rotation.to_rotation_matrix();
                mass += inertial.mass;
                moment += center * inertial.mass;
                about_origin +=
                    rotation * inertial.inertia * rotation.transpose() + steiner(inertial.mass, center);
            }
            assert!(mass > 0.0, "{} has no mass", character.links[first].name);
            let inertia = about_origin - steiner(mass, moment / mass);
            assert!(inertia.iter().all(|x| x.is_finite()));
            assert!(inertia.symmetric_eigenvalues().min() > 0.0, "{}", character.links[first].name);
        }
    }
}

fn steiner(mass: f64, offset: Vector3<f64>) -> Matrix3<f64> {
    (Matrix3::identity() * offset.norm_squared() - offset * offset.transpose()) * mass
}

fn of_kind(notes: &[Note], kind: NoteKind) -> Vec<String> {
    let mut names: Vec<String> = notes
        .iter()
        .filter(|note| note.kind == kind)
        .map(|note| match &note.about {
            About::Link(name) | About::Joint(name) | About::Character(name) => name.clone(),
        })
        .collect();
    names.sort();
    names
}

fn links_with(legs: [&str; 4], part: &str) -> Vec<String> {
    let mut names = legs.map(|leg| format!("{leg}_{part}")).to_vec();
    names.sort();
    names
}

/// A file keeps the promises of the documentation, and is the same without the folder that it lies in.
fn assert_loads(path: &Path) {
    let reading = character::read_file(path, Options::default()).unwrap();
    assert_invariants(&reading.character);
    let bytes = fs::read(path).unwrap();
    let again = character::read(&bytes, Source::detect(&bytes).unwrap(), Options::default()).unwrap();
    assert_eq!(again.character, reading.character, "meshes beside {} change it", path.display());
    assert!(reading.character.digest.starts_with("sha256:") && reading.character.digest.len() == 71);
}

#[test]
fn every_example_loads_and_keeps_the_promises() {
    for name in ["fourbar.json", "pantograph.json"] {
        assert_loads(&example_path(name));
    }
    for path in examples() {
        assert_loads(&path);
    }
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn every_robot_loads_and_keeps_the_promises() {
    for path in crate::common::urdf_files(&crate::common::robots()) {
        assert_loads(&path);
    }
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn masses_of_robots_are_those_of_their_makers() {
    for (name, mass) in [("a1", 13.741), ("anymal_b", 30.475), ("quadruped", 2.772), ("bolt", 1.254)] {
        let found = robot(name).character.mass();
        assert!((found - mass).abs() < 5e-4, "{name} weighs {found} kg");
    }
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn a1_has_only_harmless_notes() {
    let Reading { character, notes } = robot("a1");
    assert_eq!(character.links.len(), 23);
    // 13 visual meshes, and five links without mass that others carry.
    assert_eq!(of_kind(&notes, NoteKind::Ignored).len(), 18);
    assert_eq!(notes.len(), 18);
    let legs = ["FR", "FL", "RR", "RL"];
    let massless: Vec<_> =
        character.links.iter().filter(|link| link.inertial.is_none()).map(|link| link.name.clone()).collect();
    let mut expected = links_with(legs, "thigh_shoulder");
    expected.insert(0, "base".into());
    let mut massless_sorted = massless;
    massless_sorted.sort_by_key(|name| (name != "base", name.clone()));
    assert_eq!(massless_sorted, expected);
    // A leg's links follow each other.
    let leg: Vec<_> =
        character.links.iter().map(|link| &link.name[..2]).filter(|leg| legs.contains(leg)).collect();
    assert_eq!(leg, legs.into_iter().flat_map(|leg| [leg; 5]).collect::<Vec<_>>());
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn anymal_keeps_the_singular_inertia_of_its_base() {
    let Reading { character, notes } = robot("anymal_b");
    assert_eq!(of_kind(&notes, NoteKind::Kept), ["base"]);
    assert_eq!(of_kind(&notes, NoteKind::Ignored).len(), 17 + 3, "17 visuals, <kp>, <kd>, <contact>");
    assert_eq!(notes.len(), 21);
    assert_eq!(character.links[0].inertial.as_ref().unwrap().inertia, Matrix3::repeat(1e-6));
    assert_eq!(character.links.iter().map(|link| link.collisions.len()).sum::<usize>(), 41);
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn quadruped_has_unlimited_knees_and_point_feet() {
    let Reading { character, notes } = robot("quadruped");
    let legs = ["FL", "FR", "BL", "BR"];
    assert_eq!(of_kind(&notes, NoteKind::Repaired), links_with(legs, "KFE"));
    assert_eq!(of_kind(&notes, NoteKind::Kept), links_with(legs, "contact"));
    assert_eq!(of_kind(&notes, NoteKind::Ignored).len(), 13 + 1, "13 visuals, <contact>");
    assert_eq!(notes.len(), 22);
    for link in &character.links[1..] {
        let joint = link.joint.as_ref().unwrap();
        assert_eq!(joint.limits.is_some(), joint.name.ends_with("HFE"));
    }
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn double_pendulum_has_joints_without_bounds() {
    let Reading { character, notes } = robot("double_pendulum");
    // Range, effort and velocity of each.
    let joints = ["joint1", "joint1", "joint1", "joint2", "joint2", "joint2"];
    assert_eq!(of_kind(&notes, NoteKind::Repaired), joints);
    assert_eq!(of_kind(&notes, NoteKind::Ignored), ["link3"]);
    assert_eq!(notes.len(), 7);
    assert!(character.links[3].inertial.is_none());
    assert_eq!(character.links[1].joint.as_ref().unwrap().damping, 0.05);
}

/// The lowest point of a link's collision shapes with every joint at 0, in the root's frame, m.
fn lowest(character: &Character, link: usize) -> f64 {
    let mut pose = Isometry3::identity();
    let mut at = link;
    while let Some(joint) = &character.links[at].joint {
        pose = joint.origin * pose;
        at = joint.parent;
    }
    let down = |placed: &Placed| {
        let shape = pose * placed.pose;
        let local = shape.rotation.inverse() * Vector3::z();
        let reach = match &placed.shape {
            Shape::Sphere { radius } => *radius,
            Shape::Box { half_extents } => half_extents.dot(&local.abs()),
            other => panic!("no stand-in is {other:?}"),
        };
        shape.translation.z - reach
    };
    character.links[link].collisions.iter().map(down).fold(f64::INFINITY, f64::min)
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn bolt_gets_shapes_it_can_stand_on() {
    let Reading { character, notes } = robot("bolt");
    let mut all: Vec<_> = character.links.iter().map(|link| link.name.clone()).collect();
    all.sort();
    assert_eq!(of_kind(&notes, NoteKind::Approximated), all, "every link's mesh is missing");
    assert_eq!(of_kind(&notes, NoteKind::Ignored).len(), 9 + 1, "visuals, <contact>");
    assert_eq!(of_kind(&notes, NoteKind::Kept), ["FL_FOOT", "FR_FOOT"], "an inertia without a mass");
    let named = |name: &str| character.links.iter().position(|link| link.name == name).unwrap();
    let feet = [named("FL_FOOT"), named("FR_FOOT")];
    for foot in feet {
        let [Placed { shape: Shape::Sphere { radius }, .. }] = &character.links[foot].collisions[..] else {
            panic!("a foot is a ball");
        };
        assert!((0.015..0.03).contains(radius), "the foot of a 0.2 m shank has {radius} m");
        let others = (0..character.links.len()).filter(|link| !feet.contains(link));
        let rest = others.map(|link| lowest(&character, link)).fold(f64::INFINITY, f64::min);
        assert!(lowest(&character, foot) < rest - 0.005, "the feet touch the ground first");
    }
    assert!((lowest(&character, feet[0]) - lowest(&character, feet[1])).abs() < 1e-9);
}

#[test]
fn examples_are_free_of_notes_and_sound() {
    let expected =
        [("quadruped", 17, 12, 12.0), ("hexapod", 19, 18, 3.0), ("biped", 9, 8, 8.0), ("snake", 12, 11, 3.0)];
    for (path, (name, links, movable, mass)) in examples().into_iter().zip(expected) {
        let Reading { character, notes } = character::read_file(&path, STRICT).unwrap();
        assert_eq!((character.name.as_str(), notes), (name, vec![]));
        assert_invariants(&character);
        let joints = character.links.iter().filter_map(|link| link.joint.as_ref());
        let moving: Vec<_> = joints.filter(|joint| joint.kind != JointKind::Fixed).collect();
        assert_eq!((character.links.len(), moving.len()), (links, movable));
        assert!(moving.iter().all(|joint| joint.effort.is_some() && joint.limits.is_some()));
        assert!((character.mass() - mass).abs() < 0.1 * mass, "{name} weighs {} kg", character.mass());
    }
}

const ARM_URDF: &str = r#"<robot name="arm">
  <link name="base"><inertial><mass value="2"/><inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="0" iyz="0"/>
    </inertial><collision><geometry><box size="0.1 0.2 0.3"/></geometry><origin xyz="0 0 0.1"/></collision></link>
  <link name="rod"><inertial><origin xyz="0.1 0 0"/><mass value="0.5"/>
    <inertia ixx="0.001" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0.1 0 0" rpy="0 1.5 0"/><geometry><capsule radius="0.02" length="0.15"/></geometry></collision></link>
  <link name="tip"><inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><sphere radius="0.03"/></geometry></collision></link>
  <link name="slide"><inertial><mass value="0.2"/><inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><cylinder radius="0.03" length="0.04"/></geometry></collision></link>
  <joint name="swing" type="revolute"><parent link="base"/><child link="rod"/><origin xyz="0 0 0.2" rpy="0.1 0.2 0.3"/>
    <axis xyz="0 2 0"/><limit lower="-1" upper="2" effort="5" velocity="6"/><dynamics damping="0.1" friction="0.2"/></joint>
  <joint name="wrist" type="fixed"><parent link="rod"/><child link="tip"/><origin xyz="0.2 0 0"/></joint>
  <joint name="piston" type="prismatic"><parent link="base"/><child link="slide"/><origin xyz="0 0 -0.1"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.1" effort="50" velocity="1"/></joint>
</robot>"#;

#[test]
fn urdf_and_json_of_one_character_are_equal() {
    let json = serde_json::json!({
        "format": "gaitwright/character@1", "name": "arm",
        "links": [
            {"name": "base", "mass": 2.0, "inertia": {"xx": 0.02, "yy": 0.03, "zz": 0.04, "xy": 0.001},
             "shapes": [{"kind": "box", "size": [0.1, 0.2, 0.3], "pose": {"position": [0, 0, 0.1]}}]},
            {"name": "slide", "mass": 0.2, "inertia": {"xx": 1e-4, "yy": 1e-4, "zz": 1e-4},
             "shapes": [{"kind": "cylinder", "radius": 0.03, "length": 0.04}]},
            {"name": "tip", "mass": 0.1, "inertia": {"xx": 1e-4, "yy": 1e-4, "zz": 1e-4},
             "shapes": [{"kind": "sphere", "radius": 0.03}]},
            {"name": "rod", "mass": 0.5, "center_of_mass": [0.1, 0, 0],
             "inertia": {"xx": 0.001, "yy": 0.002, "zz": 0.002},
             "shapes": [{"kind": "capsule", "radius": 0.02, "length": 0.15,
                         "pose": {"position": [0.1, 0, 0], "rpy": [0, 1.5, 0]}}]}
        ],
        "joints": [
            {"name": "swing", "kind": "revolute", "parent": "base", "child": "rod",
             "origin": {"position": [0, 0, 0.2], "rpy": [0.1, 0.2, 0.3]}, "axis": [0, 1, 0],
             "limits": {"lower": -1, "upper": 2}, "actuation": {"max_torque": 5, "max_speed": 6},
             "damping": 0.1, "friction": 0.2},
            {"name": "wrist", "kind": "fixed", "parent": "rod", "child": "tip",
             "origin": {"position": [0.2, 0, 0]}},
            {"name": "piston", "kind": "prismatic", "parent": "base", "child": "slide",
             "origin": {"position": [0, 0, -0.1]}, "axis": [0, 0, 1],
             "limits": {"lower": 0, "upper": 0.1}, "actuation": {"max_torque": 50, "max_speed": 1}}
        ]
    });
    let (urdf, json) = (read_urdf(ARM_URDF), read_json(&json));
    assert_eq!((&urdf.notes[..], &json.notes[..]), (&[][..], &[][..]));
    let json = Character { digest: urdf.character.digest.clone(), embedded_digest: None, ..json.character };
    assert_eq!(urdf.character, json);
    let names: Vec<_> = json.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["base", "rod", "tip", "slide"], "depth first in the order of the joints");
}

#[test]
fn roll_pitch_yaw_turn_about_fixed_axes() {
    let reading = read_urdf(ARM_URDF);
    let origin = reading.character.links[1].joint.as_ref().unwrap().origin;
    let turn = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
    let expected = turn(Vector3::z_axis(), 0.3) * turn(Vector3::y_axis(), 0.2) * turn(Vector3::x_axis(), 0.1);
    assert!(origin.rotation.angle_to(&expected) < 1e-12);
}

#[test]
fn a_namespace_of_the_document_is_accepted_and_extensions_are_left_out() {
    let text = ARM_URDF
        .replace("<robot ", "<robot xmlns=\"http://www.ros.org\" xmlns:drake=\"http://drake.mit.edu\" ")
        .replace("</robot>", "<drake:joint name=\"loop\" type=\"ball\"/></robot>");
    let reading = read_urdf(&text);
    assert_eq!(reading.character.links, read_urdf(ARM_URDF).character.links);
    let [note] = &reading.notes[..] else { panic!("{:?}", reading.notes) };
    assert_eq!(note.kind, NoteKind::Ignored);
}

#[test]
fn a_standing_pose_is_kept_in_the_order_of_the_links() {
    let mut document: serde_json::Value = serde_json::from_slice(&fs::read(&examples()[1]).unwrap()).unwrap();
    document["standing"] = serde_json::json!({"RF_yaw": 0.1, "LF_knee": -0.2, "LF_yaw": 0.3});
    let standing = read_json(&document).character.standing.unwrap();
    let expected = [("LF_yaw", 0.3), ("LF_knee", -0.2), ("RF_yaw", 0.1)];
    assert_eq!(standing, expected.map(|(name, angle)| (name.to_owned(), angle)));
}

/// `ARM_URDF` with another inertial for the link at its end.
fn arm_with_tip(inertial: &str) -> String {
    let tip = "<inertial><mass value=\"0.1\"/><inertia ixx=\"1e-4\" iyy=\"1e-4\" izz=\"1e-4\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>\n    <collision><geometry><sphere";
    assert!(ARM_URDF.contains(tip));
    ARM_URDF.replace(tip, &format!("{inertial}\n    <collision><geometry><sphere"))
}

#[test]
fn a_massless_link_is_carried_or_given_the_least_inertia() {
    let carried = read_urdf(&arm_with_tip(""));
    assert!(carried.character.links[2].inertial.is_none());
    assert_eq!(of_kind(&carried.notes, NoteKind::Ignored), ["tip"]);

    let moving = arm_with_tip("")
        .replace(r#"<joint name="wrist" type="fixed">"#, r#"<joint name="wrist" type="continuous">"#);
    let moving = read_urdf(&moving);
    assert_eq!(of_kind(&moving.notes, NoteKind::Repaired), ["tip"]);
    assert_invariants(&moving.character);
    let least = moving.character.links[2].inertial.as_ref().unwrap();
    let total = moving.character.mass();
    assert!(least.mass < 1e-4 * total, "the mass added does not matter");
    // The joint-space inertia of the arm is at most its mass times the square of its size, 0.5 m.
    let condition = total * 0.25 / least.inertia.symmetric_eigenvalues().min();
    assert!(condition < 1e9, "the mass matrix has a condition number of up to {condition:e}");

    // A rotor whose mass is counted elsewhere turns as hard as it was said to.
    let rotor = r#"<inertial><mass value="0"/><inertia ixx="0.1" iyy="0.2" izz="0.3" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    let turning = arm_with_tip(rotor)
        .replace(r#"<joint name="wrist" type="fixed">"#, r#"<joint name="wrist" type="continuous">"#);
    let turning = read_urdf(&turning);
    assert_eq!(of_kind(&turning.notes, NoteKind::Repaired), ["tip"]);
    assert_invariants(&turning.character);
    let kept = turning.character.links[2].inertial.as_ref().unwrap();
    assert!(kept.mass > 0.0 && kept.mass < 1e-4 * turning.character.mass());
    assert_eq!(kept.inertia, Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.3)));
}

#[test]
fn an_impossible_inertia_is_mended_by_the_shapes_or_a_ball() {
    // A ball of 0.1 kg and 3 cm radius: 2/5 m r².
    let ball = 0.4 * 0.1 * 0.03 * 0.03;
    let free =
        |text: String| text.replace(r#"name="wrist" type="fixed""#, r#"name="wrist" type="continuous""#);
    for moments in [[0.0, 0.0, 0.0], [1e-4, 1e-4, -1e-4], [0.0, 1e-4, 1e-4]] {
        let [x, y, z] = moments;
        let inertial = format!(
            r#"<inertial><mass value="0.1"/><inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>"#
        );
        let reading = read_urdf(&free(arm_with_tip(&inertial)));
        assert_eq!(of_kind(&reading.notes, NoteKind::Repaired), ["tip"], "{moments:?}");
        let found = reading.character.links[2].inertial.as_ref().unwrap().inertia;
        assert!((found - Matrix3::identity() * ball).norm() < 1e-12, "{moments:?}");
    }
    let bare = r#"<inertial><mass value="0.1"/></inertial>"#;
    let sphere = "<collision><geometry><sphere radius=\"0.03\"/></geometry></collision>";
    let reading = read_urdf(&free(arm_with_tip(bare)).replace(sphere, ""));
    assert_eq!(of_kind(&reading.notes, NoteKind::Repaired), ["tip"]);
    // A ball of water of 0.1 kg has a radius of 28.79 mm.
    let found = reading.character.links[2].inertial.as_ref().unwrap().inertia;
    assert!((found - Matrix3::identity() * (0.04 * 0.02879_f64.powi(2))).norm() < 1e-3 * found.norm());
}

#[test]
fn a_broken_triangle_inequality_is_kept_and_noted() {
    let inertial = r#"<inertial><mass value="0.1"/><inertia ixx="1e-4" iyy="1e-4" izz="3e-4" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    let text = arm_with_tip(inertial);
    let reading = read_urdf(&text);
    assert_eq!(of_kind(&reading.notes, NoteKind::Kept), ["tip"]);
    let kept = reading.character.links[2].inertial.as_ref().unwrap().inertia;
    assert_eq!(kept, Matrix3::from_diagonal(&Vector3::new(1e-4, 1e-4, 3e-4)));
    let strict = character::read(text.as_bytes(), Source::Urdf, STRICT).unwrap_err();
    assert_eq!(strict.faults().len(), 1);
    assert!(strict.faults()[0].reason.contains("triangle inequality"));
    assert!(strict.faults()[0].pointer.contains("line 7, link \"tip\""), "{}", strict.faults()[0].pointer);
}

#[test]
fn a_missing_mesh_is_replaced_by_the_box_of_the_same_inertia() {
    // The tip is a box of 0.06 x 0.08 x 0.1 m and 0.1 kg about a point away from its joint.
    let (m, a, b, c) = (0.1, 0.06_f64, 0.08_f64, 0.1_f64);
    let moment = |p: f64, q: f64| m / 12.0 * (p * p + q * q);
    let (x, y, z) = (moment(b, c), moment(a, c), moment(a, b));
    let inertial = format!(
        r#"<inertial><origin xyz="0 0 -0.3"/><mass value="{m}"/><inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>"#
    );
    let text = arm_with_tip(&inertial)
        .replace(r#"<sphere radius="0.03"/>"#, r#"<mesh filename="package://arm/tip.stl"/>"#)
        .replace(r#"name="wrist" type="fixed""#, r#"name="wrist" type="continuous""#);
    let Reading { character, notes } = read_urdf(&text);
    assert_eq!(of_kind(&notes, NoteKind::Approximated), ["tip"]);
    let [fitted, foot] = &character.links[2].collisions[..] else { panic!("a box and a foot") };
    let Shape::Box { half_extents } = fitted.shape else { panic!("a box") };
    let turned = (fitted.pose.rotation * half_extents).abs();
    assert!((turned - Vector3::new(a, b, c) * 0.45).norm() < 1e-9, "nine tenths of the box, {turned}");
    let Shape::Sphere { radius } = foot.shape else { panic!("a ball") };
    // The box ends 0.3 + 0.045 m below the joint.
    assert!((foot.pose.translation.vector - Vector3::new(0.0, 0.0, -0.345)).norm() < 1e-9);
    assert!((radius - 0.0345).abs() < 1e-9);
}

#[test]
fn the_form_is_recognised_by_its_beginning() {
    assert_eq!(Source::detect(b"\xef\xbb\xbf \n<robot/>"), Some(Source::Urdf));
    assert_eq!(Source::detect(b"  {}"), Some(Source::Json));
    assert_eq!(Source::detect(b"PK\x03\x04"), Some(Source::Zip));
    assert_eq!(Source::detect(b"solid"), None);
    assert_eq!(Source::detect(b""), None);
}

#[test]
fn the_digest_is_the_sha_256_of_the_bytes() {
    let document = r#"{"format":"gaitwright/character@1","name":"x","links":[{"name":"a","density":1,"shapes":[{"kind":"sphere","radius":1}]}]}"#;
    let reading = character::read(document.as_bytes(), Source::Json, STRICT).unwrap();
    // sha256sum of the same bytes.
    let expected = "sha256:181ab946d2c77733c3798b879f20b13ac220aefcfa6a65907a8ad5af0e56147d";
    assert_eq!(reading.character.digest, expected);
}

/// A job's document holds a character as JSON that was read and written again, the motion it learns names that, and
/// belongs to the file all the same.
#[test]
fn a_json_document_is_known_by_its_digest_within_another_one_too() {
    let spaced = r#"{ "name": "x", "format": "gaitwright/character@1",
        "links": [{"shapes": [{"kind": "sphere", "radius": 1.0}], "name": "a", "density": 0.1}]}"#;
    let other = spaced.replace("0.1}", "0.2}");
    let [file, other] = [spaced, &other]
        .map(|text| character::read(text.as_bytes(), Source::Json, STRICT).unwrap().character);
    let fields: serde_json::Value = serde_json::from_str(spaced).unwrap();
    let embedded = serde_json::to_vec(&fields).unwrap();
    let embedded = character::read(&embedded, Source::Json, STRICT).unwrap().character;
    assert_ne!(file.digest, embedded.digest);
    assert!(file.has_digest(&file.digest) && file.has_digest(&embedded.digest));
    assert!(!other.has_digest(&embedded.digest) && !other.has_digest(&file.digest));
}

#[test]
fn the_schema_knows_every_word_of_the_examples_and_no_other() {
    let schema = character::schema();
    assert_eq!(schema["additionalProperties"], false);
    let words = |of: &serde_json::Value| -> Vec<String> {
        of["properties"].as_object().unwrap().keys().cloned().collect()
    };
    for path in examples().into_iter().filter(|path| path.extension().unwrap() == "json") {
        let document: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        let parts = [
            (&schema, vec![document.clone()]),
            (&schema["$defs"]["Link"], document["links"].as_array().unwrap().clone()),
            (&schema["$defs"]["Joint"], document["joints"].as_array().unwrap().clone()),
        ];
        for (schema, values) in parts {
            assert_eq!(schema["additionalProperties"], false);
            let known = words(schema);
            for key in values.iter().flat_map(|value| value.as_object().unwrap().keys()) {
                assert!(known.contains(key), "{key} is not in the schema");
            }
        }
    }
}

/// Documents to be mutated: one that is all faults and repairs, and the examples.
static SEEDS: LazyLock<Vec<(Source, Vec<u8>)>> = LazyLock::new(|| {
    let mut seeds = vec![(Source::Urdf, ARM_URDF.as_bytes().to_vec())];
    for name in ["fourbar.json", "hexapod.json", "snake.json"] {
        seeds.push((Source::Json, fs::read(example_path(name)).unwrap()));
    }
    for name in ["quadruped.urdf", "biped.urdf"] {
        seeds.push((Source::Urdf, fs::read(example_path(name)).unwrap()));
    }
    seeds
});

/// Robots from elsewhere, to be mutated.
static ROBOT_SEEDS: LazyLock<Vec<(Source, Vec<u8>)>> = LazyLock::new(|| {
    let paths = crate::common::urdf_files(&crate::common::robots());
    paths.into_iter().map(|path| (Source::Urdf, fs::read(path).unwrap())).collect()
});

/// A change of a document: where, what kind, and with what.
type Edit = (prop::sample::Index, u8, u8);

fn edits() -> impl Strategy<Value = Vec<Edit>> {
    prop::collection::vec((any::<prop::sample::Index>(), 0..6_u8, any::<u8>()), 1..6)
}

fn mutated(mut bytes: Vec<u8>, edits: Vec<Edit>) -> Vec<u8> {
    for (place, kind, value) in edits {
        if bytes.is_empty() {
            break;
        }
        let place = place.index(bytes.len());
        // Numbers and names are likelier to pass the parser than any byte.
        match kind {
            0 => bytes[place] = value,
            1 => bytes[place] = b'0' + value % 10,
            2 => drop(bytes.remove(place)),
            3 => bytes.insert(place, b"-e.9"[usize::from(value) % 4]),
            4 => {
                let end = (place + usize::from(value)).min(bytes.len());
                let part = bytes[place..end].to_vec();
                bytes.splice(place..place, part);
            }
            _ => bytes.truncate(place + 1),
        }
    }
    bytes
}

fn read_anything(bytes: &[u8], source: Source) {
    match character::read(bytes, source, Options::default()) {
        Ok(reading) => assert_invariants(&reading.character),
        Err(error) => assert!(!error.faults().is_empty() && !error.to_string().is_empty()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        for source in [Source::Urdf, Source::Json, Source::Zip] {
            read_anything(&bytes, source);
        }
    }

    #[test]
    fn mutated_documents_are_read_or_refused(seed in any::<prop::sample::Index>(), edits in edits()) {
        let (source, bytes) = SEEDS[seed.index(SEEDS.len())].clone();
        read_anything(&mutated(bytes, edits), source);
    }

    #[test]
    #[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
    fn mutated_robots_are_read_or_refused(seed in any::<prop::sample::Index>(), edits in edits()) {
        let (source, bytes) = ROBOT_SEEDS[seed.index(ROBOT_SEEDS.len())].clone();
        read_anything(&mutated(bytes, edits), source);
    }

    #[test]
    fn numbers_of_any_size_are_read_or_refused(
        place in any::<prop::sample::Index>(), exponent in -320..320_i32, negative in any::<bool>(),
    ) {
        // Every attribute of the arm that is a list of numbers, replaced one at a time.
        let starts: Vec<usize> = ARM_URDF.match_indices("=\"").map(|(at, _)| at + 2).filter(|at| {
            ARM_URDF.as_bytes()[*at].is_ascii_digit() || ARM_URDF.as_bytes()[*at] == b'-'
        }).collect();
        let start = starts[place.index(starts.len())];
        let end = start + ARM_URDF[start..].find([' ', '"']).unwrap();
        let number = format!("{}1e{exponent}", if negative { "-" } else { "" });
        let text = [&ARM_URDF[..start], &number, &ARM_URDF[end..]].concat();
        read_anything(text.as_bytes(), Source::Urdf);
    }
}
