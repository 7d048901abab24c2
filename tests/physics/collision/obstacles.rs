//! Contact with obstacles and height fields.

use gaitwright_physics::scene::{
    Accuracy, Effect, FrictionCone, Ground, Scene, SolverChoice, SolverKind, Switch,
};
use gaitwright_physics::sim::contact::Against;
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;
use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::{GRAVITY, body, common, obstacle, run, simulator};

const CUBE: &str = r#"<box size="0.2 0.2 0.2"/>"#;

/// A slope about the y axis, falling toward +x by `angle`, whose surface passes through the origin: as an
/// obstacle and as a height field.
fn slopes(angle: f64, friction: f64) -> [Scene; 2] {
    let (sine, cosine) = angle.sin_cos();
    let board = obstacle(&format!(
        r#"{{"kind": "box", "size": [20, 4, 1],
             "pose": {{"rpy": [0, {angle}, 0], "position": [{}, 0, {}]}}}}"#,
        -0.5 * sine,
        -0.5 * cosine
    ));
    let edge = 10.0 * angle.tan();
    let field = Ground::HeightField {
        heights: vec![vec![edge, 0.0, -edge]; 4],
        size: [20.0, 4.0],
        center: [0.0, 0.0],
    };
    [
        Scene { ground: None, obstacles: vec![board], friction, ..Scene::default() },
        Scene { ground: Some(field), friction, ..Scene::default() },
    ]
}

/// A cube at rest on the slope through the origin.
fn on_slope(scene: &Scene, angle: f64, step: f64) -> Simulator {
    let model = body(CUBE);
    let mut state = State::new(&model);
    state.root.orientation = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle);
    state.root.position = Point3::from(state.root.orientation * Vector3::new(0.013, 0.017, 0.1));
    simulator(&model, scene, step, state)
}

/// The acceleration is constant, so that the speed is exact at any step.
#[test]
fn a_cube_slides_down_a_steep_slope_as_coulomb_says() {
    let (angle, friction): (f64, f64) = (0.5, 0.3);
    let acceleration = GRAVITY * (angle.sin() - friction * angle.cos());
    for scene in slopes(angle, friction) {
        let mut simulator = on_slope(&scene, angle, 0.002);
        run(&mut simulator, 0.5);
        let velocity = simulator.state().root.linear_velocity;
        let along = Vector3::new(angle.cos(), 0.0, -angle.sin());
        assert!((velocity - along * acceleration * 0.5).norm() < 1e-6, "{velocity} {:?}", scene.ground);
        assert!(simulator.state().root.angular_velocity.norm() < 1e-6, "it tumbles");
    }
}

/// Floor and ceiling are nearer to each other than the cube is high, and each asks it to leave at the speed of a recovery: no
/// motion does. The cube stays in the middle, no force is greater than its weight, and every step says that it was not solved.
#[test]
fn a_cube_between_walls_that_are_too_close_stays_there() {
    let overlap = 0.002;
    let middle = Point3::new(0.0, 0.0, 0.1 - overlap);
    let ceiling = obstacle(&format!(
        r#"{{"kind": "box", "size": [2, 2, 1], "pose": {{"position": [0, 0, {}]}}}}"#,
        0.7 - 2.0 * overlap
    ));
    let scene = Scene { obstacles: vec![ceiling], ..Scene::default() };
    let (model, weight) = (body(CUBE), 2.0 * GRAVITY);
    let cases = [
        (SolverKind::Newton, FrictionCone::Cone, 0.002),
        (SolverKind::Newton, FrictionCone::Cone, 0.008),
        (SolverKind::Newton, FrictionCone::Pyramid, 0.002),
        // Pivoting finds that the overlaps have no solution, and says so.
        (SolverKind::Lemke, FrictionCone::Pyramid, 0.002),
    ];
    for (kind, friction_cone, step) in cases {
        let mut state = State::new(&model);
        state.root.position = middle;
        let usual = SolverChoice::default();
        let iterations = if kind == SolverKind::Lemke { 1000 } else { usual.iterations };
        let solver = SolverChoice { kind, iterations, ..usual };
        let accuracy = Accuracy { step, solver, friction_cone, ..Accuracy::default() };
        let mut simulator = Simulator::new(common::plan(&model, &scene, &accuracy, None), state);
        run(&mut simulator, 2.0);
        let root = simulator.state().root;
        let away = (root.position - middle).norm();
        assert!(away < 1e-3 * overlap, "it left the middle by {away} m");
        assert!(root.linear_velocity.norm() < 1e-9 && root.angular_velocity.norm() < 1e-8, "it moves");
        let force: Vector3<f64> = simulator.contacts().map(|contact| contact.force).sum();
        assert!((force - Vector3::z() * weight).norm() < 1e-5, "{force}");
        let greatest = simulator.contacts().map(|contact| contact.force.norm()).fold(0.0, f64::max);
        assert!(greatest < weight, "{greatest} N");
        assert_eq!(
            simulator.record().unsolved_steps,
            (2.0 / step).round() as u64,
            "{:?}",
            simulator.record()
        );
    }
}

#[test]
fn a_cube_rests_on_a_gentle_slope() {
    let (angle, friction): (f64, f64) = (0.3, 0.4);
    assert!(angle.tan() < friction);
    for scene in slopes(angle, friction) {
        let mut simulator = on_slope(&scene, angle, 0.002);
        let start = simulator.state().root.position;
        run(&mut simulator, 5.0);
        let root = simulator.state().root;
        assert!((root.position - start).norm() < 1e-6, "{} m", (root.position - start).norm());
        assert!(root.linear_velocity.norm() < 1e-9, "{} m/s", root.linear_velocity.norm());
        let force: Vector3<f64> = simulator.contacts().map(|contact| contact.force).sum();
        // The solver may leave 1e-9 m/s in each of 12 rows, which is that times m / h in force.
        assert!((force - Vector3::z() * 2.0 * GRAVITY).norm() < 1e-5, "{force}");
    }
}

/// The cube's middle is 2 cm this side of the table's edge, or 2 cm beyond it.
#[test]
fn a_cube_dropped_on_an_edge_stays_or_tips_with_its_centre_of_mass() {
    let table = obstacle(r#"{"kind": "box", "size": [1, 1, 0.4], "pose": {"position": [-0.5, 0, 0.2]}}"#);
    let scene = Scene { ground: None, obstacles: vec![table], ..Scene::default() };
    for (x, stays) in [(-0.02, true), (0.02, false)] {
        let model = body(CUBE);
        let mut state = State::new(&model);
        state.root.position = Point3::new(x, 0.0, 0.55);
        let mut simulator = simulator(&model, &scene, 0.002, state);
        run(&mut simulator, 1.0);
        let root = simulator.state().root;
        if stays {
            assert!((root.position - Point3::new(x, 0.0, 0.5)).norm() < 1e-6, "{}", root.position);
            assert!(root.orientation.angle() < 1e-6);
            assert!(simulator.contacts().all(|contact| contact.against == Against::Obstacle(0)));
        } else {
            assert!(root.position.z < 0.0, "it hangs at {}", root.position);
        }
    }
}

/// Two slopes of 45 degrees meet in a valley: each carries m g / √2 along its normal, without friction.
#[test]
fn a_ball_in_a_valley_rests_on_both_sides() {
    let model = body(r#"<sphere radius="0.1"/>"#);
    let valley =
        Ground::HeightField { heights: vec![vec![1.0, 0.0, 1.0]; 2], size: [2.0, 2.0], center: [0.0, 0.0] };
    let scene = Scene { ground: Some(valley), friction: 0.0, ..Scene::default() };
    let mut state = State::new(&model);
    let bottom = 0.1 * 2.0_f64.sqrt();
    state.root.position.z = bottom + 0.02;
    let mut simulator = simulator(&model, &scene, 0.002, state);
    run(&mut simulator, 1.0);
    assert!((simulator.state().root.position - Point3::new(0.0, 0.0, bottom)).norm() < 1e-6);
    let forces: Vec<f64> = simulator.contacts().map(|contact| contact.force.norm()).collect();
    let each = 2.0 * GRAVITY / 2.0_f64.sqrt();
    assert_eq!(forces.len(), 2);
    assert!(forces.iter().all(|force| (force - each).abs() < 1e-6), "{forces:?}");
}

/// A ball flies along one side of a steep valley into the other, which sends it back into the first within the same step.
#[test]
fn a_ball_that_is_thrown_into_a_valley_goes_into_neither_side() {
    let model = body(r#"<sphere radius="0.1"/>"#);
    let height = 3.0_f64.sqrt();
    let valley = Ground::HeightField {
        heights: vec![vec![height, 0.0, height]; 2],
        size: [2.0, 2.0],
        center: [0.0, 0.0],
    };
    let scene = Scene { ground: Some(valley), friction: 0.0, ..Scene::default() };
    let [left, right] = [1.0, -1.0].map(|side: f64| Vector3::new(side * height / 2.0, 0.0, 0.5));
    let gaps = |at: &Point3<f64>| [left, right].map(|normal| normal.dot(&at.coords) - 0.1);
    let mut state = State::new(&model);
    state.root.position = Point3::new(-0.0029 / (2.0 * left.x), 0.0, 0.2031);
    assert!((gaps(&state.root.position)[0] - 1e-4).abs() < 1e-9);
    assert!((gaps(&state.root.position)[1] - 3e-3).abs() < 1e-9);
    state.root.linear_velocity = Vector3::new(-0.5, 0.0, -height / 2.0) * 5.0;
    let mut simulator = simulator(&model, &scene, 0.002, state);
    for _ in 0..3 {
        simulator.step(Command::Passive).unwrap();
        let gaps = gaps(&simulator.state().root.position);
        assert!(gaps.iter().all(|gap| *gap > -1e-6), "{gaps:?}");
    }
}

/// A ball's centre keeps its radius from every point of a ridge that it rolls over, and rolls at all.
#[test]
fn a_ball_keeps_its_radius_from_a_ridge() {
    let model = body(r#"<sphere radius="0.1"/>"#);
    let ridge = Ground::HeightField {
        heights: vec![vec![0.0, 0.0, 0.2, 0.0, 0.0]; 3],
        size: [4.0, 2.0],
        center: [0.0, 0.0],
    };
    let scene = Scene { ground: Some(ridge), ..Scene::default() };
    let mut state = State::new(&model);
    state.root.position = Point3::new(-1.5, 0.03, 0.1);
    state.root.linear_velocity.x = 3.0;
    state.root.angular_velocity.y = 30.0;
    let mut simulator = simulator(&model, &scene, 0.001, state);
    for _ in 0..1500 {
        simulator.step(Command::Passive).unwrap();
        let center = simulator.state().root.position;
        let nearest = (-2000..=2000)
            .map(|index| {
                let x = f64::from(index) * 1e-3;
                (center.xz() - nalgebra::Point2::new(x, 0.2 * (1.0 - x.abs()).max(0.0))).norm()
            })
            .fold(f64::INFINITY, f64::min);
        // The row of a step knows the surface's curve only where the step begins: (v h)² / 2 r of it is missed.
        if center.x.abs() < 1.9 {
            assert!(nearest > 0.1 - 1e-4, "{nearest} m at {center}");
        }
    }
    assert!(simulator.state().root.position.x > 1.0, "{}", simulator.state().root.position);
}

#[test]
fn a_cylinder_rolls_on_an_obstacle_without_losing_height() {
    let model = body(r#"<cylinder radius="0.1" length="0.3"/>"#);
    let floor = obstacle(r#"{"kind": "box", "size": [10, 4, 1], "pose": {"position": [0, 0, -0.5]}}"#);
    let scene = Scene { ground: None, obstacles: vec![floor], ..Scene::default() };
    let mut state = State::new(&model);
    state.root.orientation = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 0.5 * std::f64::consts::PI);
    state.root.position.z = 0.1;
    state.root.linear_velocity.x = 1.0;
    state.root.angular_velocity.y = 10.0;
    let mut simulator = simulator(&model, &scene, 0.002, state);
    run(&mut simulator, 2.0);
    let root = simulator.state().root;
    assert!((root.position.x - 2.0).abs() < 1e-3, "{}", root.position);
    assert!((root.position.z - 0.1).abs() < 1e-5, "{}", root.position);
}

#[test]
fn obstacles_out_of_reach_change_no_bit() {
    let model = body(CUBE);
    let far = obstacle(r#"{"kind": "box", "size": [1, 1, 1], "pose": {"position": [5, 0, 0]}}"#);
    let end = |obstacles: Vec<_>, restitution: f64, switch: Switch| {
        let mut scene = Scene { obstacles, restitution, ..Scene::default() };
        scene.effects.insert(Effect::Obstacles, switch);
        let mut state = State::new(&model);
        state.root.position.z = 0.1;
        state.root.linear_velocity.x = 1.0;
        state.root.angular_velocity.z = 2.0;
        let mut simulator = simulator(&model, &scene, 0.002, state);
        run(&mut simulator, 0.5);
        simulator.state().clone()
    };
    let without = end(Vec::new(), 0.0, Switch::Auto);
    assert_eq!(end(vec![far.clone()], 0.0, Switch::On), without);
    assert_eq!(end(vec![far], 0.0, Switch::Off), without);
    // A cube that slides flat closes no contact.
    assert_eq!(end(Vec::new(), 0.7, Switch::Auto), without);
}

#[test]
fn effects_that_a_scene_does_not_call_for_say_so() {
    let model = body(CUBE);
    let plan = common::plan(&model, &Scene::default(), &Accuracy::default(), None);
    let because = |effect| plan.decisions[&effect].because.as_str();
    assert_eq!(because(Effect::Obstacles), "the scene has no obstacles");
    assert_eq!(because(Effect::SelfCollision), "no two bodies of the character have collision shapes");
    assert!(plan.obstacles.is_empty() && !plan.self_collision && plan.restitution.is_none());
}

/// A tumbling cube cannot tell a flat height field from a plane: the same points touch it, with the same normals.
#[test]
fn a_flat_height_field_is_a_plane() {
    let flat = Ground::HeightField { heights: vec![vec![0.25; 5]; 4], size: [8.0, 6.0], center: [0.1, -0.2] };
    let end = |ground: Ground| {
        let scene = Scene { ground: Some(ground), ..Scene::default() };
        let model = body(CUBE);
        let mut state = State::new(&model);
        state.root.position.z = 0.5;
        state.root.orientation = UnitQuaternion::from_euler_angles(0.4, 0.3, 0.2);
        state.root.linear_velocity = Vector3::new(1.0, 0.5, 0.0);
        let mut simulator = simulator(&model, &scene, 0.002, state);
        run(&mut simulator, 0.3);
        simulator.state().root
    };
    let (plane, field) = (end(Ground::Plane { height: 0.25 }), end(flat));
    assert!((plane.position - field.position).norm() < 1e-9);
    assert!((plane.linear_velocity - field.linear_velocity).norm() < 1e-7);
    assert!(plane.orientation.angle_to(&field.orientation) < 1e-7);
}

/// A quadruped stands on a field as it stands on a plane, only higher.
#[test]
fn a_character_starts_on_the_height_field() {
    let model = common::example("quadruped.urdf");
    let field = Ground::HeightField { heights: vec![vec![0.5; 2]; 2], size: [4.0, 4.0], center: [0.0, 0.0] };
    let stance = |ground: Ground| Stance::find(&model, &Scene { ground: Some(ground), ..Scene::default() });
    let (plane, raised) = (stance(Ground::default()), stance(field));
    assert!(plane.stable && raised.stable);
    assert!((raised.state.root.position.z - plane.state.root.position.z - 0.5).abs() < 1e-6);
    assert!((raised.root_height - plane.root_height).abs() < 1e-6);
    assert_eq!(raised.support, plane.support);
}
