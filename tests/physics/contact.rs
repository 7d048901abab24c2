//! Contact, friction, limits and torque limits in whole steps, against closed forms and exact solvers.

use crate::bodies;
use crate::common;

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{
    Accuracy, Effect, Feedforward, FrictionCone, Gains, Scene, SolverChoice, SolverKind, Switch,
};
use gaitwright_physics::sim::{Command, FailureCause, Simulator, State};
use gaitwright_physics::stance::Stance;

use bodies::{ball, cube, urdf};

const GRAVITY: f64 = 9.81;

/// A bar of 1 kg m² about a hinge at one end (with its own weight's moment m g l), horizontal axis.
fn bar(limits: &str) -> Arc<Model> {
    urdf(
        &format!(
            r#"<robot name="bar"><link name="base"><inertial><mass value="1"/>
              <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
            <link name="bar"><inertial><origin xyz="0.5 0 0"/><mass value="1"/>
              <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.75" iyz="0" izz="0.75"/></inertial></link>
            <joint name="hinge" type="revolute"><parent link="base"/><child link="bar"/><axis xyz="0 -1 0"/>
              <limit {limits} effort="20" velocity="10"/></joint></robot>"#
        ),
        true,
    )
}

fn simulator(model: &Arc<Model>, accuracy: &Accuracy, gains: Option<&Gains>, state: State) -> Simulator {
    Simulator::new(common::plan(model, &Scene::default(), accuracy, gains), state)
}

fn run(simulator: &mut Simulator, seconds: f64, command: Command<'_>) {
    for _ in 0..(seconds / simulator.plan().step()).round() as usize {
        simulator.step(command).unwrap_or_else(|failure| panic!("{failure}"));
    }
}

#[test]
fn a_sliding_cube_stops_where_coulomb_says() {
    let model = cube();
    let (speed, friction) = (2.0, 0.8);
    let wanted = speed * speed / (2.0 * friction * GRAVITY);
    let distance = |step: f64| {
        let mut state = State::new(&model);
        state.root.position.z = 0.1;
        state.root.linear_velocity.x = speed;
        let mut simulator = simulator(&model, &Accuracy { step, ..Accuracy::default() }, None, state);
        run(&mut simulator, 1.0, Command::Passive);
        let root = simulator.state().root;
        assert!(root.linear_velocity.norm() < 1e-9, "it still moves at {} m/s", root.linear_velocity.norm());
        root.position.x
    };
    // The new velocity moves the cube, so that each step loses half of μ g h² against the closed form:
    // v h / 2 over the whole way.
    for step in [0.004, 0.002, 0.001] {
        let error = wanted - distance(step);
        let discrete = speed * step / 2.0;
        assert!((error - discrete).abs() < friction * GRAVITY * step * step, "{error} m at {step} s");
    }
}

#[test]
fn a_slipping_ball_ends_up_rolling_at_five_sevenths_of_its_speed() {
    let model = ball();
    let mut state = State::new(&model);
    state.root.position.z = 0.1;
    state.root.linear_velocity.x = 3.5;
    let mut simulator = simulator(&model, &Accuracy::default(), None, state);
    run(&mut simulator, 1.0, Command::Passive);
    let root = simulator.state().root;
    // Independent of the coefficient: the angular momentum about the contact is conserved.
    assert!((root.linear_velocity.x - 2.5).abs() < 1e-9, "{}", root.linear_velocity.x);
    assert!((root.angular_velocity.y - 25.0).abs() < 1e-8, "{}", root.angular_velocity.y);
}

#[test]
fn a_resting_cube_stays_where_it_is_and_its_contacts_carry_its_weight() {
    let model = cube();
    let mut state = State::new(&model);
    state.root.position.z = 0.1;
    let mut simulator = simulator(&model, &Accuracy::default(), None, state);
    run(&mut simulator, 10.0, Command::Passive);
    let carried: f64 = simulator.contacts().map(|contact| contact.force.z).sum();
    // The solver may leave 1e-9 m/s in each of four normal rows, whose diagonal is at least h/m.
    assert!((carried - 2.0 * GRAVITY).abs() < 4.0 * 1e-9 * 2.0 / 0.002, "{carried} N");
    let root = simulator.state().root;
    assert!(
        root.position.xy().coords.norm() < 1e-9 && (root.position.z - 0.1).abs() < 1e-9,
        "{}",
        root.position
    );
}

#[test]
fn a_cube_deep_in_the_ground_rises_without_a_launch() {
    let model = cube();
    let mut state = State::new(&model);
    state.root.position.z = 0.02;
    let mut simulator = simulator(&model, &Accuracy::default(), None, state);
    let mut highest: f64 = 0.0;
    for _ in 0..1000 {
        simulator.step(Command::Passive).unwrap();
        highest = highest.max(simulator.state().root.position.z);
    }
    // It may leave the ground with the speed at which it is pushed apart, 0.2 m/s: 2 mm.
    assert!(highest < 0.1 + 0.2 * 0.2 / (2.0 * GRAVITY) + 1e-4, "{highest} m");
    assert!((simulator.state().root.position.z - 0.1).abs() < 1e-6);
}

/// All solvers on a robot that stands and moves its targets, from the same states. Gauss-Seidel
/// can go round in circles under friction and then says so in its residual; where it has converged, it has to
/// have found what pivoting finds.
#[test]
fn the_exact_and_the_iterative_solvers_agree_in_contact() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let tolerance = 1e-10;
    let new = |kind, iterations| {
        let solver = SolverChoice { kind, iterations, tolerance };
        let accuracy = Accuracy { solver, friction_cone: FrictionCone::Pyramid, ..Accuracy::default() };
        let scene = Scene { friction: 0.2, ..Scene::default() };
        let plan = common::plan(&model, &scene, &accuracy, Some(&stance.gains));
        Simulator::new(plan, stance.state.clone())
    };
    let mut exact = new(SolverKind::Lemke, 10_000);
    let mut iterative = [new(SolverKind::Newton, 1000), new(SolverKind::Pgs, 20_000)];
    let mut agreed = [0, 0];
    let step = exact.plan().step();
    let target = |index: usize| -> Vec<f64> {
        let swing = 0.2 * (2.0 * std::f64::consts::TAU * index as f64 * step).sin();
        stance.angles.iter().enumerate().map(|(joint, angle)| angle + swing * (joint % 3) as f64).collect()
    };
    let (steps, mut in_contact) = (200, 0);
    for index in 0..steps {
        let (now, next) = (target(index), target(index + 1));
        let command = Command::Track { now: &now, next: &next };
        let before = exact.state().clone();
        exact.step(command).unwrap();
        assert!(exact.residual() < tolerance, "the exact solver left {} at step {index}", exact.residual());
        in_contact += usize::from(exact.contacts().count() > 0);
        for (other, agreed) in iterative.iter_mut().zip(&mut agreed) {
            other.set_state(&before);
            other.step(command).unwrap();
            if other.residual() > tolerance {
                continue;
            }
            *agreed += 1;
            let pairs = exact.state().velocities.iter().zip(&other.state().velocities);
            let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let kind = other.plan().accuracy.solver.kind;
            assert!(apart < 1e-6, "{kind:?} is {apart} rad/s away at step {index}");
        }
    }
    assert!(in_contact > steps / 2, "only {in_contact} steps in contact");
    assert!(agreed.iter().all(|count| *count > steps * 8 / 10), "converged in {agreed:?} of {steps} steps");
}

#[test]
fn contact_forces_of_a_standing_robot_sum_to_its_weight() {
    for name in ["quadruped.urdf", "hexapod.json"] {
        let model = common::example(name);
        let stance = Stance::find(&model, &Scene::default());
        assert!(stance.stable, "{name} does not stand");
        let mut simulator =
            simulator(&model, &Accuracy::default(), Some(&stance.gains), stance.state.clone());
        run(&mut simulator, 2.0, Command::Track { now: &stance.angles, next: &stance.angles });
        let carried: f64 = simulator.contacts().map(|contact| contact.force.z).sum();
        let weight = model.mass * GRAVITY;
        assert!((carried - weight).abs() < 1e-3 * weight, "{name}: {carried} N of {weight} N");
    }
}

fn gains(stiffness: f64, damping: f64, max_torque: Option<f64>, feedforward: Feedforward) -> Gains {
    Gains {
        stiffness: vec![stiffness],
        damping: vec![damping],
        max_torque: vec![max_torque],
        feedforward,
        ..Gains::default()
    }
}

/// One step of the bar against the closed form of its implicit spring (eqs. 19-20 for one joint).
#[test]
fn a_spring_step_has_its_closed_form_and_stays_within_the_torque_limit() {
    let model = bar(r#"lower="-3" upper="3""#);
    let (inertia, moment) = (1.0, GRAVITY * 0.5);
    let step = 0.002;
    for (stiffness, damping) in [(1e2, 0.0), (1e5, 10.0), (1e9, 0.0), (0.0, 1e9)] {
        for (limit, now, next) in [(None, 0.2, 0.21), (Some(20.0), 0.2, 0.21), (Some(20.0), -0.2, -0.2)] {
            let gains = gains(stiffness, damping, limit, Feedforward::None);
            let mut state = State::new(&model);
            state.velocities[0] = 0.5;
            // A torque that falls with the speed has its closed form elsewhere.
            let scene = Scene { effects: [(Effect::SpeedLimits, Switch::Off)].into(), ..Scene::default() };
            let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&gains));
            let mut simulator = Simulator::new(plan, state);
            simulator.step(Command::Track { now: &[now], next: &[next] }).unwrap();

            let target_rate = (next - now) / step;
            let resistance = damping + stiffness * step;
            let rest = stiffness * now + resistance * target_rate;
            let free = 0.5 + step * (-moment) / inertia;
            let rate = (free + step * rest / inertia) / (1.0 + step * resistance / inertia);
            let torque = rest - resistance * rate;
            let (rate, torque) = match limit {
                Some(limit) if torque.abs() > limit => {
                    let torque = torque.clamp(-limit, limit);
                    (free + step * torque / inertia, torque)
                }
                _ => (rate, torque),
            };
            // A stiff spring's torque is the difference of numbers as large as K times an angle.
            let rounding = 1e-12 * (1.0 + stiffness + damping) + 1e-9 * torque.abs();
            assert!((simulator.state().velocities[0] - rate).abs() < 1e-9, "K {stiffness} D {damping}");
            assert!((simulator.torques()[0] - torque).abs() < rounding, "K {stiffness} D {damping}");
            if let Some(limit) = limit {
                assert!(simulator.torques()[0].abs() <= limit);
            }
        }
    }
}

#[test]
fn the_limit_wins_over_the_target_and_the_torque_stays_in_its_box() {
    let model = bar(r#"lower="-0.5" upper="0.5""#);
    for feedforward in [Feedforward::None, Feedforward::ContactFree, Feedforward::ContactAware] {
        let gains = gains(1e4, 10.0, Some(20.0), feedforward);
        let mut simulator = simulator(&model, &Accuracy::default(), Some(&gains), State::new(&model));
        for _ in 0..1000 {
            simulator.step(Command::Track { now: &[2.0], next: &[2.0] }).unwrap();
            assert!(simulator.state().angles[0] <= 0.5 + 1e-9, "{} rad", simulator.state().angles[0]);
            assert!(simulator.torques()[0].abs() <= 20.0);
        }
        assert!((simulator.state().angles[0] - 0.5).abs() < 1e-9);
        assert_eq!(simulator.torques()[0], 20.0);
    }
}

#[test]
fn a_limit_violated_at_the_start_is_recovered_at_a_bounded_rate() {
    let model = bar(r#"lower="-0.5" upper="0.5""#);
    let scene = Scene { gravity: [0.0; 3], ..Scene::default() };
    // What the solver may leave of a row's velocity would add up over the steps.
    let solver = SolverChoice { tolerance: 1e-15, ..SolverChoice::default() };
    let plan = common::plan(&model, &scene, &Accuracy { solver, ..Accuracy::default() }, None);
    let mut state = State::new(&model);
    state.angles[0] = 1.5;
    // 0.1 rad in each of the character's own units of time.
    let unit = plan.units.time;
    let mut simulator = Simulator::new(plan, state);
    // Half way after five of them, and back at the limit a little after ten.
    run(&mut simulator, 5.0 * unit, Command::Passive);
    assert!(simulator.state().angles[0] > 0.99, "it is pushed faster than 0.1 rad in each unit of time");
    for _ in 0..(7.0 * unit / 0.002) as usize {
        simulator.step(Command::Passive).unwrap();
        assert_eq!(simulator.state().velocities[0], 0.0, "the correction leaves a speed behind");
    }
    let angle = simulator.state().angles[0];
    assert!((-0.5..=0.5 + 1e-9).contains(&angle), "{angle} rad");
}

/// f₀ of the first pass gives the target's velocity when nothing else acts: exactly, but for forces of velocity,
/// which it takes at the old velocities and the step at the mean. At rates of 1 rad/s that accelerate by
/// 10 rad/s² they differ by some 0.01 rad/s² of the joint's inertia, which is 4e-8 rad a step and, over the 150 steps of
/// a swing, less than 1e-5 rad.
#[test]
fn feedforward_follows_a_reachable_target_exactly() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene { ground: None, ..Scene::default() });
    let gains = Gains {
        max_torque: vec![None; model.joint_count()],
        feedforward: Feedforward::ContactFree,
        // The paper's pass: the target's velocity after one step, from the first on.
        feedforward_period: 0.0,
        ..stance.gains.clone()
    };
    let scene = Scene { ground: None, ..Scene::default() };
    let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&gains));
    let mut simulator = Simulator::new(plan, stance.state.clone());
    let target = |time: f64| -> Vec<f64> {
        stance.angles.iter().map(|angle| angle + 0.1 * (1.0 - (10.0 * time).cos())).collect()
    };
    for index in 0..500 {
        let (now, next) = (target(index as f64 * 0.002), target((index + 1) as f64 * 0.002));
        simulator.step(Command::Track { now: &now, next: &next }).unwrap();
        let error =
            simulator.state().angles.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-5, "{error} rad at step {index}");
    }
}

#[test]
fn an_effect_that_never_acts_changes_no_bit() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let end = |effect: Effect, switch: Switch| {
        let mut scene = Scene::default();
        scene.effects.insert(effect, switch);
        let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&stance.gains));
        let mut simulator = Simulator::new(plan, stance.state.clone());
        run(&mut simulator, 0.5, Command::Track { now: &stance.angles, next: &stance.angles });
        simulator.state().clone()
    };
    // Standing needs little torque and is far from every limit; the bundled robot has no dry friction.
    for effect in [Effect::JointLimits, Effect::TorqueLimits, Effect::JointFriction] {
        assert_eq!(end(effect, Switch::On), end(effect, Switch::Off), "{}", effect.name());
    }
}

#[test]
fn a_locked_trunk_keeps_its_orientation() {
    let model = common::example("quadruped.urdf");
    let mut scene = Scene::default();
    scene.effects.insert(Effect::TrunkRotationLock, Switch::On);
    let stance = Stance::find(&model, &scene);
    let plan = common::plan(&model, &scene, &Accuracy::default(), Some(&stance.gains));
    let mut state = stance.state.clone();
    state.root.angular_velocity.z = 3.0;
    let mut simulator = Simulator::new(plan, state);
    let target = |time: f64| -> Vec<f64> {
        let swing = 0.4 * (12.0 * time).sin();
        stance.angles.iter().enumerate().map(|(joint, angle)| angle + swing * (joint % 2) as f64).collect()
    };
    for index in 0..500 {
        let (now, next) = (target(index as f64 * 0.002), target((index + 1) as f64 * 0.002));
        simulator.step(Command::Track { now: &now, next: &next }).unwrap();
    }
    let root = simulator.state().root;
    assert!(root.angular_velocity.norm() < 1e-12);
    assert!(root.orientation.angle_to(&stance.state.root.orientation) < 1e-12);
}

/// A force beyond all that the mass can be accelerated with.
#[test]
fn a_state_that_becomes_non_finite_ends_the_run_with_its_cause() {
    let model = urdf(
        r#"<robot name="slide"><link name="base"/><link name="dust">
            <inertial><mass value="1e-9"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
            <joint name="rail" type="prismatic"><parent link="base"/><child link="dust"/><axis xyz="1 0 0"/>
            <limit lower="-1" upper="1" effort="1e300" velocity="0"/></joint></robot>"#,
        true,
    );
    let plan = common::plan(&model, &Scene::default(), &Accuracy::default(), None);
    let mut simulator = Simulator::new(plan, State::new(&model));
    let failure = simulator.step(Command::Torque(&[1e300])).expect_err("it must fail");
    assert_eq!(failure.cause, FailureCause::NonFinite);
    assert!(failure.place.contains("rail") && failure.time >= 0.0, "{failure}");
}

#[test]
fn a_joint_that_turns_beyond_all_bounds_ends_the_run_with_its_cause() {
    let model = common::example("quadruped.urdf");
    let mut state = State::new(&model);
    state.root.position.z = 1.0;
    state.velocities[4] = 1e200;
    let mut simulator = simulator(&model, &Accuracy::default(), None, state);
    let failure = (0..10).find_map(|_| simulator.step(Command::Passive).err()).expect("it must fail");
    assert_eq!(failure.cause, FailureCause::TooFast);
    assert!(!failure.place.is_empty() && failure.time >= 0.0, "{failure}");
}

/// A kept state is gone on from bit for bit.
#[test]
fn a_simulation_taken_up_again_goes_on_bit_for_bit() {
    let model = common::example("quadruped.urdf");
    let stance = Stance::find(&model, &Scene::default());
    let target = |index: usize| -> Vec<f64> {
        let swing = 0.5 * (0.03 * index as f64).sin();
        stance.angles.iter().enumerate().map(|(joint, angle)| angle + swing * (joint % 3) as f64).collect()
    };
    let advance = |simulator: &mut Simulator, from: usize, to: usize| {
        for index in from..to {
            simulator.step(Command::Track { now: &target(index), next: &target(index + 1) }).unwrap();
        }
    };
    let new = || simulator(&model, &Accuracy::default(), Some(&stance.gains), stance.state.clone());
    let mut whole = new();
    advance(&mut whole, 0, 400);
    let mut first = new();
    advance(&mut first, 0, 173);
    let kept = first.state().clone();
    advance(&mut first, 173, 250);
    let mut second = first;
    second.set_state(&kept);
    advance(&mut second, 173, 400);
    assert_eq!(whole.state(), second.state());
}
