//! Spin about an axis of symmetry moves neither mass nor surface, and divides no step.

use std::fmt::Write;
use std::sync::Arc;

use gaitwright_physics::character::{Character, Friction};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{UnitQuaternion, Vector3};

use crate::bodies;
use crate::common;

const STEP: f64 = 0.002;

/// A link with one shape about z, of 1 kg with these principal moments.
fn round(shape: &str, [x, z]: [f64; 2]) -> Arc<Model> {
    bodies::urdf(
        &format!(
            r#"<robot name="round"><link name="round"><inertial><mass value="1"/>
            <inertia ixx="{x:?}" ixy="0" ixz="0" iyy="{x:?}" iyz="0" izz="{z:?}"/></inertial>
            <collision><geometry>{shape}</geometry></collision></link></robot>"#
        ),
        false,
    )
}

/// The record of half a second in the default scene, from `start`.
fn run(model: &Arc<Model>, start: State) -> Simulator {
    let accuracy = Accuracy { step: STEP, ..Accuracy::default() };
    let plan = common::plan(model, &Scene::default(), &accuracy, None);
    let mut simulator = Simulator::new(plan, start);
    for _ in 0..250 {
        simulator.step(Command::Passive).unwrap();
    }
    simulator
}

#[test]
fn round_bodies_spin_without_divisions() {
    let cylinder = r#"<cylinder radius="0.1" length="0.2"/>"#;
    let capsule = r#"<capsule radius="0.1" length="0.2"/>"#;
    let ball = r#"<sphere radius="0.1"/>"#;
    for (name, model, resting) in [
        ("cylinder", round(cylinder, [0.006, 0.005]), 0.1),
        ("capsule", round(capsule, [0.012, 0.005]), 0.2),
        ("ball", round(ball, [0.004, 0.004]), 0.1),
    ] {
        // 2 rad a step about the axis: in the air, and upright on the ground.
        for height in [3.0, resting] {
            let mut start = State::new(&model);
            start.root.position.z = height;
            start.root.angular_velocity = Vector3::z() * 1000.0;
            let record = *run(&model, start).record();
            assert_eq!(record.divided_steps, 0, "{name} at {height} m: {record:?}");
        }
    }
}

#[test]
fn the_same_spin_about_another_axis_divides() {
    let model = round(r#"<cylinder radius="0.1" length="0.2"/>"#, [0.006, 0.005]);
    let mut start = State::new(&model);
    start.root.position.z = 3.0;
    start.root.angular_velocity = Vector3::x() * 1000.0;
    let record = *run(&model, start).record();
    assert_eq!(record.divided_steps, 250);
    // 2 rad a step, at most 0.3 rad a substep.
    assert!(record.greatest_substeps >= 7, "{record:?}");
    // A cube weighs alike about every axis, but does not look alike.
    let mut start = State::new(&bodies::cube());
    start.root.position.z = 3.0;
    start.root.angular_velocity = Vector3::z() * 1000.0;
    assert_eq!(run(&bodies::cube(), start).record().divided_steps, 250);
}

/// What the skin grips along turns with it, unless it lies along the axis of the spin.
#[test]
fn a_spin_that_turns_what_the_skin_grips_along_divides() {
    let ball = round(r#"<sphere radius="0.1"/>"#, [0.004, 0.004]);
    for (axis, divided) in [(Vector3::x_axis(), 250), (Vector3::z_axis(), 0)] {
        let mut character = Character::clone(&ball.character);
        character.links[0].surface.friction = Some(Friction::Directional { along: 0.2, across: 0.8, axis });
        let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
        let mut start = State::new(&model);
        start.root.position.z = 3.0;
        start.root.angular_velocity = Vector3::z() * 1000.0;
        assert_eq!(run(&model, start).record().divided_steps, divided, "along {axis:?}");
    }
}

/// A chassis of 20 kg on four wheels of 0.1 m.
fn rover() -> Arc<Model> {
    let mut text = String::from(
        r#"<robot name="rover"><link name="chassis"><inertial><mass value="20"/>
        <inertia ixx="0.3" ixy="0" ixz="0" iyy="0.8" iyz="0" izz="1"/></inertial>
        <collision><geometry><box size="0.6 0.3 0.1"/></geometry></collision></link>"#,
    );
    for (wheel, [x, y]) in [[0.25, 0.2], [0.25, -0.2], [-0.25, 0.2], [-0.25, -0.2]].into_iter().enumerate() {
        let _ = write!(
            text,
            r#"<link name="wheel{wheel}"><inertial><mass value="1"/>
            <inertia ixx="0.003" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.003"/></inertial>
            <collision><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.1" length="0.05"/></geometry>
            </collision></link>
            <joint name="axle{wheel}" type="continuous"><parent link="chassis"/><child link="wheel{wheel}"/>
            <origin xyz="{x:?} {y:?} -0.05"/><axis xyz="0 1 0"/></joint>"#
        );
    }
    text.push_str("</robot>");
    bodies::urdf(&text, false)
}

/// Rolling at `speed` m/s in the direction `heading` rad.
fn rolling(model: &Arc<Model>, speed: f64, heading: f64) -> Simulator {
    let mut start = State::new(model);
    start.root.position.z = 0.15;
    start.root.orientation = UnitQuaternion::from_scaled_axis(Vector3::z() * heading);
    start.root.linear_velocity = Vector3::new(heading.cos(), heading.sin(), 0.0) * speed;
    start.velocities.fill(speed / 0.1);
    run(model, start)
}

/// At 40 m/s the wheels turn by 0.8 rad a step.
#[test]
fn a_fast_rover_costs_no_more_than_one_at_rest() {
    let model = rover();
    let (at_rest, fast) = (rolling(&model, 0.0, 0.4), rolling(&model, 40.0, 0.4));
    assert_eq!(at_rest.record().divided_steps, 0);
    assert_eq!(fast.record().divided_steps, 0, "{:?}", fast.record());
    assert_eq!(fast.record().unsolved_steps, 0);
    let [rest, moving] = [&at_rest, &fast].map(Simulator::evaluations);
    assert!(moving as f64 <= 1.1 * rest as f64, "{moving} evaluations against {rest} at rest");
    // Nothing slows it down, and nothing lifts it.
    let state = fast.state();
    assert!((state.root.linear_velocity.norm() / 40.0 - 1.0).abs() < 1e-6);
    assert!((state.root.position.coords.xy().norm() / 20.0 - 1.0).abs() < 1e-6);
    assert!((state.root.position.z - at_rest.state().root.position.z).abs() < 1e-5);
}
