//! How many steps a second one core computes: a quadruped that stands on four feet and moves its targets,
//! ground contact only, 2 ms steps. The same scene that `benches/peers/step.py` gives another engine.
//!
//! `ROBOT=path/to/a1.urdf cargo bench --bench step` takes another robot than the bundled one.

use std::hint::black_box;
use std::path::PathBuf;
use std::sync::Arc;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use gaitwright::character::{self, Options};
use gaitwright::model::Model;
use gaitwright::scene::{Accuracy, Feedforward, Scene, SolverChoice, SolverKind, StepPlan};
use gaitwright::sim::{Command, Simulator};
use gaitwright::stance::Stance;

/// Steps of one round, from the standing pose.
const STEPS: usize = 1000;

fn robot() -> Arc<Model> {
    let bundled = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/quadruped.urdf");
    let path = std::env::var_os("ROBOT").map_or(bundled, PathBuf::from);
    let reading = character::read_file(&path, Options::default()).expect("a readable robot");
    Arc::new(Model::new(Arc::new(reading.character), false))
}

/// Targets that sway by 0.05 rad at 1 Hz about the standing pose, knees and hips.
fn targets(stance: &Stance, step: f64) -> Vec<Vec<f64>> {
    (0..=STEPS)
        .map(|index| {
            let sway = 0.05 * (std::f64::consts::TAU * index as f64 * step).sin();
            stance
                .angles
                .iter()
                .enumerate()
                .map(|(joint, angle)| angle + sway * f64::from(joint % 3 != 0))
                .collect()
        })
        .collect()
}

fn steps(criterion: &mut Criterion) {
    let model = robot();
    let scene = Scene::default();
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
        let targets = targets(&stance, accuracy.step);
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
