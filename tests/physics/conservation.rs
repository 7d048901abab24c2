//! What physics keeps: momentum, energy, Coulomb's law, the balance of forces and of work.

use crate::bodies;
use crate::common;

use std::sync::Arc;

use bodies::Bar;
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{
    Accuracy, Feedforward, FrictionCone, Gains, Integrator, Scene, SolverChoice, SolverKind,
};
use gaitwright_physics::sim::bodies::Bodies;
use gaitwright_physics::sim::coordinates::reduced::kinematics::place;
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;
use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const GRAVITY: f64 = 9.81;

/// Both integrators with the slopes log₂(error(h) / error(h/2)) that their orders allow.
const ORDERS: [(Integrator, std::ops::Range<f64>); 2] =
    [(Integrator::SemiImplicitEuler, 0.8..1.3), (Integrator::MoreauJean, 1.8..2.3)];

fn exact(step: f64, integrator: Integrator) -> Accuracy {
    let solver = SolverChoice { iterations: 1000, tolerance: 1e-13, ..SolverChoice::default() };
    Accuracy { step, integrator, solver, ..Accuracy::default() }
}

fn advance(simulator: &mut Simulator, command: Command<'_>) {
    simulator.step(command).unwrap_or_else(|failure| panic!("{failure}"));
}

fn three(rng: &mut ChaCha8Rng, size: f64) -> Vector3<f64> {
    Vector3::from([0; 3].map(|_| rng.random_range(-size..size)))
}

fn tumbling(model: &Model, rng: &mut ChaCha8Rng) -> State {
    let mut state = State::new(model);
    state.root.orientation = UnitQuaternion::from_scaled_axis(three(rng, 2.0));
    state.root.angular_velocity = three(rng, 3.0);
    state.root.linear_velocity = three(rng, 1.0);
    for joint in 0..model.joint_count() {
        state.angles[joint] = rng.random_range(-1.0..1.0);
        state.velocities[joint] = rng.random_range(-3.0..3.0);
    }
    state
}

fn slopes_are(order: &std::ops::Range<f64>, errors: &[f64], what: &str) {
    for pair in errors.windows(2) {
        let slope = (pair[0] / pair[1]).log2();
        assert!(order.contains(&slope), "{what}: slope {slope} of {errors:?}");
    }
}

/// Greatest change in free flight, relative to what there was: of linear momentum less the impulse of gravity, of
/// angular momentum about the centre of mass, and of energy less the work of `torque`.
fn flight_drift(model: &Arc<Model>, start: &State, torque: Option<&[f64]>, accuracy: Accuracy) -> [f64; 3] {
    let scene = Scene { ground: None, ..Scene::default() };
    let plan = common::plan(model, &scene, &accuracy, None);
    let mut simulator = Simulator::new(plan, start.clone());
    let momentum = simulator.momentum();
    let energy = |simulator: &Simulator| simulator.energy().kinetic + simulator.energy().potential;
    let before = energy(&simulator);
    let kinetic = simulator.energy().kinetic;
    let (mut work, mut drift) = (0.0, [0.0_f64; 3]);
    for _ in 0..(0.24 / accuracy.step).round() as usize {
        let rates = simulator.state().velocities.clone();
        advance(&mut simulator, torque.map_or(Command::Passive, Command::Torque));
        let moved =
            rates.iter().zip(&simulator.state().velocities).map(|(a, b)| 0.5 * (a + b) * accuracy.step);
        work +=
            torque.map_or(0.0, |torque| torque.iter().zip(moved).map(|(torque, angle)| torque * angle).sum());
        let now = simulator.momentum();
        let gravity = Vector3::new(0.0, 0.0, -GRAVITY) * (model.mass * simulator.state().time);
        let lost = [
            (now.linear - momentum.linear - gravity).norm() / momentum.linear.norm(),
            (now.angular - momentum.angular).norm() / momentum.angular.norm(),
            (energy(&simulator) - before - work).abs() / kinetic,
        ];
        for (drift, lost) in drift.iter_mut().zip(lost) {
            *drift = drift.max(lost);
        }
    }
    drift
}

/// Random trees in flight, passive and with torques in their joints, which can change neither momentum.
#[test]
fn flight_keeps_momentum_to_rounding_and_energy_up_to_the_methods_order() {
    for (integrator, order) in ORDERS {
        for driven in [false, true] {
            let mut rng = ChaCha8Rng::seed_from_u64(11);
            let mut sums = [[0.0; 3]; 4];
            for links in [1, 2, 2, 3, 3, 4, 5, 6, 8, 12, 20, 30] {
                let model = bodies::tree(&mut rng, links, false);
                let start = tumbling(&model, &mut rng);
                let torque: Vec<f64> = start.angles.iter().map(|_| rng.random_range(-1.0..1.0)).collect();
                for (sum, step) in sums.iter_mut().zip([2e-3, 1e-3, 5e-4, 2.5e-4]) {
                    let drift =
                        flight_drift(&model, &start, driven.then_some(&torque), exact(step, integrator));
                    // Relative rates of change are at most some 20/s here: first order over a quarter of a second.
                    let most = if integrator == Integrator::MoreauJean { 0.05 } else { 0.5 };
                    assert!(
                        drift.iter().all(|drift| *drift < most),
                        "{links} links, {integrator:?}: {drift:?}"
                    );
                    for (sum, drift) in sum.iter_mut().zip(drift) {
                        *sum += drift;
                    }
                }
            }
            for [linear, angular, _] in sums {
                let name = format!("{integrator:?}, driven {driven}");
                assert!(linear < 1e-11 && angular < 1e-11, "{name}: {linear} and {angular} of the momentum");
            }
            let errors = sums.map(|[.., energy]| energy);
            // Of the longest step some are computed in parts, and err by less than their length would have it.
            slopes_are(&order, &errors[1..], &format!("energy, {integrator:?}, driven {driven}"));
        }
    }
}

/// A body that spins about its middle axis, tumbles over within the second and spins the other way. The energy lost on the way is of
/// the method's order, and and in each turn no more than the angle of a step as a share of what the middle axis has above the greatest.
#[test]
fn a_body_that_tumbles_over_loses_energy_by_the_methods_order() {
    let model = bodies::brick([0.1, 0.2, 0.3], [0.0; 3]);
    let (spin, seconds) = (15.8, 1.0);
    let scene = Scene { gravity: [0.0; 3], ground: None, ..Scene::default() };
    for (integrator, order) in ORDERS {
        let errors = [4e-3, 2e-3, 1e-3, 5e-4].map(|step| {
            let mut state = State::new(&model);
            state.root.angular_velocity = Vector3::new(0.01, spin, 0.01);
            let plan = common::plan(&model, &scene, &exact(step, integrator), None);
            let mut simulator = Simulator::new(plan, state);
            let (before, momentum) = (simulator.energy().kinetic, simulator.momentum().angular);
            let mut turned_over = false;
            for _ in 0..(seconds / step).round() as usize {
                advance(&mut simulator, Command::Passive);
                let root = simulator.state().root;
                turned_over |= (root.orientation.inverse() * root.angular_velocity).y < 0.0;
            }
            assert!(turned_over, "it spins on");
            let moved = (simulator.momentum().angular - momentum).norm() / momentum.norm();
            assert!(moved < 1e-10, "{moved} of the momentum");
            let lost = 1.0 - simulator.energy().kinetic / before;
            // 1 − I₂ / I₃ is what there is to lose; the tumbling takes a share of about ω h of it in each of ω t / 2π turns.
            let most = (1.0 - 0.2 / 0.3) * spin * step * (spin * seconds / std::f64::consts::TAU);
            assert!(lost.abs() < most, "{integrator:?} at {step} s: {lost} of the energy, {most} allowed");
            lost.abs()
        });
        slopes_are(&order, &errors, &format!("{integrator:?}"));
    }
}

/// A body without joints moves its centre of mass along a parabola: its linear momentum is exact.
#[test]
fn a_lone_symmetric_body_keeps_everything_exactly() {
    let model = bodies::brick([0.02; 3], [0.0; 3]);
    for (integrator, _) in ORDERS {
        let mut start = State::new(&model);
        start.root.linear_velocity = Vector3::new(1.0, 2.0, 3.0);
        start.root.angular_velocity = Vector3::new(5.0, -7.0, 2.0);
        let [linear, angular, _] = flight_drift(&model, &start, None, exact(2e-3, integrator));
        assert!(linear < 1e-12 && angular < 1e-12, "{integrator:?}: {linear} {angular}");
    }
}

#[test]
fn a_sliding_cube_stops_where_coulomb_says() {
    let model = bodies::cube();
    let mut rng = ChaCha8Rng::seed_from_u64(12);
    for case in 0..6 {
        let (speed, friction) = (rng.random_range(0.5..3.0), rng.random_range(0.2..1.0));
        let heading: f64 = rng.random_range(0.0..std::f64::consts::TAU);
        let along = Vector3::new(heading.cos(), heading.sin(), 0.0);
        let wanted = speed * speed / (2.0 * friction * GRAVITY);
        for step in [4e-3, 2e-3, 1e-3] {
            let mut start = State::new(&model);
            start.root.position.z = 0.1;
            start.root.linear_velocity = along * speed;
            let scene = Scene { friction, ..Scene::default() };
            let accuracy = exact(step, Integrator::SemiImplicitEuler);
            let plan = common::plan(&model, &scene, &accuracy, None);
            let mut simulator = Simulator::new(plan, start);
            for _ in 0..(2.0 / step) as usize {
                advance(&mut simulator, Command::Passive);
            }
            let way = simulator.state().root.position.coords - Vector3::z() * 0.1;
            // Each step moves by the velocity at its end: half a step's loss of speed less, v h / 2 in all, up to
            // the step within which it stops.
            let late = (way.dot(&along) - wanted + 0.5 * speed * step).abs();
            assert!(late < friction * GRAVITY * step * step, "case {case}: {late} m at {step} s");
            assert!(simulator.state().root.linear_velocity.norm() < 1e-9);
            // A circular cone brakes straight against the motion.
            assert!((way - along * way.dot(&along)).norm() < 1e-9, "case {case}: {way}");
        }
    }
}

/// A pyramid brakes each tangent by itself: the way along each axis is that of a slide along it alone.
#[test]
fn a_pyramid_turns_a_slide_towards_the_faster_axis() {
    let model = bodies::cube();
    let (friction, step) = (0.5, 5e-4);
    let speeds = [2.0, 1.0];
    let mut start = State::new(&model);
    start.root.position.z = 0.1;
    start.root.linear_velocity = Vector3::new(speeds[0], speeds[1], 0.0);
    let accuracy =
        Accuracy { friction_cone: FrictionCone::Pyramid, ..exact(step, Integrator::SemiImplicitEuler) };
    let plan = common::plan(&model, &Scene { friction, ..Scene::default() }, &accuracy, None);
    let mut simulator = Simulator::new(plan, start);
    for _ in 0..(1.0 / step) as usize {
        advance(&mut simulator, Command::Passive);
    }
    let way = simulator.state().root.position;
    for (found, speed) in [way.x, way.y].into_iter().zip(speeds) {
        let wanted = speed * speed / (2.0 * friction * GRAVITY);
        assert!((found - wanted).abs() < speed * step, "{found} m instead of {wanted} m");
    }
}

#[test]
fn a_slipping_ball_comes_to_roll_where_and_as_fast_as_it_should() {
    let model = bodies::ball();
    let (speed, friction) = (3.5, 0.4);
    // It rolls after 2 v / (7 μ g), having come 12 v² / (49 μ g), and goes on at 5 v / 7.
    let slipping = 2.0 * speed / (7.0 * friction * GRAVITY);
    let seconds = 1.0;
    let wanted =
        12.0 * speed * speed / (49.0 * friction * GRAVITY) + 5.0 / 7.0 * speed * (seconds - slipping);
    for (integrator, _) in ORDERS {
        for step in [4e-3, 2e-3, 1e-3] {
            let mut start = State::new(&model);
            start.root.position.z = 0.1;
            start.root.linear_velocity.x = speed;
            let scene = Scene { friction, ..Scene::default() };
            let plan = common::plan(&model, &scene, &exact(step, integrator), None);
            let mut simulator = Simulator::new(plan, start);
            for _ in 0..(seconds / step).round() as usize {
                advance(&mut simulator, Command::Passive);
            }
            let root = simulator.state().root;
            assert!((root.linear_velocity.x - 2.5).abs() < 1e-9, "{integrator:?}: {root:?}");
            assert!((root.angular_velocity.y - 25.0).abs() < 1e-8, "{integrator:?}: {root:?}");
            // The speed lost while slipping, once a step too early, and the step in which it starts to roll.
            let bound = 2.0 / 7.0 * speed * step;
            assert!((root.position.x - wanted).abs() < bound, "{integrator:?}: {} m", root.position.x);
        }
    }
}

/// Every example robot at rest: its contacts carry its weight and hold it against turning over.
#[test]
fn contact_forces_of_a_robot_at_rest_balance_its_weight() {
    for name in ["quadruped.urdf", "hexapod.json", "biped.urdf", "snake.json"] {
        let model = common::example(name);
        let stance = Stance::find(&model, &Scene::default());
        assert!(stance.stable, "{name} does not stand");
        let plan = common::plan(&model, &Scene::default(), &Accuracy::default(), Some(&stance.gains));
        let mut simulator = Simulator::new(plan, stance.state.clone());
        for _ in 0..5000 {
            advance(&mut simulator, Command::Track { now: &stance.angles, next: &stance.angles });
        }
        let weight = model.mass * GRAVITY;
        let center = simulator.center_of_mass();
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for contact in simulator.contacts() {
            force += contact.force;
            moment += (contact.position - center).cross(&contact.force);
        }
        let lacking = (force - Vector3::z() * weight).norm() / weight;
        assert!(lacking < 1e-6, "{name}: contacts carry {force} N of {weight} N");
        let turning = moment.norm() / (weight * stance.root_height);
        assert!(turning < 1e-6, "{name}: contacts turn it by {moment} N m");
    }
}

/// A box that tumbles, slowly and fast, and rebounds: whether a step is computed as a whole or in parts, the
/// contacts push over it by as much as momentum changes.
#[test]
fn contact_forces_over_a_step_in_parts_change_momentum_by_as_much() {
    let scene = Scene { restitution: 0.5, ..Scene::default() };
    let (mut whole, mut divided) = (0, 0);
    for (integrator, _) in ORDERS {
        for step_tolerance in [None, Some(1e-5)] {
            for (model, spin) in [(bodies::cube(), 5.0), (bodies::cube(), 500.0)] {
                let accuracy = Accuracy { step_tolerance, ..exact(0.002, integrator) };
                let plan = common::plan(&model, &scene, &accuracy, None);
                let mut start = State::new(&model);
                start.root.position.z = 0.4;
                start.root.angular_velocity = Vector3::new(1.0, spin, 2.0);
                let mut simulator = Simulator::new(plan.clone(), start);
                for index in 0..500 {
                    let (momentum, parts) = (simulator.momentum().linear, simulator.substeps());
                    advance(&mut simulator, Command::Passive);
                    let force: Vector3<f64> = simulator.contacts().map(|contact| contact.force).sum();
                    let impulse = (force + plan.gravity * model.mass) * 0.002;
                    let lacking = (simulator.momentum().linear - momentum - impulse).norm();
                    assert!(
                        lacking < 1e-10,
                        "{integrator:?}, {step_tolerance:?}, step {index}: {lacking} N s"
                    );
                    if force.z > 0.0 {
                        *if simulator.substeps() - parts > 1 { &mut divided } else { &mut whole } += 1;
                    }
                }
            }
        }
    }
    assert!(whole > 100 && divided > 100, "{whole} whole steps in contact, {divided} in parts");
}

/// A weight on a spring that is driven up and down: over a step in parts the motor pushes by as much as momentum changes.
#[test]
fn torques_over_a_step_in_parts_change_momentum_by_as_much() {
    let model = bodies::urdf(
        r#"<robot name="lift"><link name="base"/><link name="weight">
            <inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
            <joint name="lift" type="prismatic"><parent link="base"/><child link="weight"/><axis xyz="0 0 1"/>
            <limit lower="-10" upper="10" effort="1000" velocity="10"/></joint></robot>"#,
        true,
    );
    let gains = Gains {
        stiffness: vec![20000.0],
        damping: vec![5.0],
        max_torque: vec![Some(1000.0)],
        feedforward: Feedforward::None,
        ..Gains::default()
    };
    let accuracy = Accuracy { step_tolerance: Some(1e-6), ..exact(0.002, Integrator::SemiImplicitEuler) };
    let plan = common::plan(&model, &Scene { ground: None, ..Scene::default() }, &accuracy, Some(&gains));
    let mut simulator = Simulator::new(plan, State::new(&model));
    let target = |time: f64| [0.05 * (20.0 * time).sin()];
    for index in 0..500 {
        let (speed, parts) = (simulator.state().velocities[0], simulator.substeps());
        let [now, next] = [index, index + 1].map(|index| target(0.002 * f64::from(index)));
        advance(&mut simulator, Command::Track { now: &now, next: &next });
        let gained = 2.0 * (simulator.state().velocities[0] - speed);
        let lacking = gained - 0.002 * (simulator.torques()[0] - 2.0 * GRAVITY);
        assert!(lacking.abs() < 1e-10, "step {index}: {lacking} N s of {gained} N s");
        assert!(simulator.substeps() - parts > 1, "step {index} is whole");
    }
}

/// Where the energy of a driven character went over some seconds, J, and how far momentum is from its balance, N s.
struct Ledger {
    /// Change of energy less the work of torques, damping and contacts.
    energy: f64,
    /// Change of momentum less the impulses of gravity and of contacts.
    momentum: f64,
    /// Sum of the magnitudes of all work done, that of gravity included, J.
    turnover: f64,
    /// Steps in contact.
    touching: usize,
}

/// Over a step each force works along the mean of the velocities before and after it, in the configuration
/// at its beginning: for impacts this is exact.
fn balance(simulator: &mut Simulator, seconds: f64, target: impl Fn(f64) -> Vec<f64>) -> Ledger {
    let (model, plan) = (simulator.model().clone(), simulator.plan().clone());
    let step = plan.step();
    let total = |simulator: &Simulator| simulator.energy().kinetic + simulator.energy().potential;
    let (energy, momentum) = (total(simulator), simulator.momentum().linear);
    let mut bodies = Bodies::new(&model);
    let (mut work, mut turnover, mut touching) = (0.0, 0.0, 0);
    let mut impulse = Vector3::zeros();
    let steps = (seconds / step).round() as usize;
    for index in 0..steps {
        let before = simulator.state().clone();
        let center = simulator.center_of_mass();
        place(&model, &before, &mut bodies);
        let (now, next) = (target(index as f64 * step), target((index + 1) as f64 * step));
        advance(simulator, Command::Track { now: &now, next: &next });
        let moved = simulator.center_of_mass() - center;
        let after = simulator.state();
        let mut spend = |part: f64| {
            work += part;
            turnover += part.abs();
        };
        for (joint, torque) in simulator.torques().iter().enumerate() {
            let (old, new) = (before.velocities[joint], after.velocities[joint]);
            let damping = plan.damping.as_ref().map_or(0.0, |damping| damping[joint] * new);
            spend((torque - damping) * 0.5 * (old + new) * step);
        }
        for contact in simulator.contacts() {
            let at = contact.position - before.root.position;
            let old = bodies.at(model.links[contact.link].body).velocity.at(at);
            spend(contact.force.dot(&(old + contact.velocity)) * 0.5 * step);
            impulse += contact.force * step;
        }
        impulse += plan.gravity * (model.mass * step);
        turnover += (model.mass * plan.gravity).dot(&moved).abs();
        touching += usize::from(simulator.contacts().next().is_some());
    }
    Ledger {
        energy: total(simulator) - energy - work,
        momentum: (simulator.momentum().linear - momentum - impulse).norm(),
        turnover,
        touching: touching * 100 / steps,
    }
}

/// A quadruped that lifts and sets down its feet, and one that flies and thrashes.
#[test]
fn the_work_of_torques_damping_and_contacts_is_the_change_of_energy() {
    let model = common::example("quadruped.urdf");
    for grounded in [true, false] {
        let scene = if grounded { Scene::default() } else { Scene { ground: None, ..Scene::default() } };
        let stance = Stance::find(&model, &Scene::default());
        let target = |time: f64| -> Vec<f64> {
            let swing = |joint: usize| 0.3 * (12.0 * time + joint as f64).sin() * (joint % 3) as f64 / 2.0;
            stance.angles.iter().enumerate().map(|(joint, angle)| angle + swing(joint)).collect()
        };
        let ledgers = [2e-3, 1e-3, 5e-4, 2.5e-4].map(|step| {
            let accuracy = exact(step, Integrator::SemiImplicitEuler);
            let plan = common::plan(&model, &scene, &accuracy, Some(&stance.gains));
            let mut simulator = Simulator::new(plan, stance.state.clone());
            balance(&mut simulator, 0.5, target)
        });
        if grounded {
            assert!(ledgers.iter().all(|ledger| ledger.touching > 50), "the feet hardly touch the ground");
        }
        let errors = ledgers.each_ref().map(|ledger| ledger.energy.abs());
        for (ledger, step) in ledgers.iter().zip([2e-3, 1e-3, 5e-4, 2.5e-4]) {
            // First order: joints turn by some 20 rad/s here.
            let share = ledger.energy.abs() / ledger.turnover;
            assert!(share < 20.0 * step, "{share} of the work is missing at {step} s");
            let momentum = ledger.momentum / (model.mass * GRAVITY * 0.5);
            assert!(momentum < 20.0 * step, "{momentum} of the impulse is missing at {step} s");
        }
        // Steps to the next touch-down differ, so that single slopes scatter in contact; over an eighth they may not.
        let overall = (errors[0] / errors[3]).log2() / 3.0;
        assert!((0.8..1.3).contains(&overall), "grounded {grounded}: slope {overall} of {errors:?}");
    }
}

/// Joints with dry friction and damping lose exactly what these take.
#[test]
fn joint_friction_and_damping_take_what_is_lost() {
    let bars = [
        Bar { mass: 1.0, center: 0.25, length: 0.5, inertia: 0.02 },
        Bar { mass: 0.7, center: 0.15, length: 0.4, inertia: 0.01 },
    ];
    let (damping, friction) = (0.05, 0.1);
    let model = bodies::chain(bodies::Hanging::Bolted, &bars, r#"<dynamics damping="0.05" friction="0.1"/>"#);
    let lost = |step: f64| {
        let scene = Scene { ground: None, ..Scene::default() };
        let plan = common::plan(&model, &scene, &exact(step, Integrator::SemiImplicitEuler), None);
        let mut start = State::new(&model);
        start.angles.copy_from_slice(&[1.5, 0.5]);
        let mut simulator = Simulator::new(plan, start);
        let total = |simulator: &Simulator| simulator.energy().kinetic + simulator.energy().potential;
        let (energy, mut taken) = (total(&simulator), 0.0);
        for _ in 0..(1.0 / step).round() as usize {
            let old = simulator.state().velocities.clone();
            advance(&mut simulator, Command::Passive);
            for (old, new) in old.iter().zip(&simulator.state().velocities) {
                let mean = 0.5 * (old + new);
                taken += (damping * new * mean + friction * mean.abs()) * step;
            }
        }
        assert!(taken > 0.5, "hardly anything was lost: {taken} J");
        (energy - total(&simulator) - taken).abs()
    };
    slopes_are(&(0.8..1.3), &[4e-3, 2e-3, 1e-3, 5e-4].map(lost), "energy");
}

/// A torque limit, a stiff drive and a pivoting solver change nothing about the balance of a step.
#[test]
fn saturated_torques_work_like_all_others() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let gains = Gains {
        stiffness: vec![1e4; model.joint_count()],
        max_torque: vec![Some(4.0); model.joint_count()],
        feedforward: Feedforward::None,
        ..stance.gains.clone()
    };
    let target = |time: f64| -> Vec<f64> {
        stance.angles.iter().map(|angle| angle + 0.4 * (9.0 * time).sin()).collect()
    };
    let step = 2.5e-4;
    let solver = SolverChoice { kind: SolverKind::Lemke, iterations: 10_000, tolerance: 1e-12 };
    let accuracy = Accuracy { step, solver, friction_cone: FrictionCone::Pyramid, ..Accuracy::default() };
    let plan = common::plan(&model, &Scene::default(), &accuracy, Some(&gains));
    let mut simulator = Simulator::new(plan, stance.state.clone());
    let ledger = balance(&mut simulator, 0.3, target);
    assert!(simulator.torques().iter().any(|torque| torque.abs() == 4.0), "nothing is saturated");
    let share = ledger.energy.abs() / ledger.turnover;
    assert!(share < 20.0 * step, "{share} of the work is missing");
}
