//! How two solids lie to each other, and which can touch, against closed forms and another algorithm.

use std::path::PathBuf;
use std::sync::Arc;

use gaitwright_physics::character::{self, Options, Placed, Shape, Source};
use gaitwright_physics::model::collision::convex::{Approach, Convex, from_vector, vector};
use gaitwright_physics::model::{Base, DofKind, Model};
use gaitwright_physics::sim::{State, link_poses};
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use parry3d::math::{Pose, Vector};
use parry3d::query;
use parry3d::shape::SharedShape;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::json;

use super::common;

/// Of the closest points and their distance, m, and of the normal, for solids of about 10 cm.
const ROUNDING: f64 = 1e-12;

fn solid(shape: Shape) -> Convex {
    Convex::new(&Placed { pose: Isometry3::identity(), shape, color: None }, &Isometry3::identity())
}

/// How `second` at `pose` lies to `first`.
fn approach(first: &Shape, second: &Shape, pose: &Isometry3<f64>) -> Approach {
    let second =
        Convex::new(&Placed { pose: *pose, shape: second.clone(), color: None }, &Isometry3::identity());
    let first = solid(first.clone());
    let pose = first.placed(&Pose::IDENTITY).inverse() * second.placed(&Pose::IDENTITY);
    let found = first.approach(&second, &pose, f64::INFINITY).unwrap();
    // Whatever is said to be farther away than some distance is, along the axis that is given for it.
    let places = [&first, &second].map(|solid| solid.place(&nalgebra::Matrix3::identity(), Vector3::zeros()));
    let apart = |axis| first.apart_along(&second, places, axis);
    if let Err(axis) = first.approach(&second, &pose, found.gap - 0.01) {
        assert!(apart(axis) > found.gap - 0.01);
    }
    assert!((apart(found.normal) - found.gap).abs() < ROUNDING);
    found
}

fn check(found: &Approach, normal: Vector3<f64>, gap: f64) {
    assert!((found.gap - gap).abs() < ROUNDING, "gap {} instead of {gap}", found.gap);
    let error = (from_vector(found.normal) - normal).norm();
    assert!(error < ROUNDING, "normal {:?} instead of {normal:?}", found.normal);
    let apart = (found.second - found.first).dot(vector(normal));
    assert!((apart - gap).abs() < ROUNDING, "closest points {apart} m apart instead of {gap}");
}

fn random(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-size..size))
}

#[test]
fn balls_are_as_far_apart_as_their_centres_less_their_radii() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..500 {
        let radii = [0, 1].map(|_| rng.random_range(0.02..0.1));
        let center = random(&mut rng, 0.2);
        let [first, second] = radii.map(|radius| Shape::Sphere { radius });
        let found = approach(&first, &second, &Isometry3::translation(center.x, center.y, center.z));
        check(&found, center.normalize(), center.norm() - radii[0] - radii[1]);
    }
}

/// Outside of the box the nearest point has the ball's coordinates clamped to it.
#[test]
fn a_ball_is_as_far_from_a_box_as_its_clamped_centre() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let half = Vector3::new(0.1, 0.05, 0.2);
    let radius = 0.03;
    let mut count = 0;
    while count < 500 {
        let center = random(&mut rng, 0.3);
        let nearest = center.inf(&half).sup(&-half);
        let arm = center - nearest;
        if arm.norm() < 1e-3 {
            continue;
        }
        count += 1;
        let found = approach(
            &Shape::Box { half_extents: half },
            &Shape::Sphere { radius },
            &Isometry3::translation(center.x, center.y, center.z),
        );
        check(&found, arm.normalize(), arm.norm() - radius);
    }
}

/// Faces on each other: the hard case of an exact zero, a little more, a little less, and deep.
#[test]
fn flat_faces_keep_their_normal_at_any_gap() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let half = Vector3::new(0.1, 0.12, 0.05);
    let corners = |sign: fn(u8, u8) -> f64| -> Vec<Point3<f64>> {
        (0..8).map(|c| Point3::new(sign(c, 1) * half.x, sign(c, 2) * half.y, sign(c, 4) * half.z)).collect()
    };
    let hull = Shape::Hull {
        vertices: corners(|corner, bit| if corner & bit == 0 { -1.0 } else { 1.0 }),
        triangles: vec![
            [0, 2, 1],
            [1, 2, 3],
            [4, 5, 6],
            [5, 7, 6],
            [0, 1, 4],
            [1, 5, 4],
            [2, 6, 3],
            [3, 6, 7],
            [0, 4, 2],
            [2, 4, 6],
            [1, 3, 5],
            [3, 7, 5],
        ],
    };
    let cylinder = Shape::Cylinder { radius: 0.08, half_length: 0.05 };
    for upper in [Shape::Box { half_extents: half }, hull, cylinder] {
        for gap in [0.0, 1e-13, -1e-13, 1e-9, -1e-9, 1e-5, -1e-5, 0.01, -0.01] {
            let lower = Shape::Box { half_extents: Vector3::new(0.3, 0.3, 0.1) };
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), rng.random_range(0.0..6.0));
            let shift =
                Vector3::new(rng.random_range(-0.25..0.25), rng.random_range(-0.25..0.25), 0.15 + gap);
            let found = approach(&lower, &upper, &Isometry3::from_parts(Translation3::from(shift), turn));
            check(&found, Vector3::z(), gap);
        }
    }
}

/// Two cubes, each standing on an edge, whose edges cross.
#[test]
fn crossing_edges_have_the_normal_across_both() {
    let edge = Shape::Box { half_extents: Vector3::repeat(0.1) };
    let lower = Shape::Hull {
        vertices: vec![
            Point3::new(-0.2, 0.0, 0.0),
            Point3::new(0.2, 0.0, 0.0),
            Point3::new(0.0, -0.2, -0.2),
            Point3::new(0.0, 0.2, -0.2),
        ],
        triangles: vec![[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]],
    };
    for gap in [1e-3, 1e-9, 0.0, -1e-9, -1e-3] {
        // An edge of the cube runs along y, its diagonal along z.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_4);
        let shift = Vector3::new(0.01, 0.02, 0.1 * 2.0_f64.sqrt() + gap);
        let found = approach(&lower, &edge, &Isometry3::from_parts(Translation3::from(shift), turn));
        check(&found, Vector3::z(), gap);
    }
}

/// The shape in parry's own hands.
fn parry(shape: &Shape) -> SharedShape {
    match shape {
        Shape::Sphere { radius } => SharedShape::ball(*radius),
        Shape::Box { half_extents: half } => SharedShape::cuboid(half.x, half.y, half.z),
        Shape::Cylinder { radius, half_length } => SharedShape::cylinder(*half_length, *radius),
        Shape::Capsule { radius, half_length } => SharedShape::capsule_z(*half_length, *radius),
        Shape::Hull { vertices, .. } => {
            let points: Vec<Vector> = vertices.iter().map(|vertex| vector(vertex.coords)).collect();
            SharedShape::convex_hull(&points).unwrap()
        }
    }
}

fn distance(model: &Model, poses: &[Isometry3<f64>], pair: [usize; 2]) -> f64 {
    let placed: Vec<(usize, &Placed)> = model
        .character
        .links
        .iter()
        .enumerate()
        .flat_map(|(link, it)| it.collisions.iter().map(move |placed| (link, placed)))
        .collect();
    let [first, second] = pair.map(|shape| {
        let (link, placed) = placed[shape];
        let mut pose = poses[link] * placed.pose;
        if matches!(placed.shape, Shape::Cylinder { .. }) {
            pose.rotation *= UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        }
        let turn = pose.rotation.to_rotation_matrix();
        let frame =
            gaitwright_physics::model::collision::convex::frame(turn.matrix(), pose.translation.vector);
        (frame, parry(&placed.shape))
    });
    query::distance(&first.0, &*first.1, &second.0, &*second.1).unwrap().distance
}

/// Puts each character into 200 random poses within its limits.
fn pairs_said_to_stay_apart_never_touch(files: &[PathBuf]) {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut apart = 0;
    for file in files {
        let model = Model::new(common::character(file), Base::Floating);
        apart += model.pairs.apart.len();
        for &pair in &model.pairs.apart {
            assert!(!model.pairs.can_touch(pair[0], pair[1], true));
            assert!(model.pairs.can_touch(pair[0], pair[1], false));
        }
        for _ in 0..200 {
            let mut state = State::new(&model);
            for (joint, angle) in state.angles.iter_mut().enumerate() {
                let free = match model.bodies[joint + 1].dof {
                    DofKind::Revolute => [-3.2, 3.2],
                    DofKind::Prismatic => [-1.0, 1.0],
                };
                let [lower, upper] = model.limits[joint].unwrap_or(free);
                // The ends of the ranges are where shapes meet first.
                let share: f64 = rng.random_range(-0.3..1.3);
                *angle = lower + (upper - lower) * share.clamp(0.0, 1.0);
            }
            let poses = link_poses(&model, &state);
            for &pair in &model.pairs.apart {
                assert!(distance(&model, &poses, pair) > 0.0, "{}: {pair:?}", file.display());
            }
        }
    }
    assert!(apart > 0, "no pair is proven apart: nothing was tested");
}

#[test]
fn pairs_said_to_stay_apart_never_touch_within_the_joint_limits() {
    let names = ["quadruped.urdf", "biped.urdf", "hexapod.json", "snake.json"];
    pairs_said_to_stay_apart_never_touch(&names.map(common::example_path));
}

#[test]
#[ignore = "needs robot descriptions: set ROBOT_URDF_DIR"]
fn pairs_of_robots_said_to_stay_apart_never_touch_within_the_joint_limits() {
    let robots = common::robots();
    pairs_said_to_stay_apart_never_touch(&["a1.urdf", "bolt.urdf"].map(|name| robots.join(name)));
}

/// A thigh as thick as the trunk's edge is near: on hinges about one point it is joined to the trunk as on one hinge, and on hinges
/// apart from each other it is not.
#[test]
fn hinges_about_one_point_are_one_joint() {
    let link =
        |name: &str, shapes: serde_json::Value| json!({ "name": name, "density": 500, "shapes": shapes });
    let hinge = |child: &str, parent: &str, at: [f64; 3], axis: [f64; 3]| {
        json!({ "name": format!("to_{child}"), "kind": "revolute", "parent": parent, "child": child,
                "origin": { "position": at }, "axis": axis, "limits": { "lower": -1.5, "upper": 1.5 } })
    };
    let pairs = |apart: f64| {
        let thigh = json!([{ "kind": "cylinder", "radius": 0.07, "length": 0.3,
                             "pose": { "position": [0, 0, -0.2] } }]);
        let character = json!({
            "format": "gaitwright/character@1", "name": "hip",
            "links": [link("trunk", json!([{ "kind": "box", "size": [0.2, 0.3, 0.2] }])),
                      link("roll", json!([{ "kind": "sphere", "radius": 0.02 }])),
                      link("yaw", json!([{ "kind": "sphere", "radius": 0.02 }])),
                      link("thigh", thigh)],
            "joints": [hinge("roll", "trunk", [0.0, 0.1, -0.1], [1.0, 0.0, 0.0]),
                       hinge("yaw", "roll", [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
                       hinge("thigh", "yaw", [0.0, 0.0, -apart], [0.0, 1.0, 0.0])]
        });
        let text = character.to_string();
        let reading = character::read(text.as_bytes(), Source::Json, Options::default()).unwrap();
        Model::new(Arc::new(reading.character), Base::Floating).pairs
    };
    let (together, away) = (pairs(0.0), pairs(0.03));
    assert!(!together.can_touch(0, 3, false) && together.joined.len() == 6, "{together:?}");
    assert!(away.can_touch(0, 3, true) && away.joined.len() == 4, "{away:?}");
}
