//! Where legs have their joints, their hips and their feet, against the simulator's own kinematics.

use gaitwright_learning::learn::Posture;
use gaitwright_learning::program::gaits::named;
use gaitwright_learning::program::ring::{PARAMETERS, Ring, Wanted, program};
use gaitwright_physics::character::{Character, Source, read};
use gaitwright_physics::sim::{State, link_poses};
use nalgebra::Vector3;
use serde_json::json;

use super::judged::{judged, measures_the_hips_as_the_judge_does};
use super::{GRAVITY, subject, subject_of};

#[test]
fn legs_are_where_the_simulator_has_them() {
    for name in ["quadruped.urdf", "biped.urdf", "hexapod.json"] {
        let subject = subject(name, [1.0, 0.0, 0.0]);
        for leg in &subject.legs.legs {
            let mut state = State::new(&subject.model);
            let angles: Vec<f64> = leg.standing.iter().map(|angle| angle + 0.1).collect();
            state.angles.copy_from_slice(&subject.stance.angles);
            for (&joint, &angle) in leg.joints.iter().zip(&angles) {
                state.angles[joint] = angle;
            }
            let poses = link_poses(&subject.model, &state);
            let place = leg.place(&angles);
            // The foot's body turned as the simulator turns it.
            let body = subject.model.links[leg.links[0]].body;
            let link = subject.model.links.iter().position(|link| link.body == body).unwrap();
            let body = poses[link] * subject.model.links[link].pose.inverse();
            let wanted = body.rotation.to_rotation_matrix();
            assert!((place.rotation - wanted.matrix()).amax() < 1e-12, "{name}");
            // The last joint sits where the body's origin is.
            let origin = place.origin(leg.joints.len() - 1);
            assert!((origin - body.translation.vector).norm() < 1e-12, "{name}");
        }
    }
}

#[test]
fn inverse_kinematics_finds_what_forward_kinematics_gave() {
    for name in ["quadruped.urdf", "biped.urdf", "hexapod.json"] {
        let subject = subject(name, [1.0, 0.0, 0.0]);
        for leg in &subject.legs.legs {
            for change in [-0.15, 0.1, 0.2] {
                let mut wanted: Vec<f64> = leg.standing.iter().map(|angle| angle + change).collect();
                for (&joint, angle) in leg.joints.iter().zip(&mut wanted) {
                    let [lower, upper] = subject.model.limits[joint].unwrap_or([f64::MIN, f64::MAX]);
                    *angle = angle.clamp(lower, upper);
                }
                let goal = leg.place(&wanted);
                let mut found = leg.standing.clone();
                let left = leg.reach(&mut found, goal.foot, goal.up);
                assert!(left < 1e-4 * leg.length, "{name}: {left} m");
                assert!((leg.place(&found).foot - goal.foot).norm() < 1e-4 * leg.length);
            }
            // What cannot be reached is approached, within the ranges of motion.
            let mut found = leg.standing.clone();
            let left = leg.reach(&mut found, leg.hip - Vector3::z() * (2.0 * leg.length), Vector3::z());
            assert!(left > 0.5 * leg.length);
            for (&joint, angle) in leg.joints.iter().zip(&found) {
                let [lower, upper] = subject.model.limits[joint].unwrap_or([f64::MIN, f64::MAX]);
                assert!((lower..=upper).contains(angle));
            }
        }
    }
}

#[test]
fn left_and_fore_follow_the_direction_of_travel() {
    let ahead = subject("quadruped.urdf", [1.0, 0.0, 0.0]).legs;
    let back = subject("quadruped.urdf", [-1.0, 0.0, 0.0]).legs;
    // LF, LH, RF, RH: the other way round, left fore is what was right hind.
    for (leg, other) in [(0, 3), (1, 2), (2, 1), (3, 0)] {
        assert_eq!(ahead.legs[leg].joints, back.legs[other].joints);
        assert!((ahead.legs[leg].hip + back.legs[other].hip).xy().norm() < 1e-12);
    }
    assert!(ahead.legs[0].hip.x > 0.0 && ahead.legs[0].hip.y > 0.0);
    // The mass and its inertia are those of the character.
    assert!((ahead.mass - 12.0).abs() < 1e-9);
    assert!((ahead.inertia[(1, 1)] - back.inertia[(1, 1)]).abs() < 1e-12);
}

/// Two legs of three joints that all turn about the same `axis`, with soles.
fn planar(axis: [f64; 3]) -> Character {
    let mut links = vec![
        json!({ "name": "trunk", "density": 300, "shapes": [{ "kind": "box", "size": [0.2, 0.3, 0.2] }] }),
    ];
    let mut joints = Vec::new();
    for (side, y) in [("left", 0.1), ("right", -0.1)] {
        let mut parent = "trunk".to_owned();
        for (part, down) in
            [("thigh", [0.0, y, -0.1]), ("shank", [0.0, 0.0, -0.3]), ("foot", [0.0, 0.0, -0.3])]
        {
            let child = format!("{side}_{part}");
            let shape = match part {
                "foot" => {
                    json!({ "kind": "box", "size": [0.2, 0.08, 0.02], "pose": { "position": [0.03, 0, -0.03] } })
                }
                _ => {
                    json!({ "kind": "capsule", "radius": 0.03, "length": 0.2, "pose": { "position": [0, 0, -0.15] } })
                }
            };
            links.push(json!({ "name": child, "density": 500, "shapes": [shape] }));
            joints.push(json!({ "name": format!("{child}_joint"), "kind": "revolute", "parent": parent, "child": child,
                "origin": { "position": down }, "axis": axis, "limits": { "lower": -2.5, "upper": 2.5 },
                "actuation": { "max_torque": 100, "max_speed": 10 } }));
            parent = child;
        }
    }
    let document =
        json!({ "format": "gaitwright/character@1", "name": "planar", "links": links, "joints": joints });
    read(document.to_string().as_bytes(), Source::Json, Default::default()).unwrap().character
}

/// A leg of three joints that all turn about one axis keeps its sole level with the joint that its foot's place leaves: in pitch or in
/// roll.
#[test]
fn soles_of_planar_legs_are_kept_level() {
    let rolling = subject_of(planar([1.0, 0.0, 0.0]), [1.0, 0.0, 0.0]);
    assert!(rolling.legs.legs.len() == 2 && rolling.legs.legs.iter().all(|leg| leg.level == [true, false]));
    let subject = subject_of(planar([0.0, 1.0, 0.0]), [1.0, 0.0, 0.0]);
    assert_eq!(subject.legs.legs.len(), 2);
    for leg in &subject.legs.legs {
        assert_eq!(leg.level, [false, true]);
        for [ahead, up] in [[0.1, 0.03], [-0.1, 0.05], [0.0, 0.1]] {
            let mut angles = leg.standing.clone();
            let target = leg.foot + Vector3::new(ahead, 0.0, up);
            assert!(leg.reach(&mut angles, target, Vector3::z()) < 1e-4);
            assert!(leg.place(&angles).up.angle(&Vector3::z()) < 1e-3, "{ahead} m ahead, {up} m up");
        }
    }
    // The bundled biped has a joint more, which moves its feet to the side.
    let biped = self::subject("biped.urdf", [1.0, 0.0, 0.0]);
    assert!(biped.legs.legs.iter().all(|leg| leg.joints.len() == 4 && leg.level == [false, true]));
}

/// The bundled biped with the front third of each sole on a joint of its own.
fn toed() -> Character {
    let mut urdf = std::fs::read_to_string(crate::common::example_path("biped.urdf")).unwrap();
    let sole = r#"<origin xyz="0.02 0 -0.028"/>
      <geometry><box size="0.18 0.09 0.024"/></geometry>"#;
    let heel = r#"<origin xyz="-0.01 0 -0.028"/>
      <geometry><box size="0.12 0.09 0.024"/></geometry>"#;
    assert_eq!(urdf.matches(sole).count(), 4, "seen and touching, of two feet");
    urdf = urdf.replace(sole, heel);
    for side in ["L", "R"] {
        let toe = format!(
            r#"<joint name="{side}_toe_joint" type="revolute"><parent link="{side}_foot"/><child link="{side}_toe"/>
            <origin xyz="0.05 0 -0.028"/><axis xyz="0 1 0"/><limit lower="-0.5" upper="0.5" effort="10" velocity="12"/></joint>
            <link name="{side}_toe"><inertial><origin xyz="0.03 0 0"/><mass value="0.1"/>
            <inertia ixx="0.0001" ixy="0" ixz="0" iyy="0.0001" iyz="0" izz="0.0001"/></inertial>
            <collision><origin xyz="0.03 0 0"/><geometry><box size="0.06 0.09 0.024"/></geometry></collision></link></robot>"#
        );
        urdf = urdf.replace("</robot>", &toe);
    }
    read(urdf.as_bytes(), Source::Urdf, Default::default()).unwrap().character
}

#[test]
fn a_toe_is_part_of_its_foot() {
    // As the bundled biped stands, with its toes straight.
    let biped = subject("biped.urdf", [1.0, 0.0, 0.0]);
    let joints = biped.model.joint_names.iter().cloned().zip(biped.stance.angles.iter().copied());
    let subject = subject_of(Character { standing: Some(joints.collect()), ..toed() }, [1.0, 0.0, 0.0]);
    assert!(subject.stance.stable);
    assert_eq!(subject.stance.support.len(), 4, "heels and toes");
    assert_eq!(subject.legs.legs.len(), 2);
    let name = |link: &usize| subject.model.character.links[*link].name.as_str();
    let feet: Vec<Vec<&str>> =
        subject.legs.legs.iter().map(|leg| leg.links.iter().map(name).collect()).collect();
    assert_eq!(feet, [["L_foot", "L_toe"], ["R_foot", "R_toe"]]);
    measures_the_hips_as_the_judge_does(&subject, "walk");
    // A leg program leaves the toes as they stand.
    let wanted = Wanted::at_froude(&subject.legs, named("walk", &subject.legs).unwrap(), 0.05, GRAVITY);
    let (ring, _) = subject.ring(&wanted, &[0.0; PARAMETERS]);
    for (joint, name) in subject.model.joint_names.iter().enumerate().filter(|(_, name)| name.contains("toe"))
    {
        let still = ring.cycle.iter().all(|posture| posture.angles[joint] == subject.stance.angles[joint]);
        assert!(still, "{name}");
    }
    // The judge sees two feet, of which neither scuffs with its toe.
    let cycle = vec![Posture::resting(&subject.stance.angles); ring.cycle.len()];
    let report = judged(&subject, &Ring { entry: Vec::new(), cycle, ..ring }, &subject.stance.gains);
    assert_eq!(report.feet.iter().map(|foot| foot.link.as_str()).collect::<Vec<_>>(), ["L_foot", "R_foot"]);
    assert_eq!((report.fell_at, report.scuffing, report.aerial_fraction), (None, 0.0, 0.0));
}

/// Feet that stand beside their hips step where they stood, and the trunk stays as high; those below step under the hips.
#[test]
fn sprawled_legs_step_where_they_stand() {
    for (name, gait, sprawled) in
        [("spider.json", "tetrapod", true), ("quadruped.urdf", "trot", false), ("biped.urdf", "walk", false)]
    {
        let legs = subject(name, [1.0, 0.0, 0.0]).legs;
        let wanted = Wanted::at_froude(&legs, named(gait, &legs).unwrap(), 0.08, GRAVITY);
        let program = program(&legs, &wanted, &[0.0; PARAMETERS]);
        assert!(legs.legs.iter().all(|leg| leg.sprawled == sprawled), "{name}");
        if sprawled {
            assert!(program.raise.abs() < 1e-12, "{name}: {} m", program.raise);
            for (leg, step) in legs.legs.iter().zip(&program.steps) {
                assert!((step.neutral - leg.foot.xy()).norm() < 1e-12, "{name}");
                // They are drawn alike, whichever way they point.
                assert!((leg.length / legs.length - 1.0).abs() < 0.01, "{name}: {} m", leg.length);
            }
        }
    }
}
