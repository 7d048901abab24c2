//! How many steps a second one core computes: a quadruped that stands on four feet and moves its targets,
//! ground contact only, 2 ms steps. The same scene that `benches/peers/step.py` gives another engine.
//!
//! `ROBOT=path/to/a1.urdf cargo bench --bench step` takes another robot than the bundled one.

mod common;

use std::hint::black_box;
use std::sync::Arc;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use gaitwright::scene::{Accuracy, Effect, Feedforward, Scene, SolverChoice, SolverKind, StepPlan, Switch};
use gaitwright::sim::{Command, Simulator};
use gaitwright::stance::Stance;

/// Steps of one round, from the standing pose.
const STEPS: usize = 1000;

fn steps(criterion: &mut Criterion) {
    let model = common::robot();
    // Contact with the ground only, as in the peers' scripts.
    let scene = Scene { effects: [(Effect::SelfCollision, Switch::Off)].into(), ..Scene::default() };
    let stance = Stance::find(&model, &scene);
    let mut group = criterion.benchmark_group("step");
    group.throughput(Throughput::Elements(STEPS as u64));
    for (name, kind, feedforward) in [
        ("newton", SolverKind::Newton, Feedforward::None),
        ("newton, contact-free feedforward", SolverKind::Newton, Feedforward::ContactFree),
        ("newton, contact-aware feedforward", SolverKind::Newton, Feedforward::ContactAware),
        ("pgs", SolverKind::Pgs, Feedforward::None),
    ] {
        let accuracy =
            Accuracy { solver: SolverChoice { kind, ..SolverChoice::default() }, ..Accuracy::default() };
        let mut gains = stance.gains.clone();
        gains.feedforward = feedforward;
        let plan = StepPlan::compile(&scene, &accuracy, Some(&gains), &model).expect("a sound plan");
        let start = Simulator::new(model.clone(), Arc::new(plan), stance.state.clone());
        let targets = common::sway(&stance.angles, 0.05, accuracy.step, STEPS);
        let mut contacts = 0;
        let mut worst: f64 = 0.0;
        group.bench_function(name, |bencher| {
            bencher.iter_batched_ref(
                || start.clone(),
                |simulator| {
                    contacts = 0;
                    for pair in targets.windows(2) {
                        let command = Command::Track { now: &pair[0], next: &pair[1] };
                        simulator.step(black_box(command)).expect("a step");
                        contacts += simulator.contacts().count();
                        worst = worst.max(simulator.residual());
                    }
                },
                BatchSize::LargeInput,
            );
        });
        println!("{name}: {:.2} contacts, residual at most {worst:.1e} m/s", contacts as f64 / STEPS as f64);
    }
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
