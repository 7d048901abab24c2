//! Natural gaits: what each costs, how it looks in figures, and how long training takes.
//!
//!     SEEDS=5 ROBOT=a1.urdf OUT=folder cargo bench -p gaitwright-learning --bench natural
//!
//! Trains each of `CASES`, gaits with a Froude number each (`"walk:0.1 trot:0.4 trot:1 canter:1 bound:1 gallop:2"` where not
//! stated), on the robot that `ROBOT` names, or on the bundled quadruped, as a job does that asks for that gait at that Froude number.
//! `CASES=all` trains the repertoire of a job that asks for nothing. `DIRECTION="0 1"`, `SEEDS` (how many), `SEED` (the first),
//! `GENERATIONS` (of each gait) and `THREADS` as said. Each line is one motion; figures are those of a continuous
//! simulation of 20 s. Traces of the links are written to the folder `OUT`, one a motion, to be drawn; `gaitwright train`
//! writes motion documents.

#![allow(clippy::print_stdout)]

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use gaitwright_learning::check::{CheckedMotion, MotionCheck};
use gaitwright_learning::learn::{Cancel, Generation, Learning, LearningSetup, Task, reference_gravity};
use gaitwright_learning::training::{LearnedMotion, TrainingCheckpoint, TrainingObserver, train};
use gaitwright_physics::character::{Options, read_file};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::playback::Trace;
use gaitwright_physics::scene::{Accuracy, Scene};
use gaitwright_physics::stance::Stance;

fn variable<T: std::str::FromStr>(name: &str, otherwise: T) -> T {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

/// Mean speed along the direction from `from` seconds on, and the time upright.
fn speed(setup: &LearningSetup, trace: &Trace, from: f64) -> (f64, f64) {
    let [x, y, _] = setup.task.direction;
    let length = x.hypot(y);
    let later: Vec<_> = trace.samples.iter().filter(|sample| sample.time >= from).collect();
    let (Some(first), Some(last)) = (later.first(), later.last()) else { return (0.0, 0.0) };
    let way = last.center_of_mass - first.center_of_mass;
    ((way.x * x + way.y * y) / length / (last.time - first.time).max(1e-9), last.time)
}

/// Measures each motion as it is finished.
struct Measurer<'a> {
    setup: &'a LearningSetup,
    begun: Instant,
}

impl TrainingObserver for Measurer<'_> {
    fn generation(&mut self, _: &Generation) {}

    fn improved(&mut self, motion: &LearnedMotion) {
        if std::env::var_os("VERBOSE").is_some() {
            println!("  {}: from the seeds, fitness {:.3}", motion.name, motion.behaviour.fitness);
        }
    }

    fn finished(&mut self, motion: &LearnedMotion) {
        let spent = self.begun.elapsed().as_secs_f64();
        report(self.setup, motion, spent);
        self.begun = Instant::now();
    }

    fn checkpoint(&mut self, _: &TrainingCheckpoint) {}
}

fn main() {
    // Cargo runs a bench in the folder of its package; paths are those of the workspace.
    let workspace = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..");
    let path = workspace.join(variable("ROBOT", "examples/quadruped.urdf".to_owned()));
    let reading = read_file(&path, Options::default()).expect("a readable robot");
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let scene = Scene::default();
    let stance = Arc::new(Stance::find(&model, &scene));
    let direction: String = variable("DIRECTION", "1 0".into());
    let parts: Vec<f64> = direction.split_whitespace().filter_map(|part| part.parse().ok()).collect();
    let accuracy = Accuracy { step: variable("STEP", 0.002), ..Accuracy::default() };
    println!("{}: {:.1} kg", model.character.name, model.mass);
    // `cargo test` only tries whether it runs.
    let measuring = std::env::args().any(|argument| argument == "--bench");
    let gait_generations = variable("GENERATIONS", if measuring { 60u32 } else { 1 });
    let cases: String = variable("CASES", "walk:0.1 trot:0.4 trot:1 canter:1 bound:1 gallop:2".into());
    let (first_seed, count) = (variable("SEED", 1u64), variable("SEEDS", 1u64));
    for case in cases.split_whitespace() {
        let mut task = Task { direction: [parts[0], parts[1], 0.0], ..Task::default() };
        if let Some((gait, froude)) = case.split_once(':') {
            task.gait = gait.to_owned();
            task.froude = Some(froude.parse().expect("a number"));
        }
        for seed in first_seed..first_seed + count {
            let budget = Some(if measuring { 100_000 } else { 1 });
            let learning = Learning { generations: budget, gait_generations, ..Learning::default() };
            let parameters = learning
                .resolve(&stance, reference_gravity(&scene), accuracy.step)
                .expect("sound parameters");
            let setup = LearningSetup {
                model: model.clone(),
                stance: stance.clone(),
                scene: scene.clone(),
                accuracy,
                task: task.clone(),
                parameters,
                seed,
                threads: variable("THREADS", 2),
            };
            let mut measurer = Measurer { setup: &setup, begun: Instant::now() };
            train(&setup, &mut measurer, &Cancel::default(), None)
                .expect("a gait that the character has legs for");
        }
    }
}

fn report(setup: &LearningSetup, motion: &LearnedMotion, spent: f64) {
    let LearningSetup { model, stance, accuracy, seed, .. } = setup;
    let player = motion.player(&stance.angles);
    let check = motion.check(setup, &player);
    let CheckedMotion { trace, gait, .. } = check.run(&|| false).expect("a sound scene");
    let at_step = |factor: f64| {
        let accuracy = Accuracy { step: factor * accuracy.step, ..*accuracy };
        let check = MotionCheck { accuracy: &accuracy, ..check };
        speed(setup, &check.play(10.0, 0.02, &|| false).expect("a sound scene"), 2.0)
    };
    let (finer, coarser) = (at_step(0.25), at_step(2.0));
    let duty: Vec<String> = gait.feet.iter().map(|foot| format!("{:.2}", foot.duty_factor)).collect();
    let phases: Vec<String> =
        gait.feet.iter().map(|foot| foot.phase.map_or("-".into(), |phase| format!("{phase:.2}"))).collect();
    let heading = trace.samples.last().map_or(0.0, |sample| sample.root.orientation.euler_angles().2);
    let broken: Vec<String> = gait
        .naturalness
        .iter()
        .filter(|(_, measure)| !measure.holds)
        .map(|(name, measure)| format!("{name} {:.3}", measure.value))
        .collect();
    println!(
        "{} seed {seed}: {:.3} m/s of {:.3}, Fr {:.2}, CoT {:.3}, T {:.3} s, {}, {} [{}], duty {}, phases {}, aerial {:.2}, \
         slip {:.3} m/s, heading {heading:.2} rad, upright {:.1} s, fitness {:.3}; at a quarter of the step {:.3} m/s for \
         {:.1} s, at twice {:.3} m/s for {:.1} s; {spent:.1} s",
        motion.name,
        gait.speed,
        motion.speed.unwrap_or_default(),
        gait.froude.unwrap_or_default(),
        gait.cost_of_transport.unwrap_or_default(),
        gait.stride_period.unwrap_or_default(),
        gait.gait.as_deref().unwrap_or("-"),
        if gait.natural { "natural" } else { "not natural" },
        broken.join(", "),
        duty.join(" "),
        phases.join(" "),
        gait.aerial_fraction,
        gait.stance_slip,
        trace.fell_at.unwrap_or(20.0),
        motion.behaviour.fitness,
        finer.0,
        finer.1,
        coarser.0,
        coarser.1,
    );
    let Some(folder) = std::env::var_os("OUT").map(PathBuf::from) else { return };
    std::fs::create_dir_all(&folder).expect("a folder to write to");
    let name = format!("{}-{}-{seed}", model.character.name, motion.name.replace(' ', "-"));
    // Joint origins and feet for a drawing: one line a sample, `time body x y z …`.
    let mut lines = String::new();
    let parents: Vec<usize> = model
        .character
        .links
        .iter()
        .map(|link| link.joint.as_ref().map_or(0, |joint| joint.parent))
        .collect();
    writeln!(lines, "{parents:?}").expect("text");
    for sample in trace.samples.iter().take_while(|sample| sample.time < 8.0).step_by(5) {
        write!(lines, "{:.4}", sample.time).expect("text");
        for pose in &sample.link_poses {
            let at = pose.translation.vector;
            write!(lines, " {:.4} {:.4} {:.4}", at.x, at.y, at.z).expect("text");
        }
        lines.push('\n');
    }
    std::fs::write(folder.join(format!("{name}.trace")), lines).expect("the trace is written");
}
