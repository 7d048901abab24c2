//! Natural gaits from leg programs: what each costs, how it looks in figures, and how long that takes.
//!
//!     ROBOT=a1.urdf OUT=folder cargo bench -p gaitwright-learning --bench natural
//!
//! Trains walk at Froude number 0.1, trot at 0.4 and running trot at 1 (`CASES="canter:1 bound:1"` for others) on the
//! robot that `ROBOT` names, or on the bundled quadruped; `DIRECTION="0 1"`, `SEEDS` (5: how many), `GENERATIONS` and
//! `THREADS` as said. Each line is one seed; figures are those of a continuous simulation of 20 s. Motion documents
//! are written to the folder `OUT`, and a trace of the links beside each.

#![allow(clippy::print_stdout)]

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use gaitwright_learning::gait::{GaitContext, measure};
use gaitwright_learning::learn::{Cancel, Posture, Stop};
use gaitwright_learning::program::document::{RolloutRecord, motion};
use gaitwright_learning::program::gaits::{gaits, named};
use gaitwright_learning::program::refine::{Candidate, Refinement, Subject, seeds};
use gaitwright_learning::program::ring::Wanted;
use gaitwright_physics::character::{Options, read_file};
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::{Player, Provenance};
use gaitwright_physics::playback::{Playback, Trace};
use gaitwright_physics::scene::{Accuracy, Scene, StepPlan};
use gaitwright_physics::sim::link_poses;
use gaitwright_physics::stance::{Stance, Upright};

fn variable<T: std::str::FromStr>(name: &str, otherwise: T) -> T {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

/// The ring played from the standing pose for `seconds` at this step.
fn play(subject: &Subject, candidate: &Candidate, seconds: f64, step: f64, sample_every: f64) -> Trace {
    let Candidate { ring, gains, .. } = candidate;
    let accuracy = Accuracy { step, ..subject.accuracy };
    let plan = StepPlan::compile(&subject.scene, &accuracy, Some(gains), &subject.model).expect("a plan");
    let player = Player::from_postures(
        &subject.stance.angles,
        ring.entry.iter().map(Posture::parts),
        ring.cycle.iter().map(Posture::parts),
        ring.transition_time(),
    );
    let playback = Playback {
        model: &subject.model,
        plan: &Arc::new(plan),
        start: &subject.stance.state,
        player: &player,
        upright: &Upright::new(&subject.model, &subject.stance, &subject.scene),
        seconds,
        sample_every,
    };
    playback.run(|| false)
}

/// Mean speed along the direction from `from` seconds on, and the time upright.
fn speed(subject: &Subject, trace: &Trace, from: f64) -> (f64, f64) {
    let [x, y, _] = subject.direction;
    let length = x.hypot(y);
    let later: Vec<_> = trace.samples.iter().filter(|sample| sample.time >= from).collect();
    let (Some(first), Some(last)) = (later.first(), later.last()) else { return (0.0, 0.0) };
    let way = last.center_of_mass - first.center_of_mass;
    ((way.x * x + way.y * y) / length / (last.time - first.time).max(1e-9), last.time)
}

fn main() {
    let bundled = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../examples/quadruped.urdf");
    let path = std::env::var_os("ROBOT").map_or(bundled, PathBuf::from);
    let reading = read_file(&path, Options::default()).expect("a readable robot");
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let scene = Scene::default();
    let stance = Arc::new(Stance::find(&model, &scene));
    let direction: String = variable("DIRECTION", "1 0".into());
    let parts: Vec<f64> = direction.split_whitespace().filter_map(|part| part.parse().ok()).collect();
    let accuracy = Accuracy { step: variable("STEP", 0.002), ..Accuracy::default() };
    let subject = Subject::new(&model, &stance, &scene, &accuracy, [parts[0], parts[1], 0.0]).expect("legs");
    let legs = &subject.legs;
    println!(
        "{}: {:.1} kg, {} legs of {:.3} m, hips at {:.3} m",
        model.character.name,
        model.mass,
        legs.legs.len(),
        legs.length,
        legs.hip_height
    );
    if std::env::var_os("VERBOSE").is_some() {
        for leg in &legs.legs {
            println!(
                "  joints {:?} hip {:.3?} foot {:.3?} r {:.3} length {:.3} level {} standing {:.2?}",
                leg.joints,
                leg.hip.as_slice(),
                leg.foot.as_slice(),
                leg.radius,
                leg.length,
                leg.level,
                leg.standing
            );
            for raise in [0.0, 0.05, 0.1] {
                let mut angles = leg.standing.clone();
                let left = leg.reach(
                    &mut angles,
                    nalgebra::Vector3::new(leg.hip.x, leg.foot.y, leg.foot.z - raise),
                    nalgebra::Vector3::z(),
                );
                println!("    raised by {raise}: {angles:.2?} left {left:.4}");
            }
        }
    }
    let default = if legs.legs.len() == 4 { "walk:0.1 trot:0.4 running_trot:1" } else { "" };
    let cases: String = variable("CASES", default.into());
    let threads = variable("THREADS", 2);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let arena = subject.arena().expect("a sound scene");
    let doubled = Accuracy { step: 2.0 * accuracy.step, ..accuracy };
    let coarse = Subject { accuracy: doubled, ..subject.clone() }.arena().expect("a sound scene");
    let (first_seed, count) = (variable("SEED", 1u64), variable("SEEDS", 1u64));
    // `cargo test` only tries whether it runs.
    let measuring = std::env::args().any(|argument| argument == "--bench");
    let generations = variable("GENERATIONS", if measuring { 60u32 } else { 1 });
    for case in cases.split_whitespace() {
        let (name, froude) = case.split_once(':').expect("gait:froude");
        let name = name.replace('_', " ");
        let Some(gait) = named(&name, legs) else {
            let names: Vec<&str> = gaits(legs.legs.len()).iter().map(|gait| gait.name).collect();
            println!("no gait {name}; there are {names:?}");
            continue;
        };
        let wanted = Wanted::at_froude(legs, gait, froude.parse().expect("a number"), subject.gravity());
        for number in first_seed..first_seed + count {
            let begun = Instant::now();
            let mut refinement = Refinement::new(&pool, &subject, &arena, &wanted, &seeds(), number);
            let first = refinement.best().clone();
            let stop = Stop::new(&Cancel::default(), None);
            for generation in 0..generations {
                // Twice the step ranks nearly as well in half the time.
                let arena = if 3 * generation < 2 * generations { &coarse } else { &arena };
                refinement.generation((&pool, &stop), &subject, arena, &wanted).expect("nobody stops");
            }
            let best =
                refinement.finish((&pool, &stop), &subject, &arena, &wanted, 40).expect("nobody stops");
            let spent = begun.elapsed().as_secs_f64();
            println!(
                "{name} Fr {froude} seed {number}: {:.2} m/s asked; template {:.2} m/s, upright {:.2}, cost {:.2}; then \
                 cost {:.2} after {} evaluations, {:.0} s simulated, {spent:.1} s, sigma {:.3}",
                wanted.speed,
                first.figures.speed,
                first.figures.upright,
                first.cost,
                best.cost,
                refinement.evaluations,
                refinement.seconds,
                refinement.search_sigma(),
            );
            if std::env::var_os("VERBOSE").is_some() {
                println!(
                    "  {:.2?} missed {:.4} m\n  {:?}\n  {:?}",
                    best.parameters, best.ring.missed, best.figures, best.disturbed
                );
            }
            report(
                &subject,
                &wanted,
                &best,
                &format!("{}-{}-{number}", model.character.name, name.replace(' ', "-")),
                number,
            );
        }
    }
}

fn report(subject: &Subject, wanted: &Wanted, candidate: &Candidate, name: &str, number: u64) {
    let Candidate { ring, gains, .. } = candidate;
    let trace = play(subject, candidate, 20.0, subject.accuracy.step, 0.004);
    let mut looping = trace.clone();
    looping.samples.retain(|sample| sample.time >= ring.lead() + 2.0 * ring.period);
    let standing = link_poses(&subject.model, &subject.stance.state);
    let setting = GaitContext {
        character: &subject.model.character,
        support: &subject.stance.support,
        standing: &standing,
        ground: 0.0,
        mass: subject.model.mass,
        gravity: wanted.gravity,
        direction: subject.direction,
    };
    let gait = measure(&looping, &setting);
    let duty: Vec<String> = gait.feet.iter().map(|foot| format!("{:.2}", foot.duty_factor)).collect();
    let phases: Vec<String> =
        gait.feet.iter().map(|foot| foot.phase.map_or("-".into(), |phase| format!("{phase:.2}"))).collect();
    let heading = trace.samples.last().map_or(0.0, |sample| sample.root.orientation.euler_angles().2);
    let finer = speed(subject, &play(subject, candidate, 10.0, subject.accuracy.step / 4.0, 0.02), 2.0);
    let coarser = speed(subject, &play(subject, candidate, 10.0, subject.accuracy.step * 2.0, 0.02), 2.0);
    // The trace's work is that of the whole run, standing start included.
    let whole = trace
        .samples
        .last()
        .map_or(0.0, |last| (last.center_of_mass - trace.samples[0].center_of_mass).xy().norm());
    println!(
        "  20 s: {:.3} m/s, CoT {:.3}, T {:.3} s, {} ({}), duty {}, phases {}, aerial {:.2}, slip {:.3} m/s, heading {heading:.2} rad, upright {:.1} s; \
         at a quarter of the step {:.3} m/s for {:.1} s, at twice {:.3} m/s for {:.1} s",
        gait.speed,
        trace.joint_work / (subject.model.mass * wanted.gravity * whole.max(1e-9)),
        gait.stride_period.unwrap_or(0.0),
        gait.gait.as_deref().unwrap_or("-"),
        gait.distance.map_or("-".into(), |distance| format!("{distance:.3}")),
        duty.join(" "),
        phases.join(" "),
        gait.aerial_fraction,
        gait.stance_slip,
        trace.fell_at.unwrap_or(20.0),
        finer.0,
        finer.1,
        coarser.0,
        coarser.1,
    );
    let Some(folder) = std::env::var_os("OUT").map(PathBuf::from) else { return };
    std::fs::create_dir_all(&folder).expect("a folder to write to");
    let provenance = Provenance {
        program: "gaitwright".into(),
        version: env!("CARGO_PKG_VERSION").into(),
        seed: Some(number),
        learning: serde_json::json!({ "search": "leg program" }),
        task: serde_json::json!({ "gait": wanted.gait.name, "speed": wanted.speed, "direction": subject.direction }),
        accuracy: subject.accuracy,
        effects: Default::default(),
    };
    let performance = RolloutRecord {
        model: &subject.model,
        standing: &subject.stance.angles,
        trace: &trace,
        gait: &gait,
        drive: gains,
        scene: &subject.scene,
        provenance: &provenance,
    };
    if let Some(document) = motion(ring, &performance) {
        let text = document.to_json().expect("a sound document");
        std::fs::write(folder.join(format!("{name}.motion.json")), text).expect("the document is written");
    }
    // Joint origins and feet for a drawing: one line a sample, `time body x y z …`.
    let mut lines = String::new();
    let parents: Vec<usize> = subject
        .model
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
