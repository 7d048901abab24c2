//! Standing poses: found for characters that bring none, and proven.

use crate::common;

use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::sync::Arc;

use gaitwright_physics::character::{self, Limits, Options, Shape, Source};
use gaitwright_physics::model::{Base, DofKind, Model};
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::sim::{Command, Simulator, State, link_poses};
use gaitwright_physics::stance::{Stance, Upright};
use nalgebra::{UnitQuaternion, Vector3};

/// Holds the stance for ten seconds and gives how far the root moved, m, and whether it stayed up.
fn hold(model: &Arc<Model>, stance: &Stance) -> (f64, bool) {
    let scene = Scene::default();
    let plan = common::plan(model, &scene, &Accuracy::default(), Some(&stance.gains));
    let upright = Upright::new(model, stance, &scene);
    let mut simulator = Simulator::new(plan, stance.state.clone());
    for _ in 0..5000 {
        simulator.step(Command::Track { now: &stance.angles, next: &stance.angles }).unwrap();
    }
    let moved = (simulator.state().root.position - stance.state.root.position).norm();
    (moved, upright.holds(simulator.state()))
}

#[test]
fn the_examples_stand_still_in_the_poses_found_for_them() {
    for name in ["quadruped.urdf", "hexapod.json", "spider.json", "biped.urdf", "runner.urdf", "snake.json"] {
        let model = common::example(name);
        let stance = Stance::find(&model, &Scene::default());
        assert!(stance.stable, "{name} does not stand");
        let (moved, up) = hold(&model, &stance);
        assert!(up && moved < 0.02 * stance.root_height.max(0.1), "{name} moved by {moved} m");
        for (joint, limit) in model.limits.iter().enumerate() {
            let angle = stance.angles[joint];
            assert!(limit.is_none_or(|[lower, upper]| (lower..=upper).contains(&angle)), "{name}");
        }
    }
}

/// Whether a character stands still on the links named, and on no other.
fn stands_on(path: &Path, feet: &[&str]) {
    let model = Arc::new(Model::new(common::character(path), Base::Floating));
    let robot = &model.character.name;
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable, "{robot} does not stand");
    let mut support: Vec<&str> =
        stance.support.iter().map(|link| model.character.links[*link].name.as_str()).collect();
    support.sort_unstable();
    let mut feet = feet.to_vec();
    feet.sort_unstable();
    assert_eq!(support, feet, "{robot}");
    let (moved, up) = hold(&model, &stance);
    assert!(up && moved < 0.02 * stance.root_height, "{robot} moved by {moved} m");
}

#[test]
fn the_legged_examples_stand_on_their_feet() {
    let feet = ["LF", "LM", "LH", "RF", "RM", "RH"].map(|leg| format!("{leg}_tibia"));
    stands_on(&common::example_path("hexapod.json"), &feet.each_ref().map(String::as_str));
    let feet = ["LF", "RF", "LH", "RH"].map(|leg| format!("{leg}_foot"));
    stands_on(&common::example_path("quadruped.urdf"), &feet.each_ref().map(String::as_str));
    stands_on(&common::example_path("biped.urdf"), &["L_foot", "R_foot"]);
    // Drawn flat, with its legs stretched to the sides.
    let feet: Vec<String> =
        ["L", "R"].iter().flat_map(|side| (1..5).map(move |row| format!("{side}{row}_tibia"))).collect();
    stands_on(&common::example_path("spider.json"), &feet.iter().map(String::as_str).collect::<Vec<_>>());
}

/// The quadruped drawn with its thighs turned back by a quarter and its knees straight: its legs lie along the trunk, all the same way,
/// and are meant to hang below it.
#[test]
fn legs_drawn_along_the_trunk_stand_below_it() {
    let mut character = (*common::example("quadruped.urdf").character).clone();
    for link in &mut character.links {
        let Some(joint) = link.joint.as_mut() else { continue };
        let back = if link.name.ends_with("thigh") {
            FRAC_PI_2
        } else if link.name.ends_with("shank") {
            0.0
        } else {
            continue;
        };
        joint.origin.rotation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), back);
        joint.limits = Some(Limits { lower: -3.0, upper: 3.0 });
    }
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable && stance.support.len() == 4, "{:?}", stance.support);
    let feet = stance.support.iter().all(|link| model.character.links[*link].name.ends_with("foot"));
    assert!(feet && stance.root_height > 0.2, "{} m", stance.root_height);
}

/// The quadruped drawn on straight legs that end in blocks: a block at a shank's end is no sole that would have to be level, which it can
/// only be with the shank upright.
#[test]
fn shanks_that_end_in_blocks_stand_bent() {
    let mut character = (*common::example("quadruped.urdf").character).clone();
    for link in &mut character.links {
        if link.name.ends_with("foot") {
            link.collisions[0].shape = Shape::Box { half_extents: Vector3::new(0.02, 0.015, 0.015) };
        }
        let Some(joint) = link.joint.as_mut() else { continue };
        if link.name.ends_with("thigh") || link.name.ends_with("shank") {
            joint.origin.rotation = UnitQuaternion::identity();
            joint.limits = Some(Limits { lower: -2.5, upper: 2.5 });
        }
    }
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable && stance.support.len() == 4, "{:?}", stance.support);
    let poses = link_poses(&model, &stance.state);
    let at = |name: &str| {
        let link = model.character.links.iter().position(|link| link.name == name).unwrap();
        poses[link].translation.vector
    };
    for leg in ["LF", "RF", "LH", "RH"] {
        let reach = at(&format!("{leg}_thigh")) - at(&format!("{leg}_foot"));
        assert!((0.25..0.33).contains(&reach.z), "{leg}: {} m of 0.4 m", reach.z);
        assert!(reach.xy().norm() < 0.04, "{leg}: the foot is {} m off the hip", reach.xy().norm());
    }
}

/// The biped drawn on straight legs whose joint for swinging comes before that for spreading, as many robots have it: what bends the knee
/// has to turn the hip two joints before it.
#[test]
fn knees_bend_whatever_the_order_of_the_hips_joints() {
    let mut character = (*common::example("biped.urdf").character).clone();
    let [swing, spread] = [Vector3::y_axis(), Vector3::x_axis()];
    for joint in character.links.iter_mut().filter_map(|link| link.joint.as_mut()) {
        if joint.name.ends_with("hip_roll") {
            joint.axis = swing;
        } else if joint.name.ends_with("hip_swing") {
            joint.axis = spread;
        }
        joint.origin.rotation = UnitQuaternion::identity();
        joint.limits = Some(Limits { lower: -1.5, upper: 1.5 });
    }
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable);
    let angle = |joint: &str| stance.angles[model.joint(joint).unwrap()];
    for side in ["L", "R"] {
        assert!(angle(&format!("{side}_knee")).abs() > 0.4, "{side}: {} rad", angle(&format!("{side}_knee")));
    }
}

/// The biped on soles of 7 cm with ankles that turn by 0.2 rad: with its knees bent as far as usual its soles are tilted by 0.06 rad, and
/// it falls.
#[test]
fn soles_are_level_where_tilted_ones_let_it_fall() {
    let text = std::fs::read_to_string(common::example_path("biped.urdf")).unwrap();
    let (sole, short) = (r#"size="0.18 0.09 0.024""#, r#"size="0.07 0.09 0.024""#);
    assert_eq!(text.matches(sole).count(), 4, "seen and touching, of two feet");
    let text = text.replace(sole, short).replace(r#"xyz="0.02 0 -0.028""#, r#"xyz="0 0 -0.028""#);
    let mut character = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap().character;
    let joints = character.links.iter_mut().filter_map(|link| link.joint.as_mut());
    joints
        .filter(|joint| joint.name.ends_with("ankle"))
        .for_each(|ankle| ankle.limits = Some(Limits { lower: -0.2, upper: 0.2 }));
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable);
    let angle = |joint: &str| stance.angles[model.joint(joint).unwrap()];
    for side in ["L", "R"] {
        let tilt: f64 =
            ["hip_swing", "knee", "ankle"].iter().map(|joint| angle(&format!("{side}_{joint}"))).sum();
        assert!(tilt.abs() < 0.005, "{side}: {tilt} rad");
    }
}

/// How the frames of the feet lie has no bearing on how a character stands.
#[test]
fn soles_are_level_whatever_the_axes_of_their_frames() {
    let model = common::example("biped.urdf");
    let mut character = (*model.character).clone();
    let turn = UnitQuaternion::from_euler_angles(1.2, -0.4, 2.0);
    for link in character.links.iter_mut().filter(|link| link.name.ends_with("foot")) {
        let joint = link.joint.as_mut().unwrap();
        joint.origin.rotation *= turn;
        joint.axis = turn.inverse() * joint.axis;
        for placed in link.collisions.iter_mut().chain(&mut link.visuals) {
            placed.pose = turn.inverse() * placed.pose;
        }
        let inertial = link.inertial.as_mut().unwrap();
        let rotation = turn.inverse().to_rotation_matrix();
        inertial.center_of_mass = rotation * inertial.center_of_mass;
        inertial.inertia = rotation * inertial.inertia * rotation.transpose();
    }
    let turned = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let [one, other] = [&model, &turned].map(|model| Stance::find(model, &Scene::default()));
    assert!(one.stable && other.stable);
    // The search ends with steps of a thousandth.
    for (joint, (angle, same)) in one.angles.iter().zip(&other.angles).enumerate() {
        assert!((angle - same).abs() < 0.005, "{}: {angle} and {same} rad", model.joint_names[joint]);
    }
}

/// A biped with two arms, its trunk heavier in front: the feet come below the weight, and the arms hang as they were drawn.
#[test]
fn arms_do_not_balance_a_standing_pose() {
    let text = std::fs::read_to_string(common::example_path("biped.urdf")).unwrap();
    let arm = |side: &str, y: f64| {
        format!(
            r#"<link name="{side}_arm"><inertial><origin xyz="0 0 -0.15"/><mass value="0.6"/>
            <inertia ixx="0.005" iyy="0.005" izz="0.0005" ixy="0" ixz="0" iyz="0"/></inertial>
            <collision><origin xyz="0 0 -0.15"/><geometry><cylinder radius="0.02" length="0.3"/></geometry></collision>
            </link><joint name="{side}_shoulder" type="revolute"><parent link="trunk"/><child link="{side}_arm"/>
            <origin xyz="0.04 {y} 0.1"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="5" velocity="8"/></joint>"#
        )
    };
    let armed = text.replace("</robot>", &(arm("L", 0.25) + &arm("R", -0.25) + "</robot>"));
    let reading = character::read(armed.as_bytes(), Source::Urdf, Options::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable);
    for side in ["L", "R"] {
        let angle = stance.angles[model.joint(&format!("{side}_shoulder")).unwrap()];
        assert!(angle.abs() < 0.05, "{side}: {angle} rad");
    }
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn quadruped_robots_stand_on_their_four_feet() {
    let folder = common::robots();
    for (robot, feet) in [
        ("a1", ["FR_foot", "FL_foot", "RR_foot", "RL_foot"]),
        ("anymal_b", ["LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"]),
        ("quadruped", ["FL_contact", "FR_contact", "BL_contact", "BR_contact"]),
    ] {
        stands_on(&folder.join(format!("{robot}.urdf")), &feet);
    }
}

/// With all joints at zero its legs are straight, and nothing but their length says how far they should be bent.
#[test]
fn legs_whose_joints_turn_without_end_stand_bent() {
    let text = std::fs::read_to_string(common::example_path("quadruped.urdf")).unwrap();
    let mut endless = text.replace(r#"rpy="0 0.7 0""#, "").replace(r#"rpy="0 -1.4 0""#, "");
    for joint in ["swing", "knee"] {
        endless = endless
            .replace(&format!(r#"_{joint}" type="revolute""#), &format!(r#"_{joint}" type="continuous""#));
    }
    let reading = character::read(endless.as_bytes(), Source::Urdf, Options::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    assert_eq!(model.limits.iter().filter(|limits| limits.is_none()).count(), 8);
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable);
    let poses = link_poses(&model, &stance.state);
    let at = |name: String| {
        let link = model.character.links.iter().position(|link| link.name == name).unwrap();
        poses[link].translation.vector
    };
    for leg in ["LF", "RF", "LH", "RH"] {
        let length = (at(format!("{leg}_thigh")) - at(format!("{leg}_foot"))).norm();
        let extension = length / 0.4;
        // The pose is drawn at 0.7 of the length; soft springs give way by some of it.
        assert!((0.6..0.8).contains(&extension), "{leg}: {extension} of its length");
    }
    let (moved, up) = hold(&model, &stance);
    assert!(up && moved < 0.02 * stance.root_height, "it moved by {moved} m");
}

/// A head whose lowest point is at its joint is held as firmly as its weight asks for, not as far as it reaches down: it nods by less
/// than 0.15 rad when it lies level, and comes to rest within a few swings.
#[test]
fn a_head_is_held_by_its_weight() {
    let text = std::fs::read_to_string(common::example_path("biped.urdf")).unwrap();
    let (mass, radius) = (0.8, 0.06);
    let inertia = 0.4 * mass * radius * radius;
    let head = format!(
        r#"<link name="head"><inertial><origin xyz="0 0 {radius}"/><mass value="{mass}"/>
        <inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"/></inertial>
        <collision><origin xyz="0 0 {radius}"/><geometry><sphere radius="{radius}"/></geometry></collision></link>
        <joint name="neck" type="revolute"><parent link="trunk"/><child link="head"/><origin xyz="0 0 0.12"/>
        <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="5" velocity="8"/></joint></robot>"#
    );
    let text = text.replace("</robot>", &head);
    let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable);
    let neck = model.joint("neck").unwrap();
    let (stiffness, damping) = (stance.gains.stiffness[neck], stance.gains.damping[neck]);
    let nod = mass * 9.81 * radius / stiffness;
    let about_joint = inertia + mass * radius * radius;
    let ratio = damping / (2.0 * (stiffness * about_joint).sqrt());
    assert!((0.1..0.15).contains(&nod), "it nods by {nod} rad");
    assert!((ratio - 0.3).abs() < 1e-9, "{ratio} of critical damping");
}

/// The pose of a character whose legs slide is the same whatever its size is.
#[test]
fn legs_that_slide_stand_alike_at_every_size() {
    let text = std::fs::read_to_string(common::example_path("quadruped.urdf")).unwrap();
    let mut sliding = text.replace(r#"rpy="0 0.7 0""#, "").replace(r#"rpy="0 -1.4 0""#, "");
    for leg in ["LF", "RF", "LH", "RH"] {
        let knee = format!(r#"<joint name="{leg}_knee" type="revolute">"#);
        let (before, after) = sliding.split_once(&knee).unwrap();
        let after = after.replacen(r#"<axis xyz="0 1 0"/>"#, r#"<axis xyz="0 0 1"/>"#, 1).replacen(
            r#"lower="-1.1" upper="1.1""#,
            r#"lower="-0.02" upper="0.15""#,
            1,
        );
        sliding = format!("{before}{}{after}", knee.replace("revolute", "prismatic"));
    }
    let reading = character::read(sliding.as_bytes(), Source::Urdf, Options::default()).unwrap();
    let slides = |joint: usize| joint % 3 == 2;
    let standing = |size: f64| {
        let character = common::scaled(&reading.character, size);
        let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
        assert!((0..12).all(|joint| slides(joint) == (model.bodies[joint + 1].dof == DofKind::Prismatic)));
        Stance::find(&model, &Scene::default()).angles
    };
    let own = standing(1.0);
    assert!((0..12).any(|joint| slides(joint) && own[joint].abs() > 0.01), "{own:?}");
    for size in [0.01, 100.0] {
        for (joint, (angle, other)) in own.iter().zip(standing(size)).enumerate() {
            let other = if slides(joint) { other / size } else { other };
            assert!((angle - other).abs() < 1e-3, "at {size}, joint {joint}: {angle} and {other}");
        }
    }
}

#[test]
fn a_pose_given_by_the_author_is_taken() {
    let path = common::example_path("hexapod.json");
    let mut document: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    let joint = document["joints"].as_array().unwrap().iter().find(|joint| joint["kind"] != "fixed").unwrap();
    let name = joint["name"].as_str().unwrap().to_owned();
    document["standing"] = serde_json::json!({ &name: 0.0625 });
    let reading = character::read(document.to_string().as_bytes(), Source::Json, Options::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.given);
    assert_eq!(stance.angles[model.joint(&name).unwrap()], 0.0625);
}

#[test]
fn a_character_that_cannot_stand_is_said_not_to() {
    // A broomstick on a ball.
    let text = r#"<robot name="broomstick"><link name="stick">
        <inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.001"/></inertial>
        <collision><origin xyz="0.001 0 -0.5"/><geometry><sphere radius="0.01"/></geometry></collision>
        </link></robot>"#;
    let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    assert!(!Stance::find(&model, &Scene::default()).stable);
}

/// Balls of a mesh become hulls of many corners, of which contacts keep four; the lowest corner decides how high it stands.
#[test]
fn a_hull_of_many_corners_rests_on_its_lowest() {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let corners: Vec<[f64; 3]> = (0..30)
        .map(|index| {
            let z = 1.0 - (2.0 * f64::from(index) + 1.0) / 30.0;
            let (across, turn) = ((1.0 - z * z).sqrt(), golden * f64::from(index));
            [0.1 * across * turn.cos(), 0.1 * across * turn.sin(), 0.1 * z]
        })
        .collect();
    let document = serde_json::json!({
        "format": "gaitwright/character@1", "name": "stone",
        "links": [{ "name": "stone", "density": 1000.0, "shapes": [{ "kind": "hull", "vertices": corners }] }],
    });
    let reading = character::read(document.to_string().as_bytes(), Source::Json, Options::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let scene: Scene = serde_json::from_str(r#"{"ground": {"kind": "plane", "height": 0.5}}"#).unwrap();
    let stance = Stance::find(&model, &scene);
    let pose = link_poses(&model, &stance.state)[0];
    let lowest = corners
        .iter()
        .map(|&[x, y, z]| (pose * nalgebra::Point3::new(x, y, z)).z)
        .fold(f64::INFINITY, f64::min);
    assert!((lowest - 0.5).abs() < 1e-6, "its lowest corner is at {lowest} m");
    assert_eq!(stance.support, [0]);
}

/// The quadruped with hind legs of 0.63 times the length of its fore legs, which bend the more for it.
#[test]
fn legs_of_different_lengths_stand_under_a_level_trunk() {
    let mut character = (*common::example("quadruped.urdf").character).clone();
    for link in character.links.iter_mut().filter(|link| link.name.contains("H_")) {
        if link.name.ends_with("thigh") || link.name.ends_with("shank") {
            link.collisions.clear();
        }
        if link.name.ends_with("shank") || link.name.ends_with("foot") {
            link.joint.as_mut().unwrap().origin.translation.vector *= 0.63;
        }
    }
    let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
    let stance = Stance::find(&model, &Scene::default());
    assert!(stance.stable && stance.support.len() == 4, "{:?}", stance.support);
    let tilt = stance.state.root.orientation.transform_vector(&Vector3::z()).angle(&Vector3::z());
    assert!(tilt < 0.05, "{tilt} rad");
}

/// A pose inside an obstacle leaves every step unsolved, for which the solver tries all that it can: a few of them are enough.
#[test]
fn a_pose_inside_an_obstacle_is_soon_found_not_to_be_stable() {
    let model = common::example("quadruped.urdf");
    let scene = serde_json::json!({
        "obstacles": [{ "shape": { "kind": "box", "size": [1, 1, 1], "pose": { "position": [0, 0, 0.5] } } }],
    });
    let scene: Scene = serde_json::from_value(scene).unwrap();
    let steps = std::cell::Cell::new(0);
    let stance = Stance::find_until(&model, &scene, &|| {
        steps.set(steps.get() + 1);
        false
    });
    assert!(!stance.stable);
    assert!((1..100).contains(&steps.get()), "{} steps", steps.get());
}

/// Nine hundred links that stand on a point each: one step of as many rows may take minutes, so that it is not begun.
#[test]
fn a_character_on_very_many_points_counts_as_not_stable_without_being_simulated() {
    let links: Vec<_> = (0..900)
        .map(|index| {
            let capsule = serde_json::json!({ "kind": "capsule", "radius": 0.02, "length": 0.1 });
            serde_json::json!({ "name": format!("link{index}"), "density": 1000.0, "shapes": [capsule] })
        })
        .collect();
    let joints: Vec<_> = (1..900)
        .map(|index| {
            serde_json::json!({
                "name": format!("joint{index}"), "kind": "revolute", "axis": [0, 1, 0],
                "parent": format!("link{}", index - 1), "child": format!("link{index}"),
                "origin": { "position": [0.15, 0, 0] }, "limits": { "lower": -1, "upper": 1 },
            })
        })
        .collect();
    let document = serde_json::json!({
        "format": "gaitwright/character@1", "name": "comb", "links": links, "joints": joints,
    });
    let reading = character::read(document.to_string().as_bytes(), Source::Json, Options::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let steps = std::cell::Cell::new(0);
    let stance = Stance::find_until(&model, &Scene::default(), &|| {
        steps.set(steps.get() + 1);
        false
    });
    assert!(!stance.stable && stance.support.len() == 900);
    assert_eq!(steps.get(), 0);
}

#[test]
fn a_character_has_fallen_by_its_height_over_the_ground_below_it() {
    let model = common::example("quadruped.urdf");
    // A ramp of 10 % downhill along x, level with the origin there.
    let scene: Scene = serde_json::from_str(
        r#"{"ground": {"kind": "height_field", "size": [40, 2], "heights": [[2, -2], [2, -2]]}}"#,
    )
    .unwrap();
    let stance = Stance::find(&model, &scene);
    let upright = Upright::new(&model, &stance, &scene);
    let at = |x: f64, over: f64| {
        let mut state = stance.state.clone();
        state.root.position = nalgebra::Point3::new(x, 0.0, -0.1 * x + over * stance.root_height);
        upright.holds(&state)
    };
    for x in [-15.0, 0.0, 15.0] {
        assert!(at(x, 1.0) && !at(x, 0.3), "{x} m down the way");
    }
}

/// Some descriptions have the origin of their root on the floor between the feet, or below it.
#[test]
fn a_root_whose_origin_is_at_the_floor_has_not_fallen_while_the_trunk_stands() {
    let text = std::fs::read_to_string(common::example_path("quadruped.urdf")).unwrap();
    let usual = common::example("quadruped.urdf");
    let scene = Scene::default();
    let usual_stance = Stance::find(&usual, &scene);
    for above in [usual_stance.root_height, usual_stance.root_height + 0.1] {
        let footprint = format!(
            r#"<link name="footprint"/><joint name="footprint" type="fixed"><parent link="footprint"/>
               <child link="trunk"/><origin xyz="0 0 {above}"/></joint></robot>"#
        );
        let text = text.replace("</robot>", &footprint);
        let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
        let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
        let stance = Stance::find(&model, &scene);
        assert!(stance.stable && stance.root_height < 0.01, "{} m", stance.root_height);
        let (_, up) = hold(&model, &stance);
        assert!(up, "with its root's origin {above} m below its trunk it counts as fallen");
        // It falls where the other does: both trunks at the same height above the ground.
        let [other, own] = [(&usual, &usual_stance), (&model, &stance)]
            .map(|(model, stance)| (Upright::new(model, stance, &scene), stance.state.clone()));
        for sunk in [0.3, 0.5, 0.55, 0.65, 0.7] {
            let lowered = |(upright, state): &(Upright, State)| {
                let mut state = state.clone();
                state.root.position.z -= sunk * usual_stance.root_height;
                upright.holds(&state)
            };
            assert_eq!(lowered(&own), lowered(&other), "sunk by {sunk} of its height");
        }
    }
}

/// Everything takes longer where gravity is weaker, by the root of it; a character of a given shape stands or falls the same way.
#[test]
fn a_pose_is_held_for_as_long_as_falling_takes_under_its_gravity() {
    let stick = |tilt: f64| {
        // An inverted pendulum of 1 m on a plate of 4 cm, whose centre of mass is `tilt` m aside.
        let text = format!(
            r#"<robot name="stick"><link name="stick"><inertial><origin xyz="{tilt} 0 0.5"/><mass value="1"/>
               <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.001"/></inertial>
               <collision><geometry><box size="0.04 0.04 0.01"/></geometry></collision></link></robot>"#
        );
        let reading = character::read(text.as_bytes(), Source::Urdf, Options::default()).unwrap();
        Arc::new(Model::new(Arc::new(reading.character), Base::Floating))
    };
    for gravity in [9.81, 1.62, 0.2, 0.03] {
        let scene = Scene { gravity: [0.0, 0.0, -gravity], ..Scene::default() };
        assert!(Stance::find(&stick(0.01), &scene).stable, "at {gravity} m/s²");
        assert!(!Stance::find(&stick(0.03), &scene).stable, "at {gravity} m/s²");
    }
    let model = common::example("quadruped.urdf");
    for gravity in [1.62, 0.2] {
        let scene = Scene { gravity: [0.0, 0.0, -gravity], ..Scene::default() };
        assert!(Stance::find(&model, &scene).stable, "at {gravity} m/s²");
    }
}
