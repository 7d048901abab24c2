//! Contact between links of one character.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use gaitwright_physics::character::Source;
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Effect, Feedforward, Gains, Scene, Switch};
use gaitwright_physics::sim::contact::Against;
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;

use super::{common, read};

/// A trunk with two arms that turn about z beside each other, 0.4 m apart and 0.5 m long.
fn arms() -> Arc<Model> {
    let arm = |name: &str| {
        format!(
            r#"{{"name": "{name}", "density": 500, "shapes":
                [{{"kind": "capsule", "radius": 0.04, "length": 0.5,
                   "pose": {{"position": [0.25, 0, 0], "rpy": [0, 1.5707963267948966, 0]}}}}]}}"#
        )
    };
    let hinge = |name: &str, y: f64| {
        format!(
            r#"{{"name": "{name}_hinge", "kind": "revolute", "parent": "trunk", "child": "{name}",
                "origin": {{"position": [0.2, {y}, 0]}}, "axis": [0, 0, 1], "limits": {{"lower": -1.5, "upper": 1.5}}}}"#
        )
    };
    read(
        &format!(
            r#"{{"format": "gaitwright/character@1", "name": "arms", "links": [
                {{"name": "trunk", "density": 500, "shapes": [{{"kind": "box", "size": [0.2, 0.6, 0.1]}}]}},
                {}, {}], "joints": [{}, {}]}}"#,
            arm("left"),
            arm("right"),
            hinge("left", 0.2),
            hinge("right", -0.2)
        ),
        Source::Json,
    )
}

fn floating() -> Scene {
    Scene { ground: None, gravity: [0.0; 3], ..Scene::default() }
}

/// Distance of the arms' axes, whose capsules touch at 0.08 m: they are mirror images, so that the ends are nearest.
fn clearance(simulator: &Simulator) -> f64 {
    let ends = simulator.link_poses();
    let [left, right] = [1, 2].map(|link| {
        let from = ends[link].translation.vector;
        let to = (ends[link] * nalgebra::Point3::new(0.5, 0.0, 0.0)).coords;
        [from, to]
    });
    let mut nearest = f64::INFINITY;
    for i in 0..=200 {
        for j in 0..=200 {
            let a = left[0] + (left[1] - left[0]) * (f64::from(i) / 200.0);
            let b = right[0] + (right[1] - right[0]) * (f64::from(j) / 200.0);
            nearest = nearest.min((a - b).norm());
        }
    }
    nearest - 0.08
}

#[test]
fn arms_driven_at_each_other_stop_at_each_other() {
    let model = arms();
    let gains = Gains {
        stiffness: vec![200.0; 2],
        damping: vec![2.0; 2],
        max_torque: vec![Some(30.0); 2],
        feedforward: Feedforward::None,
        ..Gains::default()
    };
    let plan = common::plan(&model, &floating(), &Accuracy::default(), Some(&gains));
    let mut simulator = Simulator::new(plan, State::new(&model));
    let targets = [-1.2, 1.2];
    let mut touched = false;
    for index in 0..1000 {
        simulator.step(Command::Track { now: &targets, next: &targets }).unwrap();
        touched |= simulator.contacts().any(|contact| matches!(contact.against, Against::Link { .. }));
        // Ends come at each other at 5 m/s at most: the curve of their way over a step is (v h)² / 2 r.
        if index % 20 == 0 {
            assert!(clearance(&simulator) > -1e-3, "{} m after {index} steps", clearance(&simulator));
        }
    }
    assert!(touched, "they never met");
    let angles = &simulator.state().angles;
    assert!(angles[0] > -0.6 && angles[1] < 0.6, "they passed through each other: {angles:?}");
}

/// Momentum after a step at the poses of its beginning, where its forces act. What a step of free flight does to it
/// is of the integrator, not of the collision, so each step is compared with one in which nothing touches; and
/// without forces of velocity, which are those of the mean velocity of the step and so know of the collision.
#[test]
fn links_that_collide_in_free_flight_change_no_momentum() {
    for restitution in [0.0, 0.6] {
        let model = arms();
        let start = |switch: Switch| {
            let mut scene = Scene { restitution, ..floating() };
            scene.effects.insert(Effect::SelfCollision, switch);
            scene.effects.insert(Effect::VelocityForces, Switch::Off);
            let mut state = State::new(&model);
            state.root.position.x = 3.0;
            state.root.angular_velocity.x = 1.0;
            state.velocities = vec![-4.0, 3.0];
            Simulator::new(common::plan(&model, &scene, &Accuracy::default(), None), state)
        };
        let (mut touching, mut passing) = (start(Switch::On), start(Switch::Off));
        let momentum = |simulator: &mut Simulator, before: &State| {
            let after = simulator.state().clone();
            let mut moved = before.clone();
            moved.velocities.copy_from_slice(&after.velocities);
            moved.root.linear_velocity = after.root.linear_velocity;
            moved.root.angular_velocity = after.root.angular_velocity;
            simulator.set_state(&moved);
            let momentum = simulator.momentum();
            simulator.set_state(&after);
            momentum
        };
        let mut touched = 0;
        for _ in 0..400 {
            let before = touching.state().clone();
            passing.set_state(&before);
            touching.step(Command::Passive).unwrap();
            passing.step(Command::Passive).unwrap();
            touched += usize::from(touching.contacts().any(|contact| contact.force.norm() > 0.0));
            let (with, without) = (momentum(&mut touching, &before), momentum(&mut passing, &before));
            assert!((with.linear - without.linear).norm() < 1e-9, "{}", with.linear - without.linear);
            assert!((with.angular - without.angular).norm() < 1e-9, "{}", with.angular - without.angular);
        }
        assert!(touched > 0, "they never met");
    }
}

#[test]
fn arms_that_start_deep_in_each_other_part_without_a_launch() {
    let model = arms();
    let plan = common::plan(&model, &floating(), &Accuracy::default(), None);
    let mut state = State::new(&model);
    state.angles = vec![-0.42, 0.42];
    let mut simulator = Simulator::new(plan, state);
    assert!(clearance(&simulator) < -0.05, "{}", clearance(&simulator));
    for _ in 0..1000 {
        simulator.step(Command::Passive).unwrap();
        // Correcting penetration leaves no speed behind; 0.2 m/s at a lever of 0.3 m would be slow, too.
        let fastest = simulator.state().velocities.iter().fold(0.0_f64, |most, rate| most.max(rate.abs()));
        assert!(fastest < 0.2 / 0.3, "{fastest} rad/s");
    }
    assert!(clearance(&simulator) > -1e-3, "{} m", clearance(&simulator));
}

/// A snake whose joints are all driven to roll it up more than once.
/// Forces between links change nothing about the motion of a rigid whole, which the feedforward's problem is about: it does not ask for
/// any, and is solved.
#[test]
fn a_snake_that_curls_up_does_not_pass_through_itself() {
    for feedforward in [Feedforward::None, Feedforward::ContactFree, Feedforward::ContactAware] {
        curls_up(feedforward);
    }
}

fn curls_up(feedforward: Feedforward) {
    let model = common::example("snake.json");
    let joints = model.joint_count();
    let gains = Gains {
        stiffness: vec![20.0; joints],
        damping: vec![0.5; joints],
        max_torque: vec![None; joints],
        feedforward,
        ..Gains::default()
    };
    let target: Vec<f64> =
        model.limits.iter().map(|limits| limits.map_or(1.0, |[_, upper]| upper.min(1.0))).collect();
    let mut scene = floating();
    scene.effects.insert(Effect::JointLimits, Switch::Off);
    let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&gains));
    let mut simulator = Simulator::new(plan, State::new(&model));
    let mut deepest: f64 = 0.0;
    let mut touched = false;
    let mut now = vec![0.0; joints];
    for index in 1..=1000 {
        let next: Vec<f64> = target.iter().map(|angle| angle * (f64::from(index) / 500.0).min(1.0)).collect();
        simulator.step(Command::Track { now: &now, next: &next }).unwrap();
        now = next;
        for contact in simulator.contacts() {
            touched = true;
            deepest = deepest.max(contact.depth);
        }
    }
    assert!(touched, "{feedforward:?}: it never touched itself");
    assert!(deepest < 1e-3, "{feedforward:?}: {deepest} m deep");
    assert_eq!(simulator.record().unsolved_steps, 0, "{feedforward:?}");
}

/// An arm that turns by a radian to either side, and a post where its hand would be after two radians.
fn arm_and_post() -> Arc<Model> {
    let inertial = |mass: f64| {
        let inertia = 0.02 * mass;
        format!(
            r#"<inertial><mass value="{mass}"/><inertia ixx="{inertia}" ixy="0" ixz="0" iyy="{inertia}" iyz="0" izz="{inertia}"/></inertial>"#
        )
    };
    let shape = |at: &str, size: &str| {
        format!(r#"<collision><origin xyz="{at}"/><geometry><box size="{size}"/></geometry></collision>"#)
    };
    let joint = |name: &str, parent: &str, child: &str, at: &str, range: f64| {
        format!(
            r#"<joint name="{name}" type="revolute"><origin xyz="{at}"/><parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>
              <limit lower="-{range}" upper="{range}" effort="100" velocity="100"/></joint>"#
        )
    };
    let post = format!("{} {} 0", 0.5 * 2.0_f64.cos(), 0.5 * 2.0_f64.sin());
    read(
        &format!(
            r#"<robot name="arm"><link name="base">{}{}</link><link name="arm">{}</link><link name="hand">{}{}</link>{}{}</robot>"#,
            inertial(1e4),
            shape(&post, "0.05 0.05 0.2"),
            inertial(1.0),
            inertial(1.0),
            shape("0 0 0", "0.05 0.05 0.05"),
            joint("shoulder", "base", "arm", "0 0 0", 1.0),
            joint("wrist", "arm", "hand", "0.5 0 0", 0.1),
        ),
        Source::Urdf,
    )
}

#[test]
fn what_only_the_joint_limits_keep_apart_touches_without_them() {
    let model = arm_and_post();
    assert_eq!((model.pairs.count, model.pairs.apart.len()), (0, 1));
    let reach = |limits: Switch| {
        let gains = Gains {
            stiffness: vec![50.0; 2],
            damping: vec![5.0; 2],
            max_torque: vec![None; 2],
            feedforward: Feedforward::None,
            ..Gains::default()
        };
        let mut scene = floating();
        scene.effects.insert(Effect::JointLimits, limits);
        let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&gains));
        assert_eq!(plan.self_collision, limits == Switch::Off);
        let mut simulator = Simulator::new(plan, State::new(&model));
        for index in 0..1500 {
            let [now, next] = [index, index + 1].map(|index| [(0.003 * f64::from(index)).min(3.0), 0.0]);
            simulator.step(Command::Track { now: &now, next: &next }).unwrap();
        }
        simulator.state().angles[0]
    };
    // Where hand and post touch, their middles are at least 0.05 m apart: a tenth of a radian before the post.
    let (limited, free) = (reach(Switch::Auto), reach(Switch::Off));
    assert!((limited - 1.0).abs() < 1e-3, "{limited}");
    assert!((1.8..2.0).contains(&free), "{free}");
}

/// An arm that turns and slides out beside a post, each with a hand.
pub fn sliding_arm() -> Arc<Model> {
    let link = |name: &str, size: &str| {
        format!(r#"{{"name": "{name}", "density": 500, "shapes": [{{"kind": "box", "size": {size}}}]}}"#)
    };
    let joint = |kind: &str, parent: &str, child: &str, at: &str, axis: &str, range: [f64; 2]| {
        let [lower, upper] = range;
        format!(
            r#"{{"name": "{child}_joint", "kind": "{kind}", "parent": "{parent}", "child": "{child}",
                "origin": {{"position": {at}}}, "axis": {axis}, "limits": {{"lower": {lower}, "upper": {upper}}}}}"#
        )
    };
    let links = [
        link("trunk", "[0.3, 0.3, 0.1]"),
        link("post", "[0.05, 0.05, 0.3]"),
        link("arm", "[0.05, 0.05, 0.05]"),
        link("slider", "[0.1, 0.04, 0.04]"),
        link("hand", "[0.1, 0.1, 0.04]"),
    ];
    let joints = [
        joint("revolute", "trunk", "post", "[0.1, 0.1, 0.25]", "[0, 1, 0]", [-1.0, 1.0]),
        joint("revolute", "trunk", "arm", "[-0.1, -0.1, 0.15]", "[0, 0, 1]", [-3.0, 3.0]),
        joint("prismatic", "arm", "slider", "[0.1, 0, 0]", "[1, 0, 0]", [0.0, 0.4]),
        joint("revolute", "slider", "hand", "[0.12, 0, 0]", "[0, 1, 0]", [-2.0, 2.0]),
    ];
    let text = format!(
        r#"{{"format": "gaitwright/character@1", "name": "sliding arm", "links": [{}], "joints": [{}]}}"#,
        links.join(", "),
        joints.join(", ")
    );
    read(&text, Source::Json)
}

/// What touches is found by what was known of it, but it is what would be found without: a simulation that forgets
/// everything but its state after each step goes the same way, bit for bit.
#[test]
fn what_is_kept_of_distances_does_not_matter() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let obstacle = |x: f64, y: f64| {
        super::obstacle(&format!(
            r#"{{"kind": "sphere", "radius": 0.2, "pose": {{"position": [{x}, {y}, 0.1]}}}}"#
        ))
    };
    let (mut with_itself, mut with_obstacles) = (0, 0);
    for case in 0..24 {
        let model = if case % 2 == 0 { common::example("quadruped.urdf") } else { sliding_arm() };
        let joints = model.joint_count();
        let mut scene = Scene::default();
        if case % 4 < 2 {
            scene.obstacles =
                (0..3).map(|_| obstacle(rng.random_range(-0.5..0.5), rng.random_range(-0.5..0.5))).collect();
        }
        let accuracy = Accuracy { step: [0.002, 0.004, 0.008][case / 8], ..Accuracy::default() };
        let plan = common::plan(&model, &scene, &accuracy, None);
        assert!(plan.self_collision);
        let mut state = State::new(&model);
        state.root.position = Point3::new(0.0, 0.0, 0.6);
        state.root.angular_velocity = Vector3::from_fn(|_, _| rng.random_range(-3.0..3.0));
        let mut going = Simulator::new(plan.clone(), state);
        let mut torques = vec![0.0; joints];
        for step in 0..300 {
            if step % 50 == 0 {
                torques.fill_with(|| rng.random_range(-3.0..3.0));
            }
            let mut taken_up = Simulator::new(plan.clone(), going.state().clone());
            going.step(Command::Torque(&torques)).unwrap();
            taken_up.step(Command::Torque(&torques)).unwrap();
            assert_eq!(going.state(), taken_up.state(), "case {case}, step {step}");
            for contact in going.contacts() {
                match contact.against {
                    Against::Link { .. } => with_itself += 1,
                    Against::Obstacle(_) => with_obstacles += 1,
                    Against::Ground => {}
                }
            }
        }
    }
    assert!(with_itself > 500 && with_obstacles > 500, "{with_itself} {with_obstacles}");
}

#[test]
fn self_collision_that_never_acts_changes_no_bit() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let end = |switch: Switch| {
        let mut scene = Scene::default();
        scene.effects.insert(Effect::SelfCollision, switch);
        let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&stance.gains));
        assert_eq!(plan.self_collision, switch != Switch::Off);
        let mut simulator = Simulator::new(plan, stance.state.clone());
        for _ in 0..250 {
            simulator.step(Command::Track { now: &stance.angles, next: &stance.angles }).unwrap();
        }
        simulator.state().clone()
    };
    assert_eq!(end(Switch::On), end(Switch::Off));
}
