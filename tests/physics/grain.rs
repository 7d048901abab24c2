//! Friction that depends on the direction of sliding, against the equations of motion of a point that slides with it.

use std::sync::Arc;

use gaitwright_physics::character::{self, Friction, NoteKind, Options, Reading, Source};
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{
    Accuracy, Coordinates, FrictionCone, Integrator, Obstacle, Scene, SolverChoice, SolverKind,
};
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{UnitQuaternion, Vector2, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde_json::{Value, json};

use crate::common;

const GRAVITY: f64 = 9.81;

fn read(document: &Value) -> Result<Reading, InputError> {
    character::read(document.to_string().as_bytes(), Source::Json, Options::default())
}

fn model(links: Value, joints: Value) -> Arc<Model> {
    let document =
        json!({"format": "gaitwright/character@1", "name": "it", "links": links, "joints": joints});
    Arc::new(Model::new(Arc::new(read(&document).unwrap().character), Base::Floating))
}

/// A flat block, so that friction hardly tilts it, with this friction.
fn block(friction: Value) -> Arc<Model> {
    let shape = json!({"kind": "box", "size": [0.4, 0.4, 0.02]});
    model(json!([{"name": "block", "density": 500, "shapes": [shape], "friction": friction}]), json!([]))
}

fn directional(along: f64, across: f64) -> Value {
    json!({"along": along, "across": across, "axis": [2, 0, 0]})
}

/// On an incline of `slope` (rad) down along x, which is gravity that leans.
fn incline(slope: f64) -> Scene {
    let gravity = [GRAVITY * slope.sin(), 0.0, -GRAVITY * slope.cos()];
    Scene { gravity, friction: 10.0, ..Scene::default() }
}

/// The block on the plane, turned by `yaw`, sliding at `velocity`.
fn placed(model: &Arc<Model>, yaw: f64, velocity: Vector2<f64>) -> State {
    let mut state = State::new(model);
    state.root.position.z = 0.01;
    state.root.orientation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw);
    state.root.linear_velocity = velocity.push(0.0);
    state
}

/// Velocity and travel after `seconds` of a point that slides down `incline(slope)` under the friction of greatest power within the
/// ellipse with semi-axes μ along the directions at `yaw` and across: Runge and Kutta's method with tiny steps.
fn slid(slope: f64, yaw: f64, mu: [f64; 2], start: Vector2<f64>, seconds: f64) -> [Vector2<f64>; 2] {
    let axes = [Vector2::new(yaw.cos(), yaw.sin()), Vector2::new(-yaw.sin(), yaw.cos())];
    let acceleration = |velocity: Vector2<f64>| {
        let parts = [0, 1].map(|side| mu[side] * axes[side].dot(&velocity));
        let length = parts[0].hypot(parts[1]);
        let friction: Vector2<f64> = (0..2).map(|side| axes[side] * mu[side] * parts[side] / length).sum();
        Vector2::new(GRAVITY * slope.sin(), 0.0) - friction * GRAVITY * slope.cos()
    };
    const STEPS: usize = 20_000;
    let step = seconds / STEPS as f64;
    let (mut velocity, mut travel) = (start, Vector2::zeros());
    for _ in 0..STEPS {
        let first = acceleration(velocity);
        let second = acceleration(velocity + first * step / 2.0);
        let third = acceleration(velocity + second * step / 2.0);
        let fourth = acceleration(velocity + third * step);
        let change = (first + second * 2.0 + third * 2.0 + fourth) * (step / 6.0);
        travel += (velocity + change / 2.0) * step;
        velocity += change;
    }
    [velocity, travel]
}

#[test]
fn a_block_slides_askew_down_an_incline() {
    for (friction, slope, yaw, start) in [
        ([0.15, 0.45], 0.5_f64, 0.6_f64, Vector2::new(0.3, 0.0)),
        ([0.15, 0.45], 0.5, -1.1, Vector2::new(0.0, 0.8)),
        ([0.45, 0.15], 0.5, 0.0, Vector2::new(0.2, -0.4)),
        ([0.15, 0.45], 0.8, std::f64::consts::FRAC_PI_2, Vector2::new(0.5, 0.5)),
        ([0.0, 0.4], 0.3, 0.5, Vector2::new(0.3, 0.5)),
        ([0.4, 0.0], 0.3, -0.5, Vector2::new(0.3, 0.5)),
    ] {
        let [velocity, travel] = slid(slope, yaw, friction, start, 0.8);
        for (coordinates, integrator) in [
            (Coordinates::Reduced, Integrator::SemiImplicitEuler),
            (Coordinates::Reduced, Integrator::MoreauJean),
            (Coordinates::Maximal, Integrator::SemiImplicitEuler),
        ] {
            let accuracy = Accuracy { step: 0.001, coordinates, integrator, ..Accuracy::default() };
            let model = block(directional(friction[0], friction[1]));
            let plan = common::plan(&model, &incline(slope), &accuracy, None);
            let mut simulator = Simulator::new(plan, placed(&model, yaw, start));
            for _ in 0..800 {
                simulator.step(Command::Passive).unwrap();
            }
            let root = simulator.state().root;
            // The step is first order: an acceleration of at most 10 m/s² that changes over a step of 1 ms, for 0.8 s.
            let (slip, way) = (root.linear_velocity.xy() - velocity, root.position.coords.xy() - travel);
            assert!(
                slip.norm() < 8e-3 && way.norm() < 8e-3,
                "{slope} {yaw} {coordinates:?} {integrator:?}: {slip} m/s, {way} m"
            );
        }
        let uniform = slid(slope, yaw, [0.5 * (friction[0] + friction[1]); 2], start, 0.8)[1];
        assert!((uniform - travel).norm() > 0.05, "the directions matter: {uniform} {travel}");
    }
}

/// It sticks where the slope's direction lies within the ellipse, |(cos ψ / μ₁, sin ψ / μ₂)| tan α < 1, and slides beyond.
#[test]
fn a_block_sticks_within_the_ellipse() {
    let [along, across] = [0.2, 0.6];
    for yaw in [0.0_f64, 0.3, 0.8, 1.2, 1.5] {
        let greatest = 1.0 / (yaw.cos() / along).hypot(yaw.sin() / across);
        for share in [0.98, 1.02] {
            let model = block(directional(along, across));
            let plan = common::plan(&model, &incline((share * greatest).atan()), &Accuracy::default(), None);
            let mut simulator = Simulator::new(plan, placed(&model, yaw, Vector2::zeros()));
            for _ in 0..500 {
                simulator.step(Command::Passive).unwrap();
            }
            let speed = simulator.state().root.linear_velocity.norm();
            // Two hundredths beyond the ellipse leave 0.02 μ g of acceleration and more, over 1 s.
            if share < 1.0 {
                assert!(speed < 1e-8, "{yaw}: {speed} m/s");
            } else {
                assert!(speed > 0.01, "{yaw}: {speed} m/s");
            }
        }
    }
}

/// With the pyramid each direction has its own bound: the force across is at its bound μ₂ whatever the sliding along.
#[test]
fn the_pyramid_is_aligned_with_the_axis() {
    let (yaw, [along, across]) = (0.7_f64, [0.1, 0.3]);
    let directions = [Vector3::new(yaw.cos(), yaw.sin(), 0.0), Vector3::new(-yaw.sin(), yaw.cos(), 0.0)];
    for kind in [SolverKind::Newton, SolverKind::Pgs, SolverKind::Lemke] {
        let solver = SolverChoice { kind, iterations: 500, ..SolverChoice::default() };
        let accuracy = Accuracy { friction_cone: FrictionCone::Pyramid, solver, ..Accuracy::default() };
        let model = block(directional(along, across));
        let plan = common::plan(&model, &incline(0.0), &accuracy, None);
        let start = (directions[0] * 1.0 + directions[1] * 2.0).xy();
        let mut simulator = Simulator::new(plan, placed(&model, yaw, start));
        for _ in 0..50 {
            simulator.step(Command::Passive).unwrap();
        }
        let velocity = simulator.state().root.linear_velocity;
        for (direction, (before, mu)) in directions.iter().zip([(1.0, along), (2.0, across)]) {
            let left = before - mu * GRAVITY * 0.1;
            assert!((velocity.dot(direction) - left).abs() < 1e-6, "{kind:?}: {velocity} along {direction}");
        }
    }
}

/// The force is within the ellipse, takes power from every sliding contact, and no force within the ellipse takes more.
#[test]
fn friction_takes_the_greatest_power() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let (mut slid, mut stuck) = (0, 0);
    for case in 0..200 {
        let [along, across] = [random.random_range(0.0..0.8), random.random_range(0.0..0.8_f64)];
        let model = block(directional(along, across));
        let plan = common::plan(&model, &incline(random.random_range(0.0..0.6)), &Accuracy::default(), None);
        let mut sideways = || random.random_range(-1.0..1.0);
        let start = Vector2::new(sideways(), sideways());
        let mut state = placed(&model, sideways() * 3.0, start);
        state.root.angular_velocity.z = 3.0 * sideways();
        let mut simulator = Simulator::new(plan, state);
        for _ in 0..100 {
            let rotation = simulator.state().root.orientation;
            let before = simulator.substeps();
            simulator.step(Command::Passive).unwrap();
            let whole = simulator.substeps() - before == 1;
            let axes = [rotation * Vector3::x(), rotation * Vector3::y()];
            for contact in simulator.contacts() {
                let push = contact.force.z;
                let [first, second] = axes.map(|axis| axis.dot(&contact.force));
                let share = |force: f64, mu: f64| if force.abs() < 1e-9 { 0.0 } else { force / (mu * push) };
                let used = share(first, along).hypot(share(second, across));
                assert!(used < 1.0 + 1e-6, "case {case}: {used} of the ellipse");
                let slip = contact.velocity;
                let power = -(contact.force - Vector3::z() * push).dot(&slip);
                let most = push * (along * axes[0].dot(&slip)).hypot(across * axes[1].dot(&slip));
                // 1e-9 m/s are left by the solver.
                assert!(power > -1e-8 * push.max(1.0), "case {case}: {power} W");
                if whole {
                    assert!((power - most).abs() < 1e-6 * push.max(1.0), "case {case}: {power} of {most} W");
                }
                if slip.norm() > 1e-3 { slid += 1 } else { stuck += 1 }
            }
        }
    }
    assert!(slid > 10_000 && stuck > 1_000, "{slid} sliding, {stuck} sticking");
}

/// Two equal coefficients are one: the same bits, whatever the axis.
#[test]
fn equal_coefficients_have_no_direction() {
    let run = |friction: Value| {
        let model = block(friction);
        let plan = common::plan(&model, &incline(0.3), &Accuracy::default(), None);
        let mut simulator = Simulator::new(plan, placed(&model, 0.4, Vector2::new(0.5, 0.2)));
        (0..200).for_each(|_| simulator.step(Command::Passive).unwrap());
        simulator.state().root
    };
    let own = run(json!({"along": 0.3, "across": 0.3, "axis": [1, 2, 0]}));
    assert_eq!(own, run(json!(0.3)));
    // Where the ground's friction is less than both, it holds in every direction.
    let slippery = |friction: Value| {
        let model = block(friction);
        let scene = Scene { friction: 0.1, ..incline(0.3) };
        let plan = common::plan(&model, &scene, &Accuracy::default(), None);
        let mut simulator = Simulator::new(plan, placed(&model, 0.4, Vector2::new(0.5, 0.2)));
        (0..200).for_each(|_| simulator.step(Command::Passive).unwrap());
        simulator.state().root
    };
    assert_eq!(slippery(directional(0.3, 0.5)), slippery(json!(0.9)));
}

/// A ball has its axis at any tilt: the coefficient along its projection is √(along² cos² φ + across² sin² φ).
#[test]
fn a_tilted_axis_grips_between_along_and_across() {
    let [along, across] = [0.1, 0.4];
    for tilt in [0.0_f64, 0.4, 1.0, 1.4, std::f64::consts::FRAC_PI_2] {
        let axis = [tilt.cos(), 0.0, tilt.sin()];
        let friction = json!({"along": along, "across": across, "axis": axis});
        let model = block(friction);
        let plan = common::plan(&model, &incline(0.0), &Accuracy::default(), None);
        let mut simulator = Simulator::new(plan, placed(&model, 0.0, Vector2::new(2.0, 0.0)));
        (0..100).for_each(|_| simulator.step(Command::Passive).unwrap());
        let lost = 2.0 - simulator.state().root.linear_velocity.x;
        let expected = (along * tilt.cos()).hypot(across * tilt.sin()) * GRAVITY * 0.2;
        assert!((lost - expected).abs() < 1e-6, "tilt {tilt}: {lost} m/s instead of {expected}");
    }
}

/// An axis belongs to its link, also where that is fixed to another, and holds against obstacles and other links.
#[test]
fn the_axis_follows_its_link_on_anything() {
    let sole = json!({"name": "sole", "density": 500, "shapes": [{"kind": "box", "size": [0.4, 0.4, 0.02]}],
                      "friction": {"along": 0.1, "across": 0.5, "axis": [1, 0, 0]}});
    let top = json!({"name": "top", "density": 100, "shapes": [{"kind": "box", "size": [0.1, 0.1, 0.02]}]});
    let welded = model(
        json!([top, sole]),
        json!([{"name": "weld", "kind": "fixed", "parent": "top", "child": "sole",
                "origin": {"position": [0, 0, -0.02], "rpy": [0, 0, std::f64::consts::FRAC_PI_2]}}]),
    );
    let table: Obstacle =
        serde_json::from_value(json!({"shape": {"kind": "box", "size": [20, 20, 1]}, "friction": 10}))
            .unwrap();
    let on_table = Scene { obstacles: vec![table], ground: None, ..incline(0.0) };
    for (scene, height) in [(incline(0.0), 0.03), (on_table, 0.53)] {
        for coordinates in [Coordinates::Reduced, Coordinates::Maximal] {
            let accuracy = Accuracy { coordinates, ..Accuracy::default() };
            let plan = common::plan(&welded, &scene, &accuracy, None);
            let mut state = placed(&welded, 0.0, Vector2::new(1.0, 0.0));
            state.root.position.z = height;
            let mut simulator = Simulator::new(plan, state);
            (0..50).for_each(|_| simulator.step(Command::Passive).unwrap());
            // Turned by a right angle, it slides across.
            let left = 1.0 - 0.5 * GRAVITY * 0.1;
            let speed = simulator.state().root.linear_velocity.x;
            assert!(
                (speed - left).abs() < 1e-4,
                "{coordinates:?} at {height}: {speed} instead of {left} m/s"
            );
        }
    }
}

#[test]
fn a_friction_without_sense_is_refused_with_its_place() {
    let link = |friction: Value| {
        let link = json!({"name": "it", "density": 250, "shapes": [{"kind": "sphere", "radius": 0.1}],
                          "friction": friction});
        read(&json!({"format": "gaitwright/character@1", "name": "it", "links": [link]}))
    };
    for (friction, pointer, reason) in [
        (directional(-0.1, 1.0), "/links/0", "along its axis must be a finite number of at least 0"),
        (directional(0.1, -1.0), "/links/0", "across its axis must be a finite number of at least 0"),
        (json!({"along": 1, "across": 1, "axis": [0, 0, 0]}), "/links/0/friction/axis", "the axis is zero"),
        (json!({"along": 1, "axis": [0, 0, 1]}), "/links/0/friction", "missing field `across`"),
        (
            json!({"along": 1, "across": 1, "axis": [0, 0, 1], "grip": 1}),
            "/links/0/friction/grip",
            "unknown field",
        ),
        (json!("rough"), "/links/0/friction", "a number, or an object with `along`, `across` and `axis`"),
        (
            json!([1, 2, [0, 0, 1]]),
            "/links/0/friction",
            "a number, or an object with `along`, `across` and `axis`",
        ),
    ] {
        let faults = link(friction).unwrap_err();
        let fault = &faults.faults()[0];
        assert_eq!(fault.pointer, pointer, "{fault:?}");
        assert!(fault.reason.contains(reason), "{fault:?}");
    }
    let schema = &character::schema()["$defs"]["Friction"]["anyOf"];
    assert_eq!(
        (schema[0]["type"].as_str(), schema[0]["minimum"].as_f64()),
        (Some("number"), Some(0.0)),
        "{schema}"
    );
    assert!(schema[1]["$ref"].as_str().is_some_and(|name| name.ends_with("DirectionalFriction")), "{schema}");
}

#[test]
fn gazebo_gives_a_direction() {
    let text = |gazebo: &str| {
        format!(
            r#"<robot name="r"><link name="a"><inertial><mass value="1"/>
            <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
            <collision><origin rpy="0 0 1.5707963267948966"/><geometry><sphere radius="1"/></geometry></collision>
            </link><gazebo reference="a"><mu1>0.6</mu1><mu2>0.4</mu2>{gazebo}</gazebo></robot>"#
        )
    };
    let read = |gazebo: &str| character::read(text(gazebo).as_bytes(), Source::Urdf, Options::default());
    let Reading { character, notes } = read("<fdir1>0 2 0</fdir1>").unwrap();
    let Some(Friction::Directional { along, across, axis }) = character.links[0].surface.friction else {
        panic!("{:?}", character.links[0].surface)
    };
    assert_eq!((along, across), (0.6, 0.4));
    assert!((axis.into_inner() + Vector3::x()).norm() < 1e-12, "{axis:?}");
    assert!(notes.iter().all(|note| note.kind != NoteKind::Approximated), "{notes:?}");
    assert!(read("<fdir1>0 0 0</fdir1>").unwrap_err().to_string().contains("the axis is zero"));
    assert!(read("<fdir1>0 1</fdir1>").unwrap_err().to_string().contains("which is not 3 finite numbers"));
}
