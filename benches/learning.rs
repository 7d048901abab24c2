//! What learning costs: one transition in the simulator, and one generation of the search, on the
//! bundled quadruped.

use std::hint::black_box;
use std::path::PathBuf;
use std::sync::Arc;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use gaitwright_learning::learn::evaluation::{SimulatedWorld, World};
use gaitwright_learning::learn::genome::Genome;
use gaitwright_learning::learn::grid::Grid;
use gaitwright_learning::learn::transition::Transition;
use gaitwright_learning::learn::{
    Behaviour, Cancel, Checkpoint, Generation, Learning, LearningSetup, Observer, Stop, Task, learn,
};
use gaitwright_physics::character::{self, Options};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::stance::Stance;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

struct Nobody;

impl Observer for Nobody {
    fn generation(&mut self, _: &Generation) {}
    fn improved(&mut self, _: &Behaviour) {}
    fn checkpoint(&mut self, _: &Checkpoint) {}
}

fn setup() -> LearningSetup {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("examples/quadruped.urdf");
    let reading = character::read_file(&path, Options::default()).expect("the bundled quadruped can be read");
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let scene = Scene::default();
    let stance = Arc::new(Stance::find(&model, &scene));
    let learning = Learning { generations: Some(1), ..Learning::default() };
    let accuracy = Accuracy::default();
    let parameters = learning.resolve(&stance, 9.81, accuracy.step).expect("defaults are sound");
    LearningSetup { model, stance, scene, accuracy, task: Task::default(), parameters, seed: 1, threads: 1 }
}

/// One transition from the standing pose to a state drawn at random; throughput in simulation steps.
fn transition(criterion: &mut Criterion) {
    let setup = setup();
    let parameters = &setup.parameters;
    let mut world = SimulatedWorld::new(
        &setup.model,
        &setup.stance,
        (&setup.scene, &setup.accuracy, setup.task.direction),
        None,
        parameters,
    )
    .expect("defaults are sound");
    let grid = Grid::new(&setup.model, &setup.stance, setup.task.direction, parameters);
    let genome = Genome::random(&grid, 1, true, &mut ChaCha8Rng::seed_from_u64(1));
    let (from, to) = (grid.standing(), grid.posture(&genome.states[0]));
    let transition = Transition { from: &from, to: &to, duration: parameters.transition_time };
    let targets = |t: f64, angles: &mut [f64]| transition.targets(t, angles);
    let standing = world.standing().clone();
    // Learning has a limit of time as a rule, and looks at the clock for it.
    let distant = Stop::new(&Cancel::default(), Some(1e6));
    let mut group = criterion.benchmark_group("learning");
    group.throughput(Throughput::Elements(parameters.transition_steps));
    group.bench_function("transition", |bencher| {
        bencher
            .iter(|| black_box(world.track(&standing, &targets, 0..parameters.transition_steps, &distant)));
    });
    group.finish();
}

/// The first generation, on one thread.
fn generation(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("learning");
    group.sample_size(10);
    group.bench_function("generation", |bencher| {
        bencher.iter_batched(
            setup,
            |setup| learn(&setup, &mut Nobody, &Cancel::default(), None).expect("defaults are sound"),
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

criterion_group!(benches, transition, generation);
criterion_main!(benches);
