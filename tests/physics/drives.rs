//! Drives and motors: velocity control, the torque-speed line of a motor, offset torques, the feedforward's period.

use crate::bodies;
use crate::common;

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{Motion, Player, TargetLimits};
use gaitwright_physics::scene::{
    Accuracy, Coordinates, Effect, Feedforward, Gains, Integrator, Scene, SolverChoice, SolverKind, Switch,
};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;

use bodies::urdf;

/// The motor's greatest torque, N m, and speed, rad/s.
const TORQUE: f64 = 20.0;
const SPEED: f64 = 10.0;

/// A flywheel of 1 kg m² that a motor turns about a vertical hinge.
fn flywheel() -> Arc<Model> {
    urdf(
        &format!(
            r#"<robot name="flywheel"><link name="base"><inertial><mass value="1"/>
              <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
            <link name="wheel"><inertial><mass value="1"/>
              <inertia ixx="0.6" ixy="0" ixz="0" iyy="0.6" iyz="0" izz="1"/></inertial></link>
            <joint name="hinge" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 0 1"/>
              <limit effort="{TORQUE}" velocity="{SPEED}"/></joint></robot>"#
        ),
        true,
    )
}

fn motor(max_torque: Option<f64>) -> Gains {
    Gains { stiffness: vec![0.0], damping: vec![0.0], max_torque: vec![max_torque], ..Gains::default() }
}

fn accuracies(step: f64) -> [Accuracy; 3] {
    let base = Accuracy { step, ..Accuracy::default() };
    [
        base,
        Accuracy { integrator: Integrator::MoreauJean, ..base },
        Accuracy { coordinates: Coordinates::Maximal, ..base },
    ]
}

/// The flywheel's velocity after each step under `command`, and its torques.
fn drive(
    gains: &Gains,
    accuracy: &Accuracy,
    start: f64,
    steps: usize,
    command: Command<'_>,
) -> Vec<[f64; 2]> {
    let model = flywheel();
    let plan = common::plan(&model, &Scene::default(), accuracy, Some(gains));
    let mut state = State::new(&model);
    state.velocities[0] = start;
    let mut simulator = Simulator::new(plan, state);
    (0..steps)
        .map(|_| {
            simulator.step(command).unwrap_or_else(|failure| panic!("{failure}"));
            [simulator.state().velocities[0], simulator.torques()[0]]
        })
        .collect()
}

/// I q̈ = τ_max (1 − q̇ / v_max) ends in v_max (1 − e^(−t τ_max / (I v_max))). With the new velocity in the line each step
/// divides the rest by 1 + h τ_max / (I v_max), exactly.
#[test]
fn a_motor_on_its_torque_speed_line_approaches_its_greatest_speed() {
    for step in [0.001, 0.004] {
        for accuracy in accuracies(step) {
            for sign in [1.0, -1.0] {
                let servo = [Some(sign * 2.0 * SPEED)];
                let torque = [sign * 5.0 * TORQUE];
                for command in [Command::Velocity(&servo), Command::Torque(&torque)] {
                    let mut rest = SPEED;
                    for [rate, torque] in drive(&motor(Some(TORQUE)), &accuracy, 0.0, 500, command) {
                        rest /= 1.0 + step * TORQUE / SPEED;
                        let wanted = sign * (SPEED - rest);
                        assert!((rate - wanted).abs() < 1e-9, "{accuracy:?}: {rate} instead of {wanted}");
                        let line = sign * TORQUE * (1.0 - rate.abs() / SPEED);
                        assert!((torque - line).abs() < 1e-7, "{accuracy:?}: {torque} instead of {line}");
                    }
                    // The scheme's limit is the closed form, at first order.
                    let seconds = 500.0 * step;
                    let exact = SPEED * (-seconds * TORQUE / SPEED).exp();
                    assert!((rest - exact).abs() < 2.0 * step * SPEED, "{rest} instead of {exact}");
                }
            }
        }
    }
}

/// Against the motion the whole torque brakes, at any speed; and beyond its greatest speed a motor has nothing to give.
#[test]
fn a_motor_brakes_with_its_whole_torque() {
    let step = 0.001;
    for accuracy in accuracies(step) {
        for sign in [1.0, -1.0] {
            for start in [0.9 * SPEED, 3.0 * SPEED] {
                let torque = [-sign * 5.0 * TORQUE];
                let braked =
                    drive(&motor(Some(TORQUE)), &accuracy, sign * start, 100, Command::Torque(&torque));
                for (index, [rate, torque]) in braked.iter().enumerate() {
                    let wanted = sign * (start - TORQUE * step * (index + 1) as f64);
                    assert!((rate - wanted).abs() < 1e-9, "{accuracy:?}: {rate} instead of {wanted}");
                    assert!((torque + sign * TORQUE).abs() < 1e-9, "{accuracy:?}: {torque}");
                }
            }
            let torque = [sign * TORQUE];
            for [rate, torque] in
                drive(&motor(Some(TORQUE)), &accuracy, sign * 2.0 * SPEED, 50, Command::Torque(&torque))
            {
                assert!((rate - sign * 2.0 * SPEED).abs() < 1e-9 && torque.abs() < 1e-9, "{rate}, {torque}");
            }
        }
    }
}

/// Through standstill, from full braking to the falling line.
#[test]
fn a_motor_reverses_through_standstill() {
    let step = 0.001;
    for accuracy in accuracies(step) {
        let torque = [TORQUE];
        let mut rate = -0.3 * SPEED;
        for [found, _] in drive(&motor(Some(TORQUE)), &accuracy, rate, 1000, Command::Torque(&torque)) {
            let braking = rate + step * TORQUE;
            rate =
                if braking <= 0.0 { braking } else { (rate + step * TORQUE) / (1.0 + step * TORQUE / SPEED) };
            assert!((found - rate).abs() < 1e-9, "{accuracy:?}: {found} instead of {rate}");
        }
    }
}

#[test]
fn a_prescribed_torque_stays_within_the_effort() {
    let step = 0.002;
    for accuracy in accuracies(step) {
        let model = flywheel();
        let torque = [5.0 * TORQUE];
        let rate = |effects: &[Effect]| {
            let mut scene = Scene::default();
            for effect in effects {
                scene.effects.insert(*effect, Switch::Off);
            }
            let plan = common::plan(&model, &scene, &accuracy, Some(&motor(Some(TORQUE))));
            let mut simulator = Simulator::new(plan, State::new(&model));
            simulator.step(Command::Torque(&torque)).unwrap();
            simulator.state().velocities[0]
        };
        assert!((rate(&[Effect::SpeedLimits]) - step * TORQUE).abs() < 1e-12);
        assert!((rate(&[Effect::TorqueLimits]) - step * torque[0]).abs() < 1e-12);
    }
}

/// Equation 17: the wanted velocity after one step if the torque suffices, else the greatest torque until it does.
#[test]
fn velocity_control_holds_its_velocity_within_the_torque() {
    let step = 0.002;
    for accuracy in accuracies(step) {
        for (max_torque, wanted) in [(None, 3.0), (Some(TORQUE), 3.0), (Some(TORQUE), 0.03), (None, -50.0)] {
            let mut gains = motor(max_torque);
            gains.feedforward = Feedforward::None;
            let model = flywheel();
            let scene = Scene { effects: [(Effect::SpeedLimits, Switch::Off)].into(), ..Scene::default() };
            let plan = common::plan(&model, &scene, &accuracy, Some(&gains));
            let mut simulator = Simulator::new(plan, State::new(&model));
            let command = [Some(wanted)];
            let mut rate: f64 = 0.0;
            for _ in 0..100 {
                simulator.step(Command::Velocity(&command)).unwrap();
                let most = max_torque.unwrap_or(f64::INFINITY) * step;
                let change = (wanted - rate).clamp(-most, most);
                rate += change;
                let found = simulator.state().velocities[0];
                assert!((found - rate).abs() < 1e-7 * wanted.abs(), "{accuracy:?}: {found}, not {rate}");
                let torque = simulator.torques()[0];
                assert!((torque - change / step).abs() < 1e-6 * wanted.abs() / step, "{torque}");
            }
        }
        // A joint left out is passive.
        let coasting = drive(&motor(Some(TORQUE)), &accuracy, 2.0, 10, Command::Velocity(&[None]));
        assert!(coasting.iter().all(|[rate, torque]| (rate - 2.0).abs() < 1e-12 && *torque == 0.0));
    }
}

/// A constant offset f₀ displaces a spring by f₀ / K.
#[test]
fn an_offset_displaces_the_spring() {
    for accuracy in accuracies(0.002) {
        let gains = Gains {
            stiffness: vec![100.0],
            damping: vec![20.0],
            max_torque: vec![None],
            offset: vec![5.0],
            ..Gains::default()
        };
        let model = flywheel();
        let plan = common::plan(&model, &Scene::default(), &accuracy, Some(&gains));
        let mut simulator = Simulator::new(plan, State::new(&model));
        for _ in 0..5000 {
            simulator.step(Command::Track { now: &[0.1], next: &[0.1] }).unwrap();
        }
        let angle = simulator.state().angles[0];
        assert!((angle - 0.15).abs() < 1e-9, "{angle}");
    }
}

/// The pass brings an error of velocity e to e (1 − x + x²/2 − x³/2)ⁿ with x = h / T, which is e^(−t/T) to second order, and
/// follows an accelerating target without lag.
#[test]
fn feedforward_reaches_the_targets_velocity_within_its_period() {
    let (step, period) = (0.001, 0.02);
    let x: f64 = step / period;
    let left = 1.0 - x + 0.5 * x.powi(2) - 0.5 * x.powi(3);
    assert!((left - (-x).exp()).abs() < x.powi(3));
    for feedforward in [Feedforward::ContactFree, Feedforward::ContactAware] {
        for accuracy in accuracies(step) {
            let gains = Gains { feedforward, feedforward_period: period, ..motor(None) };
            let model = flywheel();
            let plan = common::plan(&model, &Scene::default(), &accuracy, Some(&gains));
            let mut state = State::new(&model);
            state.velocities[0] = 1.0;
            let mut simulator = Simulator::new(plan, state);
            let acceleration = 7.0;
            let target = |time: f64| 0.5 * acceleration * time * time;
            let mean =
                |index: usize| (target(step * (index + 1) as f64) - target(step * index as f64)) / step;
            let mut error = mean(0) - 1.0;
            for index in 0..200 {
                let (now, next) = (target(step * index as f64), target(step * (index + 1) as f64));
                simulator.step(Command::Track { now: &[now], next: &[next] }).unwrap();
                error *= left;
                let found = mean(index) - simulator.state().velocities[0];
                assert!((found - error).abs() < 1e-9, "{accuracy:?}: {found} instead of {error}");
            }
        }
    }
}

/// Feet that will touch down within the feedforward's period, but not within the step: only the feedforward has contacts to solve for.
#[test]
fn forces_of_the_feedforward_that_do_not_solve_its_problem_are_counted() {
    let model = common::example("quadruped.urdf");
    let scene = Scene { friction: 0.8, ..Scene::default() };
    let stance = Stance::find(&model, &scene);
    let unsolved = |feedforward: Feedforward| {
        let gains = Gains { feedforward, ..stance.gains.clone() };
        let solver = SolverChoice { kind: SolverKind::Pgs, iterations: 1, ..SolverChoice::default() };
        let accuracy = Accuracy { step: 5e-4, solver, ..Accuracy::default() };
        let plan = common::plan(&model, &scene, &accuracy, Some(&gains));
        let mut start = stance.state.clone();
        start.root.position.z += 0.004;
        start.root.linear_velocity.z = -1.0;
        let mut simulator = Simulator::new(plan, start);
        for _ in 0..2 {
            simulator.step(Command::Track { now: &stance.angles, next: &stance.angles }).unwrap();
        }
        assert_eq!(simulator.contacts().filter(|contact| contact.force.norm() > 0.0).count(), 0);
        simulator.record().unsolved_steps
    };
    assert_eq!(unsolved(Feedforward::ContactFree), 0);
    assert_eq!(unsolved(Feedforward::ContactAware), 2);
}

/// The bundled walk.
fn walk() -> Motion {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/quadruped-walk.motion.json");
    Motion::parse(&std::fs::read(path).unwrap()).unwrap()
}

/// Distance that the bundled walk covers in 5 s, m.
fn walked(feedforward: Feedforward, step: f64) -> f64 {
    let (model, motion, scene) = (common::example("quadruped.urdf"), walk(), Scene::default());
    let player = Player::new(&motion, &model.joint_names, &TargetLimits::of(&model.character)).unwrap();
    let gains = Gains { feedforward, ..motion.gains_for(&model.joint_names) };
    let plan = common::plan(&model, &scene, &Accuracy { step, ..Accuracy::default() }, Some(&gains));
    let stance = Stance::find(&model, &scene);
    let start = stance.state.root.position;
    let mut simulator = Simulator::new(plan, stance.state);
    play(&player, &mut simulator, step, 5.0);
    (simulator.state().root.position - start).x
}

/// Plays so many seconds of the player's targets, from the simulator's time on, in steps of `step` seconds.
fn play(player: &Player, simulator: &mut Simulator, step: f64, seconds: f64) {
    let start = simulator.state().time;
    let joints = simulator.state().angles.len();
    let (mut now, mut next) = (vec![0.0; joints], vec![0.0; joints]);
    player.targets(start, &mut next);
    for index in 1..=(seconds / step).round() as usize {
        std::mem::swap(&mut now, &mut next);
        player.targets(start + index as f64 * step, &mut next);
        simulator
            .step(Command::Track { now: &now, next: &next })
            .unwrap_or_else(|failure| panic!("{failure}"));
    }
}

/// Short pieces of the walk with contact-aware feedforward, each from the same state at every step, end at places that converge: what
/// the pass takes the contacts for depends on the state alone, also where Coulomb's law leaves several answers. A foot touches down or lifts
/// off up to a step too early or too late; with four feet and a few steps of settling that is six steps of the way, as in a whole walk.
#[test]
fn pieces_of_a_walk_with_contact_aware_feedforward_converge() {
    let (model, motion, scene) = (common::example("quadruped.urdf"), walk(), Scene::default());
    let player = Player::new(&motion, &model.joint_names, &TargetLimits::of(&model.character)).unwrap();
    let gains = Gains { feedforward: Feedforward::ContactAware, ..motion.gains_for(&model.joint_names) };
    let plan =
        |step: f64| common::plan(&model, &scene, &Accuracy { step, ..Accuracy::default() }, Some(&gains));
    let mut path = Simulator::new(plan(1.25e-4), Stance::find(&model, &scene).state);
    let starts: Vec<State> = (0..12)
        .map(|_| {
            play(&player, &mut path, 1.25e-4, 0.25);
            path.state().clone()
        })
        .collect();
    let speed = motion.metrics.speed;
    let checked = common::in_parallel(&starts, |start| {
        let ends = [5e-4, 1.25e-4, 1.25e-5].map(|step| {
            let mut simulator = Simulator::new(plan(step), start.clone());
            play(&player, &mut simulator, step, 0.064);
            simulator.state().root.position
        });
        [5e-4, 1.25e-4].map(|step| 6.0 * step * speed).into_iter().zip(ends).all(|(bound, end)| {
            let off = (end - ends[2]).norm();
            println!("{:.3} s: {off:.1e} m of {bound:.1e}", start.time);
            off < bound
        })
    });
    assert!(checked.iter().all(|converges| *converges));
}

/// The walk's distance converges as the step falls, whatever the feedforward. In each stride a foot touches down or lifts off up
/// to a step too early or too late, which changes the stride by that share of its time, with four feet and a few
/// steps of settling by a few times that: six times is the bound. A pass that looks ahead for contacts has touch-downs and lift-offs
/// of its own beside those, earlier by half its period, and errs as much at each: its bound is twice that. Over three halvings the difference
/// from the finest step falls as at first order, by eight, of which half is left to chance, unless it is below half a per cent.
#[test]
fn a_walks_distance_converges() {
    let steps = [0.002, 0.001, 0.0005, 0.00025, 0.000125];
    let stride = walk().metrics.stride_period.unwrap();
    for feedforward in [Feedforward::None, Feedforward::ContactFree, Feedforward::ContactAware] {
        let distances = common::in_parallel(&steps, |step| walked(feedforward, *step));
        println!("{feedforward:?}: {distances:.4?} m");
        let [coarser @ .., finest] = &distances[..] else { panic!("no distances") };
        let errors: Vec<f64> = coarser.iter().map(|distance| (distance / finest - 1.0).abs()).collect();
        let events = if feedforward == Feedforward::ContactAware { 12.0 } else { 6.0 };
        for (step, error) in steps.iter().zip(&errors) {
            assert!(*error < events * step / stride, "{feedforward:?} at {step} s: {distances:?}");
        }
        assert!(errors[0] < 0.005 || errors[3] < errors[0] / 4.0, "{feedforward:?}: {distances:?}");
    }
}
