//! Dry friction in every joint beside contact: each step's problem is solved, and the friction obeys Coulomb's law.

use crate::common;

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::motion::{Motion, Player, TargetLimits};
use gaitwright_physics::scene::{Accuracy, Effect, Gains, Scene, SolverChoice, StepPlan, Terrain};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::{Stance, resting_height};
use nalgebra::{UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Greatest residual of a step, m/s or rad/s: the solver's own tolerance, far below every speed here.
const SOLVED: f64 = 1e-9;

/// Random states.
const STATES: u64 = 1000;

/// Steps from each of them: the first without a warm start, the others with one.
const STEPS: usize = 5;

/// The bundled quadruped with dry friction in its twelve joints, N m.
fn quadruped(friction: impl FnMut() -> f64) -> Arc<Model> {
    let mut model = Model::clone(&common::example("quadruped.urdf"));
    model.friction.fill_with(friction);
    Arc::new(model)
}

/// A state near the ground or in the air, moving in every way; some joints at rest, where friction sticks.
fn random_state(model: &Model, stance: &Stance, rng: &mut ChaCha8Rng) -> State {
    let mut state = State::new(model);
    let (pace, moving) = (10.0_f64.powf(rng.random_range(-3.0..1.0)), rng.random_range(0.0..1.0));
    for (joint, limit) in model.limits.iter().enumerate() {
        let [lower, upper] = limit.unwrap_or([-1.0, 1.0]);
        state.angles[joint] = (stance.angles[joint] + rng.random_range(-0.5..0.5)).clamp(lower, upper);
        if rng.random_bool(moving) {
            state.velocities[joint] = pace * rng.random_range(-1.0..1.0);
        }
    }
    let gap = if rng.random_bool(0.7) { rng.random_range(-2e-3..2e-3) } else { rng.random_range(0.0..0.3) };
    state.root.position.z = resting_height(model, &state.angles, &Terrain::Plane { height: 0.0 }) + gap;
    state.root.orientation =
        UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, rng.random_range(-3.0..3.0)));
    let mut any = |most: f64| Vector3::from_fn(|_, _| most * rng.random_range(-1.0..1.0));
    state.root.linear_velocity = any(pace.min(1.0));
    state.root.angular_velocity = any(pace.min(1.0));
    state
}

/// A tolerance at the edge of rounding, m/s or rad/s.
const TIGHT: f64 = 1e-13;

/// Inertia of the bundled quadruped's lower leg about its knee, kg m², rounded down.
const LEAST_INERTIA: f64 = 1e-3;

/// What the steps of a simulation left.
#[derive(Debug, Default)]
struct Seen {
    steps: usize,
    /// Steps with a residual above [`SOLVED`], or with a joint whose friction does not belong to its velocity.
    unsolved: usize,
    worst: f64,
    /// Joints that stuck and joints that slid, and contacts.
    stuck: usize,
    slid: usize,
    contacts: usize,
}

impl Seen {
    /// Steps `simulator` and checks the law of friction in every joint.
    fn step(&mut self, simulator: &mut Simulator, command: Command<'_>) {
        simulator.step(command).unwrap_or_else(|failure| panic!("{failure}"));
        self.steps += 1;
        self.worst = self.worst.max(simulator.residual());
        self.contacts += simulator.contacts().count();
        let mut lawful = true;
        let joints = simulator.joint_friction().iter().zip(&simulator.state().velocities);
        for ((torque, rate), most) in joints.zip(&simulator.model().friction) {
            lawful &= torque.abs() <= most * (1.0 + 1e-12);
            if rate.abs() > SOLVED {
                let sliding = -most * rate.signum();
                lawful &= (torque - sliding).abs() <= 1e-6 * most;
                self.slid += 1;
            } else {
                self.stuck += 1;
            }
        }
        self.unsolved += usize::from(simulator.residual() > SOLVED || !lawful);
    }

    fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.unsolved += other.unsolved;
        self.worst = self.worst.max(other.worst);
        self.stuck += other.stuck;
        self.slid += other.slid;
        self.contacts += other.contacts;
    }

    fn is_solved(&self) {
        println!("{self:?}");
        assert_eq!(self.unsolved, 0, "{self:?}");
        // Otherwise there was nothing to solve.
        assert!(self.contacts > 0 && self.stuck > 0, "{self:?}");
    }
}

fn plan(model: &Arc<Model>, gains: &Gains) -> Arc<StepPlan> {
    common::plan(model, &Scene::default(), &Accuracy::default(), Some(gains))
}

#[test]
fn every_step_from_a_thousand_random_states_is_solved() {
    let cases: Vec<u64> = match common::number("CASE") {
        Some(case) => vec![case],
        None => (0..common::number("CASES").unwrap_or(STATES)).collect(),
    };
    let stance = Stance::find(&quadruped(|| 0.15), &Scene::default());
    let results = common::in_parallel(&cases, |case| {
        let mut rng = ChaCha8Rng::seed_from_u64(*case);
        let model = quadruped(|| rng.random_range(0.1..0.2));
        let state = random_state(&model, &stance, &mut rng);
        let targets: Vec<f64> =
            state.angles.iter().map(|angle| angle + 0.05 * rng.random_range(-1.0..1.0)).collect();
        let driven = case % 4 != 0;
        let mut simulator = Simulator::new(plan(&model, &stance.gains), state);
        let mut seen = Seen::default();
        for _ in 0..STEPS {
            let command =
                if driven { Command::Track { now: &targets, next: &targets } } else { Command::Passive };
            seen.step(&mut simulator, command);
        }
        if seen.unsolved > 0 {
            println!("CASE={case}: {seen:?}");
        }
        seen
    });
    let mut all = Seen::default();
    results.iter().for_each(|seen| all.add(seen));
    all.is_solved();
}

/// The greatest dry friction of a random character's joints, as a share of its weight times its length: 0.1-0.2 N m in the bundled
/// quadruped.
const SHARE: [f64; 2] = [0.003, 0.006];

/// One of the bundled characters, each body of which weighs up to three times as much or as little.
fn random_character(examples: &[Arc<Model>], rng: &mut ChaCha8Rng) -> Arc<Model> {
    let mut model = Model::clone(&examples[rng.random_range(0..examples.len())]);
    model.mass = 0.0;
    for body in &mut model.bodies {
        let scale = 10.0_f64.powf(rng.random_range(-0.5..0.5));
        body.mass *= scale;
        body.inertia *= scale;
        model.mass += body.mass;
    }
    let weight = 9.81 * model.mass * model.size;
    model.friction.fill_with(|| weight * rng.random_range(SHARE[0]..SHARE[1]));
    Arc::new(model)
}

#[test]
fn every_step_of_a_thousand_random_characters_is_solved() {
    let cases: Vec<u64> = match common::number("CASE") {
        Some(case) => vec![case],
        None => (0..common::number("CASES").unwrap_or(STATES)).collect(),
    };
    let examples = ["quadruped.urdf", "biped.urdf", "hexapod.json", "snake.json"].map(common::example);
    let stances: Vec<Stance> = examples.iter().map(|model| Stance::find(model, &Scene::default())).collect();
    let results = common::in_parallel(&cases, |case| {
        let mut rng = ChaCha8Rng::seed_from_u64(1_000_000 + *case);
        let model = random_character(&examples, &mut rng);
        let stance = examples
            .iter()
            .zip(&stances)
            .find(|(example, _)| example.joint_names == model.joint_names)
            .map(|(_, stance)| stance)
            .unwrap();
        let state = random_state(&model, stance, &mut rng);
        let targets: Vec<f64> =
            state.angles.iter().map(|angle| angle + 0.05 * rng.random_range(-1.0..1.0)).collect();
        let driven = rng.random_bool(0.75);
        let mut simulator = Simulator::new(plan(&model, &stance.gains), state);
        let mut seen = Seen::default();
        for _ in 0..STEPS {
            let command =
                if driven { Command::Track { now: &targets, next: &targets } } else { Command::Passive };
            seen.step(&mut simulator, command);
        }
        if seen.unsolved > 0 {
            println!("CASE={case}: {} {seen:?}", model.character.name);
        }
        seen
    });
    let mut all = Seen::default();
    results.iter().for_each(|seen| all.add(seen));
    all.is_solved();
}

/// The bundled quadruped walks, stands and falls.
#[test]
fn every_step_of_standing_walking_and_falling_is_solved() {
    let model = quadruped(|| 0.15);
    let stance = Stance::find(&model, &Scene::default());
    let path = common::example_path("quadruped-walk.motion.json");
    let motion = Motion::parse(&std::fs::read(path).unwrap()).unwrap();
    let player = Player::new(&motion, &model.joint_names, &TargetLimits::of(&model.character)).unwrap();
    let walking = plan(&model, &motion.gains_for(&model.joint_names));
    let step = walking.step();

    let mut seen = Seen::default();
    let mut simulator = Simulator::new(walking.clone(), stance.state.clone());
    let (mut now, mut next) = (stance.angles.clone(), stance.angles.clone());
    player.targets(0.0, &mut next);
    for index in 0..(5.0 / step) as usize {
        std::mem::swap(&mut now, &mut next);
        player.targets((index + 1) as f64 * step, &mut next);
        seen.step(&mut simulator, Command::Track { now: &now, next: &next });
    }
    seen.is_solved();

    for height in [0.0, 0.5, 5.0] {
        println!("from {height} m:");
        fall(&model, height, false).is_solved();
    }
}

/// The robot above the ground by `height` m, driven to its standing pose or passive.
fn fall(model: &Arc<Model>, height: f64, passive: bool) -> Seen {
    let stance = Stance::find(model, &Scene::default());
    let mut start = stance.state.clone();
    start.root.position.z += height;
    let mut simulator = Simulator::new(plan(model, &stance.gains), start);
    let mut seen = Seen::default();
    for _ in 0..1500 {
        let angles = &stance.angles;
        let command = if passive { Command::Passive } else { Command::Track { now: angles, next: angles } };
        seen.step(&mut simulator, command);
    }
    seen
}

/// A robot without drives collapses onto its belly and knees. The impacts meet at up to eighteen points of a mechanism with as many
/// freedoms: many of their 60 rows depend on each other.
///
/// Before it rests it creeps at 10⁻⁸ to 10⁻⁶ m/s, on points that press in many equal ways. Which way each then slides is hardly
/// determined, and a step may be left with forces that are right to a hundred-thousandth of the weight only: with velocities of that share
/// of what the weight gives in a step.
#[test]
fn steps_of_a_collapse_onto_many_points_are_solved() {
    let of_weight = 9.81 * Accuracy::default().step;
    let seen = fall(&quadruped(|| 0.15), 0.0, true);
    println!("{seen:?}");
    assert!(seen.worst <= 1e-5 * of_weight, "{seen:?}");
    assert!(100 * seen.unsolved <= seen.steps, "{seen:?}");
    assert!(seen.contacts > 4 * seen.steps && seen.stuck > 0 && seen.slid > 0, "{seen:?}");
}

/// The torques of friction act as torques do: without friction, but with those torques commanded, the same step ends at
/// the same velocities. Where rows are solved to ε and their impulses differ by P, joint velocities differ by (P ε / I)^½ at
/// most, for the energy of the difference is half the work of that impulse along ε. P is at most twice the impulses' sum, and the least
/// inertia I that a joint shows is the lower leg's about its knee. Without velocity-dependent forces, which are iterated to a tolerance
/// of their own.
#[test]
fn friction_acts_as_its_torques_commanded_would() {
    let mut compared = 0;
    let stance = Stance::find(&quadruped(|| 0.15), &Scene::default());
    let solver = SolverChoice { tolerance: TIGHT, iterations: 1000, ..SolverChoice::default() };
    let accuracy = Accuracy { solver, ..Accuracy::default() };
    for case in 0..200 {
        let mut rng = ChaCha8Rng::seed_from_u64(case);
        let model = quadruped(|| rng.random_range(0.1..0.2));
        let state = random_state(&model, &stance, &mut rng);
        let friction = if case % 2 == 0 { 0.0 } else { 0.3 };
        let scene = Scene { friction, ..common::without(&[Effect::VelocityForces]) };
        let plan = common::plan(&model, &scene, &accuracy, None);
        let mut with = Simulator::new(plan, state.clone());
        let measured = with.substeps();
        with.step(Command::Passive).unwrap();
        // Torques of several substeps differ; two steps are taken to measure pendulums.
        if with.substeps() - measured != 3 {
            continue;
        }
        let plan = common::plan(&quadruped(|| 0.0), &scene, &accuracy, None);
        let mut without = Simulator::new(plan, state);
        without.step(Command::Torque(with.joint_friction())).unwrap();
        let (one, other) = (with.state(), without.state());
        let joints =
            one.velocities.iter().zip(&other.velocities).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let root = (one.root.linear_velocity - other.root.linear_velocity).amax();
        let pressed: f64 =
            with.contacts().chain(without.contacts()).map(|contact| contact.force.norm()).sum();
        let left = with.residual().max(without.residual()).max(TIGHT);
        let bound = 1e-9 + (2.0 * pressed * accuracy.step * left / LEAST_INERTIA).sqrt();
        assert!(joints.max(root) < bound, "CASE={case}: {joints:e} rad/s, {root:e} m/s");
        compared += 1;
    }
    assert!(compared > 100, "{compared} steps were compared");
}
