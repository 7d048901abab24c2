//! How many steps a second one core computes: a quadruped that stands on four feet and moves its targets,
//! 2 ms steps, and but for one way of them contact with the ground only. The same scene that `benches/peers/step.py` gives another engine.
//!
//! `ROBOT=path/to/a1.urdf cargo bench --bench step` takes another robot than the bundled one, and a name after `--` one
//! of the ways to solve it. What is printed is the mean over the steps of the fastest of many times of each. With
//! `dry-friction` it is the time of a step with dry friction in every joint, against that without, of the robot that sways,
//! stands, and falls.

mod common;

use std::sync::Arc;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{
    Accuracy, Effect, Feedforward, Scene, SolverChoice, SolverKind, StepPlan, Switch,
};
use gaitwright_physics::sim::rows::RowOwner;
use gaitwright_physics::sim::{Command, Simulator};
use gaitwright_physics::stance::Stance;

/// Steps of one round, from the standing pose.
const STEPS: usize = 1000;

/// The way that compares steps with dry friction in the joints with those without, and that friction, N m.
const DRY_FRICTION: &str = "dry-friction";
const FRICTION: f64 = 0.15;

/// Ways to solve the scene, by name, and whether the robot can touch itself.
const WAYS: [(&str, SolverKind, Feedforward, Switch); 5] = [
    ("newton", SolverKind::Newton, Feedforward::None, Switch::Off),
    ("self-collision", SolverKind::Newton, Feedforward::None, Switch::On),
    ("contact-free", SolverKind::Newton, Feedforward::ContactFree, Switch::Off),
    ("contact-aware", SolverKind::Newton, Feedforward::ContactAware, Switch::Off),
    ("pgs", SolverKind::Pgs, Feedforward::None, Switch::Off),
];

fn main() {
    let rounds = if common::measuring() { 1000 } else { 1 };
    let chosen = std::env::args().skip(1).find(|argument| !argument.starts_with('-'));
    if let Some(chosen) = &chosen {
        assert!(
            chosen == DRY_FRICTION || WAYS.iter().any(|(name, ..)| name == chosen),
            "{chosen} is none of the ways to solve the scene"
        );
    }
    let model = common::robot();
    if chosen.as_ref().is_none_or(|chosen| chosen == DRY_FRICTION) {
        dry_friction(&model, rounds);
    }
    let stance = Stance::find(&model, &Scene::default());
    for (name, kind, feedforward, itself) in WAYS {
        if chosen.as_ref().is_some_and(|chosen| chosen != name) {
            continue;
        }
        let scene = Scene { effects: [(Effect::SelfCollision, itself)].into(), ..Scene::default() };
        let accuracy =
            Accuracy { solver: SolverChoice { kind, ..SolverChoice::default() }, ..Accuracy::default() };
        let mut gains = stance.gains.clone();
        gains.feedforward = feedforward;
        let plan = StepPlan::compile(&scene, &accuracy, Some(&gains), &model).expect("a sound plan");
        let start = Simulator::new(Arc::new(plan), stance.state.clone());
        let targets = common::sway(&stance.angles, 0.05, accuracy.step, STEPS);
        let time = common::nanoseconds(&start, &targets, rounds);
        let (contacts, residual) = observe(&start, &targets);
        println!(
            "{name}: {:.0} steps/s, {contacts:.2} contacts, residual at most {residual:.1e} m/s",
            1e9 / time
        );
    }
}

/// Prints the time of a step with dry friction in all joints of `model` against that without, and how many steps were left
/// with a residual above the solver's tolerance.
fn dry_friction(model: &Arc<Model>, rounds: usize) {
    let stance = Stance::find(model, &Scene::default());
    let accuracy = Accuracy::default();
    let start = |friction: f64, height: f64| {
        let mut model = Model::clone(model);
        model.friction.fill(friction);
        let gains = Some(&stance.gains);
        let scene = ground_only();
        let plan = StepPlan::compile(&scene, &accuracy, gains, &Arc::new(model)).expect("a sound plan");
        let mut state = stance.state.clone();
        state.root.position.z += height;
        Simulator::new(Arc::new(plan), state)
    };
    for (motion, sway, height) in [("sways", 0.05, 0.0), ("stands", 0.0, 0.0), ("falls", 0.0, 0.5)] {
        let targets = common::sway(&stance.angles, sway, accuracy.step, STEPS);
        // In turns, so that both see the same machine.
        let (mut without, mut with) = (common::Fastest::default(), common::Fastest::default());
        for _ in 0..rounds.div_ceil(50) {
            without.measure(&start(0.0, height), &targets, rounds.min(10));
            with.measure(&start(FRICTION, height), &targets, rounds.min(10));
        }
        let (without, with) = (without.nanoseconds(), with.nanoseconds());
        let mut simulator = start(FRICTION, height);
        let (mut rows, mut unsolved, evaluations) = (0, 0, simulator.evaluations());
        for pair in targets.windows(2) {
            simulator.step(Command::Track { now: &pair[0], next: &pair[1] }).expect("a step");
            rows += simulator.rows().iter().filter(|owner| matches!(owner, RowOwner::DryFriction(_))).count();
            unsolved += usize::from(simulator.residual() > accuracy.solver.tolerance);
        }
        println!(
            "{DRY_FRICTION}, {motion}: {:.2} times the step without it ({with:.0} ns, {without:.0} ns), {:.2} rows of it and \
             {:.2} evaluations a step, {unsolved} unsolved",
            with / without,
            rows as f64 / STEPS as f64,
            (simulator.evaluations() - evaluations) as f64 / STEPS as f64,
        );
    }
}

/// Contact with the ground only.
fn ground_only() -> Scene {
    Scene { effects: [(Effect::SelfCollision, Switch::Off)].into(), ..Scene::default() }
}

/// Mean number of contacts, and the greatest residual, m/s.
fn observe(start: &Simulator, targets: &[Vec<f64>]) -> (f64, f64) {
    let mut simulator = start.clone();
    let (mut contacts, mut worst) = (0, 0.0_f64);
    for pair in targets.windows(2) {
        simulator.step(Command::Track { now: &pair[0], next: &pair[1] }).expect("a step");
        contacts += simulator.contacts().count();
        worst = worst.max(simulator.residual());
    }
    (contacts as f64 / (targets.len() - 1) as f64, worst)
}
