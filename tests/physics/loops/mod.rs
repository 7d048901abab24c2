//! Characters with closed loops, in both coordinates.

use crate::common;
mod control;
mod documents;

use std::sync::Arc;

use gaitwright_physics::character::{Character, LoopKind};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{
    Accuracy, Coordinates, Feedforward, Gains, JointBias, Scene, SolverChoice, SolverKind,
};
use gaitwright_physics::sim::{Command, Simulator, State};
use nalgebra::{Isometry3, Unit, Vector3};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const BOTH: [Coordinates; 2] = [Coordinates::Reduced, Coordinates::Maximal];

fn accuracy(coordinates: Coordinates) -> Accuracy {
    let solver = SolverChoice { kind: SolverKind::Newton, iterations: 1_000, tolerance: 1e-13 };
    Accuracy { coordinates, solver, ..Accuracy::default() }
}

/// Gravity and nothing else.
fn in_the_air() -> Scene {
    Scene { ground: None, ..Scene::default() }
}

/// The example: two cranks of 0.3 m, 0.4 m apart, and a coupler between their ends; its frame bolted.
fn fourbar() -> Arc<Model> {
    let free = common::example("fourbar.json");
    Arc::new(Model::new(free.character.clone(), Base::Fixed))
}

/// The cranks at `angle`, turning at `rate`; the coupler stays level.
fn swung(model: &Model, angle: f64, rate: f64) -> State {
    let mut state = State::new(model);
    for (name, share) in [("left_shoulder", 1.0), ("left_elbow", -1.0), ("right_shoulder", 1.0)] {
        let joint = model.joint(name).unwrap();
        (state.angles[joint], state.velocities[joint]) = (share * angle, share * rate);
    }
    state
}

fn total_energy(simulator: &Simulator) -> f64 {
    let energy = simulator.energy();
    energy.kinetic + energy.potential
}

/// What the four-bar's swing amounts to: inertia about its angle (kg m²) and first moment (kg m). The coupler does
/// not turn, so that it counts as a point at the end of the cranks.
fn pendulum(model: &Model) -> (f64, f64) {
    let (mut inertia, mut moment) = (0.0, 0.0);
    for (name, turns) in [("left_shoulder", true), ("left_elbow", false), ("right_shoulder", true)] {
        let body = &model.bodies[model.joint(name).unwrap() + 1];
        let arm = if turns { -body.center.z } else { 0.3 };
        inertia += body.mass * arm * arm + if turns { body.inertia[(1, 1)] } else { 0.0 };
        moment += body.mass * arm;
    }
    (inertia, moment)
}

/// The period of a pendulum of any amplitude: 2π √(I / g S) / agm(1, cos(θ/2)).
fn period(inertia: f64, moment: f64, amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
    for _ in 0..20 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    std::f64::consts::TAU * (inertia / (9.81 * moment)).sqrt() / a
}

#[test]
fn a_parallelogram_swings_like_the_pendulum_that_it_is() {
    let model = fourbar();
    let (inertia, moment) = pendulum(&model);
    for coordinates in BOTH {
        for amplitude in [0.1, 1.0] {
            let settings = Accuracy { step: 1e-3, ..accuracy(coordinates) };
            let plan = common::plan(&model, &in_the_air(), &settings, None);
            let mut simulator = Simulator::new(plan, swung(&model, amplitude, 0.0));
            let joint = model.joint("right_shoulder").unwrap();
            // Times at which it swings through the lowest point forward, between steps by interpolation.
            let mut passed = Vec::new();
            let mut before = amplitude;
            for _ in 0..10_000 {
                simulator.step(Command::Passive).unwrap();
                let angle = simulator.state().angles[joint];
                if before < 0.0 && angle >= 0.0 {
                    passed.push(simulator.state().time - 1e-3 * angle / (angle - before));
                }
                before = angle;
            }
            let swings = passed.len() - 1;
            let measured = (passed[swings] - passed[0]) / swings as f64;
            let expected = period(inertia, moment, amplitude);
            // (ω h)² of a method of first order whose error in the period is of second order, and the energy
            // that its loop gains or loses in a few swings.
            assert!(
                (measured / expected - 1.0).abs() <= 2e-3,
                "{coordinates:?}, {amplitude} rad: {measured} s for {expected} s"
            );
        }
    }
}

#[test]
fn a_loop_stays_closed_for_ten_seconds() {
    let model = fourbar();
    let (inertia, moment) = pendulum(&model);
    for coordinates in BOTH {
        let settings = accuracy(coordinates);
        let plan = common::plan(&model, &in_the_air(), &settings, None);
        let mut simulator = Simulator::new(plan, swung(&model, 1.5, 0.0));
        let start = total_energy(&simulator);
        let fastest = (2.0 * 9.81 * moment * (1.0 - 1.5_f64.cos()) / inertia).sqrt();
        // A step leaves the circle by (ω h)² / 2 of the crank, and a fifth of what has gathered is taken back; the
        // coupler's ends each do.
        let apart = 2.0 * 5.0 * 0.5 * (1.2 * fastest * settings.step).powi(2) * 0.3;
        let swing = 9.81 * moment * (1.0 - 1.5_f64.cos());
        for _ in 0..5000 {
            simulator.step(Command::Passive).unwrap();
            let separation = simulator.joint_separation();
            assert!(separation <= apart, "{coordinates:?}: apart by {separation:e}, bound {apart:e}");
            let gained = total_energy(&simulator) - start;
            assert!(gained.abs() <= 0.15 * swing, "{coordinates:?}: energy off by {gained} of {swing}");
        }
    }
}

/// The state after one step in either coordinates, and in how many substeps.
fn one_step(
    model: &Arc<Model>,
    scene: &Scene,
    gains: &Gains,
    state: &State,
    targets: &[f64],
) -> [(State, u64); 2] {
    BOTH.map(|coordinates| {
        let plan = common::plan(model, scene, &accuracy(coordinates), Some(gains));
        let mut simulator = Simulator::new(plan, state.clone());
        simulator.step(Command::Track { now: targets, next: targets }).unwrap();
        (simulator.state().clone(), simulator.record().greatest_substeps)
    })
}

/// A step that is divided in one of them is divided in both. Then only the first substep is of the same state, for bodies by
/// themselves have left their circles after it.
fn assert_same(steps: &[(State, u64); 2], name: &str) {
    let [(ours, ours_in), (theirs, theirs_in)] = steps;
    assert_eq!(*ours_in > 1, *theirs_in > 1, "{name}");
    if *ours_in > 1 {
        return;
    }
    let scale = theirs.velocities.iter().fold(1.0_f64, |greatest, it| greatest.max(it.abs()));
    let root = (ours.root.linear_velocity - theirs.root.linear_velocity)
        .amax()
        .max((ours.root.angular_velocity - theirs.root.angular_velocity).amax());
    let joints =
        ours.velocities.iter().zip(&theirs.velocities).map(|(a, b)| (a - b).abs()).fold(root, f64::max);
    assert!(joints <= 1e-9 * scale, "{name}: {joints:e} of {scale}");
}

/// The four-bar with a right crank of 0.25 m, so that its two elbows turn differently.
fn uneven(kind: LoopKind, bolted: bool) -> Arc<Model> {
    let mut character = Character::clone(&common::example("fourbar.json").character);
    character.loops[0].kind = kind;
    character.loops[0].frames =
        [Isometry3::translation(0.0, 0.0, -0.25), Isometry3::translation(0.4, 0.0, 0.05)];
    Arc::new(Model::new(Arc::new(character), Base::fixed_if(bolted)))
}

/// The example with another kind of joint at its right elbow, and its frame bolted or not.
fn with_loop(kind: LoopKind, bolted: bool) -> Arc<Model> {
    let mut character = Character::clone(&common::example("fourbar.json").character);
    character.loops[0].kind = kind;
    Arc::new(Model::new(Arc::new(character), Base::fixed_if(bolted)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn one_step_with_a_loop_is_the_same_in_both_coordinates(
        angle in -0.2_f64..0.2,
        rate in -5.0_f64..5.0,
        targets in proptest::array::uniform3(-1.0_f64..1.0),
        feedforward in 0_usize..3,
        driven in proptest::array::uniform3(any::<bool>()),
        bolted: bool,
    ) {
        // Most of the rows repeat each other, for the loop is planar; and the loop is a little open.
        for kind in [LoopKind::Ball, LoopKind::Revolute, LoopKind::Prismatic, LoopKind::Fixed] {
            let names = ["left_shoulder", "left_elbow", "right_shoulder"];
            let chosen: Vec<&str> =
                names.iter().zip(driven).filter_map(|(name, driven)| driven.then_some(*name)).collect();
            let model = control::driven_at(&uneven(kind, bolted), &chosen);
            let feedforward =
                [Feedforward::None, Feedforward::ContactFree, Feedforward::ContactAware][feedforward];
            let gains = Gains {
                stiffness: vec![20.0; 3],
                damping: vec![0.5; 3],
                max_torque: vec![Some(3.0), None, Some(1.0)],
                feedforward,
                ..Gains::default()
            };
            let mut state = swung(&model, angle, rate);
            if !bolted {
                state.root.position.z = 1.0;
                state.root.angular_velocity = Vector3::new(0.3, -0.4, 1.0);
            }
            let steps = one_step(&model, &in_the_air(), &gains, &state, &targets);
            assert_same(&steps, &format!("{kind:?}, bolted {bolted}, driven {driven:?}, {feedforward:?}"));
        }
    }
}

#[test]
fn a_loop_of_every_kind_holds_what_it_says() {
    for coordinates in BOTH {
        for kind in [LoopKind::Ball, LoopKind::Revolute, LoopKind::Prismatic, LoopKind::Fixed] {
            let model = with_loop(kind, true);
            let plan = common::plan(&model, &in_the_air(), &accuracy(coordinates), None);
            let mut simulator = Simulator::new(plan, swung(&model, 0.0, 0.0));
            let push = [0.2, 0.0, 0.0];
            for _ in 0..200 {
                simulator.step(Command::Torque(&push)).unwrap();
                assert!(simulator.joint_separation() <= 1e-3, "{coordinates:?}, {kind:?}");
            }
            // A welded four-bar is a frame, and so is one whose elbow slides along the cranks' common axis; the
            // others give way.
            let moved = simulator.state().angles[0].abs();
            let rigid = matches!(kind, LoopKind::Prismatic | LoopKind::Fixed);
            assert!(if rigid { moved < 1e-6 } else { moved > 0.05 }, "{coordinates:?}, {kind:?}: {moved}");
        }
    }
}

/// The cranks of 0.3 m and 0.25 m at the same angle leave the loop open by 7 mm. Closed by a fifth in every substep of this step,
/// which is divided, it would be closed with its end, and the cranks one or two rad/s faster.
#[test]
fn an_open_loop_closes_no_faster_in_a_divided_step() {
    let model = control::driven_at(&uneven(LoopKind::Ball, false), &["left_shoulder", "left_elbow"]);
    let gains = Gains {
        stiffness: vec![20.0; 3],
        damping: vec![0.5; 3],
        max_torque: vec![Some(3.0), None, Some(1.0)],
        ..Gains::default()
    };
    let mut state = swung(&model, -0.1448, -4.758);
    state.root.position.z = 1.0;
    state.root.angular_velocity = Vector3::new(0.3, -0.4, 1.0);
    for coordinates in BOTH {
        let plan = common::plan(&model, &in_the_air(), &accuracy(coordinates), Some(&gains));
        let mut simulator = Simulator::new(plan, state.clone());
        let open = simulator.joint_separation();
        simulator.step(Command::Track { now: &[-0.8, 0.95, 0.0], next: &[-0.8, 0.95, 0.0] }).unwrap();
        assert!(simulator.record().greatest_substeps > 1, "{coordinates:?}");
        // A fifth of it in the step, by a little more or less for the way that is not straight.
        let closed = 1.0 - simulator.joint_separation() / open;
        assert!((closed - 0.2).abs() < 0.05, "{coordinates:?}: {closed} of {open}");
    }
}

/// Taken exactly, a loop whose axes are not quite parallel is a rigid frame; in documents π/2 is 1.5708.
#[test]
fn a_loop_moves_although_its_axes_are_a_little_askew() {
    let swing = |askew: f64, size: f64, coordinates: Coordinates| {
        let mut character = common::scaled(&common::example("fourbar.json").character, size);
        let joints = character.links.iter_mut().filter_map(|link| link.joint.as_mut());
        for joint in joints.filter(|joint| joint.name == "right_shoulder") {
            joint.axis = Unit::new_normalize(Vector3::new(askew, 1.0, 0.0));
        }
        let model = Arc::new(Model::new(Arc::new(character), Base::Fixed));
        // Alike in size, speeds and times are as the roots of lengths.
        let mut accuracy = accuracy(coordinates);
        accuracy.step *= size.sqrt();
        accuracy.solver.tolerance *= size.sqrt().max(1.0);
        let plan = common::plan(&model, &in_the_air(), &accuracy, None);
        let mut simulator = Simulator::new(plan, swung(&model, 0.5, 0.0));
        let mut apart = 0.0_f64;
        for _ in 0..1000 {
            simulator.step(Command::Passive).unwrap();
            apart = apart.max(simulator.joint_separation());
        }
        (simulator.state().angles[0], apart)
    };
    for coordinates in BOTH {
        let (straight, closed) = swing(0.0, 1.0, coordinates);
        for askew in [1e-12, 1e-8, 3.7e-6, 1e-4] {
            let (angle, apart) = swing(askew, 1.0, coordinates);
            // It gives way by the angle between its axes, and by what that makes of its links of 0.3 m.
            assert!(apart <= closed + 2.0 * askew, "{coordinates:?}, {askew}: apart by {apart:e}");
            assert!(
                (angle - straight).abs() <= 1e-9 + askew,
                "{coordinates:?}, {askew}: {angle}, {straight}"
            );
        }
        // Not by how large it is either.
        for size in [0.001, 0.01, 100.0, 1000.0] {
            let (angle, _) = swing(1e-4, size, coordinates);
            assert!((angle - straight).abs() <= 1e-9 + 1e-4, "{coordinates:?}, {size}: {angle}, {straight}");
        }
    }
}

#[test]
fn loops_that_contradict_each_other_are_told_and_stay_finite() {
    let mut character = Character::clone(&common::example("fourbar.json").character);
    // A second tie, from the frame to the coupler, leaves the four-bar no motion at all; it begins far from
    // where both could be closed.
    let mut tie = character.loops[0].clone();
    let place = |name: &str| character.links.iter().position(|link| link.name == name).unwrap();
    tie.name = "tie".into();
    tie.kind = LoopKind::Ball;
    tie.links = [place("frame"), place("coupler")];
    tie.frames = [Isometry3::translation(-0.1, 0.0, -0.3), Isometry3::translation(0.1, 0.0, 0.0)];
    character.loops.push(tie);
    let model = Arc::new(Model::new(Arc::new(character), Base::Fixed));
    for coordinates in BOTH {
        let plan = common::plan(&model, &in_the_air(), &accuracy(coordinates), None);
        // Closed, it is a rigid frame.
        let mut simulator = Simulator::new(plan.clone(), swung(&model, 0.0, 0.0));
        for _ in 0..200 {
            simulator.step(Command::Passive).unwrap();
        }
        assert!(simulator.state().angles[0].abs() < 1e-6 && simulator.residual() < 1e-9);
        // Swung out, what one tie asks for the other forbids.
        let mut simulator = Simulator::new(plan, swung(&model, 0.6, 0.0));
        simulator.step(Command::Passive).unwrap();
        assert!(simulator.residual() > 1e-3, "{coordinates:?}: {:e}", simulator.residual());
        for _ in 0..500 {
            simulator.step(Command::Passive).unwrap();
            assert!(simulator.state().velocities.iter().all(|rate| rate.abs() < 1e3), "{coordinates:?}");
        }
    }
}

#[test]
fn the_paper_s_own_rows_converge_with_loops_too() {
    let model = uneven(LoopKind::Revolute, true);
    // Both elbows move level: 0.3 m and 0.25 m of crank at the same speed.
    let mut moving = swung(&model, 0.0, 2.0);
    moving.velocities[model.joint("right_shoulder").unwrap()] = 2.4;
    let end = |joint_bias: JointBias, coordinates: Coordinates, step: f64| {
        let settings = Accuracy { step, joint_bias, ..accuracy(coordinates) };
        let plan = common::plan(&model, &in_the_air(), &settings, None);
        let mut simulator = Simulator::new(plan, moving.clone());
        for _ in 0..(0.1 / step).round() as usize {
            simulator.step(Command::Passive).unwrap();
        }
        simulator.state().angles[0]
    };
    for coordinates in BOTH {
        let errors = [4e-4, 2e-4, 1e-4].map(|step| {
            (end(JointBias::Paper, coordinates, step)
                - end(JointBias::Consistent, Coordinates::Reduced, step))
            .abs()
        });
        for pair in errors.windows(2) {
            assert!(pair[0] <= 1e-4 && pair[0] / pair[1] >= 1.8, "{coordinates:?}: {errors:?}");
        }
    }
}

#[test]
fn a_loop_costs_rows_only_where_there_is_one() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let model = fourbar();
    let mut open = Character::clone(&model.character);
    open.loops.clear();
    let open = Arc::new(Model::new(Arc::new(open), Base::Fixed));
    for _ in 0..10 {
        let state = swung(&open, rng.random_range(-1.0..1.0), rng.random_range(-2.0..2.0));
        let plan = common::plan(&open, &in_the_air(), &accuracy(Coordinates::Reduced), None);
        let mut simulator = Simulator::new(plan, state);
        simulator.step(Command::Passive).unwrap();
        // Without a row there is no problem to solve, and nothing that could be apart.
        assert_eq!((simulator.residual(), simulator.joint_separation()), (0.0, 0.0));
    }
}
