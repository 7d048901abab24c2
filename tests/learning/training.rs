//! Training gait by gait: which gaits a task calls for, and what comes out of it.

use std::sync::Arc;
use std::time::Duration;

use gaitwright_learning::gait::{GaitContext, GaitReport, measure};
use gaitwright_learning::learn::{
    AskedSpeed, Cancel, Clock, Generation, Learning, LearningSetup, Seeds, SpeedWord, StopReason, Task,
};
use gaitwright_learning::program::subject::Subject;
use gaitwright_learning::training::niche::{NichePace, niches};
use gaitwright_learning::training::{
    LearnedMotion, Milestone, Trained, TrainingCheckpoint, TrainingObserver, check_task, train,
};
use gaitwright_physics::character::read_file;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::Trial;
use gaitwright_physics::playback::{Playback, Trace};
use gaitwright_physics::scene::{Accuracy, Scene, StepPlan, usual_step};
use gaitwright_physics::sim::link_poses;
use gaitwright_physics::stance::{Stance, Upright};
use nalgebra::Vector3;
use serde_json::Value;

const GRAVITY: f64 = 9.81;

fn setup(name: &str, task: Task, learning: Learning, threads: usize) -> LearningSetup {
    let reading = read_file(&crate::common::example_path(name), Default::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    setup_of(model, (Scene::default(), Accuracy::default()), task, learning, threads)
}

fn setup_of(
    model: Arc<Model>,
    (scene, accuracy): (Scene, Accuracy),
    task: Task,
    learning: Learning,
    threads: usize,
) -> LearningSetup {
    let stance = Arc::new(Stance::find(&model, &scene));
    let gravity = Vector3::from(scene.gravity).norm();
    let parameters = learning.resolve(&stance, gravity, accuracy.step).unwrap();
    LearningSetup { model, stance, scene, accuracy, task, parameters, seed: 3, threads }
}

/// So many generations for a gait, looked for once only, however busy the machine is.
fn once(gait_generations: u32) -> Learning {
    Learning { generations: Some(2 * gait_generations - 1), gait_generations, ..Learning::default() }
}

/// Keeps what it is told, and cancels at the first checkpoint if asked to.
#[derive(Default)]
struct Witness {
    curve: Vec<Generation>,
    improved: Vec<LearnedMotion>,
    finished: Vec<LearnedMotion>,
    checkpoints: Vec<TrainingCheckpoint>,
    cancel: Option<Cancel>,
}

impl TrainingObserver for Witness {
    fn generation(&mut self, figures: &Generation) {
        self.curve.push(figures.clone());
    }

    fn improved(&mut self, motion: &LearnedMotion) {
        self.improved.push(motion.clone());
    }

    fn finished(&mut self, motion: &LearnedMotion) {
        self.finished.push(motion.clone());
    }

    fn checkpoint(&mut self, checkpoint: &TrainingCheckpoint) {
        self.checkpoints.push(checkpoint.clone());
        if let Some(cancel) = &self.cancel {
            cancel.cancel();
        }
    }
}

/// Without what the wall clock says.
fn timeless(curve: &[Generation]) -> Vec<Generation> {
    curve.iter().map(|figures| Generation { elapsed: 0.0, ..figures.clone() }).collect()
}

fn gait(name: &str) -> Task {
    Task { gait: name.into(), ..Task::default() }
}

fn names(character: &str, task: &Task) -> Vec<String> {
    let setup = setup(character, task.clone(), Learning::default(), 1);
    let LearningSetup { model, stance, scene, accuracy, .. } = &setup;
    let subject = Subject::new(model, stance, scene, accuracy, task.direction).unwrap();
    niches(task, &subject).into_iter().map(|niche| niche.name).collect()
}

#[test]
fn speeds_are_from_the_least_froude_number_to_the_greatest() {
    let setup = setup("quadruped.urdf", Task::default(), Learning::default(), 1);
    let LearningSetup { model, stance, scene, accuracy, .. } = &setup;
    let subject = Subject::new(model, stance, scene, accuracy, [1.0, 0.0, 0.0]).unwrap();
    for (froude, allowed) in
        [(0.9e-4, false), (1.1e-4, true), (99.0, true), (101.0, false), (0.0, false), (1e-300, false)]
    {
        assert_eq!(Task { froude: Some(froude), ..Task::default() }.faults().is_empty(), allowed, "{froude}");
        // The same as a speed, which is a Froude number once it is known whose.
        let speed = (froude * GRAVITY * subject.legs.hip_height).sqrt();
        let task = Task { speed: Some(AskedSpeed::Number(speed)), ..Task::default() };
        assert_eq!(check_task(&task, model, stance, scene).is_ok(), allowed, "{speed} m/s");
    }
}

#[test]
fn a_task_calls_for_the_gaits_that_suit_it() {
    // A dog walks at Froude number 0.1, trots at 0.5 and gallops at 3 (Alexander & Jayes 1983).
    let at = |froude| Task { froude: Some(froude), ..Task::default() };
    assert_eq!(names("quadruped.urdf", &at(0.05))[0], "walk");
    assert!(names("quadruped.urdf", &at(0.05)).iter().all(|name| !name.contains("gallop")));
    assert_eq!(names("quadruped.urdf", &at(0.45))[0], "trot");
    assert!(names("quadruped.urdf", &at(2.5)).iter().any(|name| name.contains("gallop")));
    assert!(names("quadruped.urdf", &at(2.5)).iter().all(|name| name != "walk"));
    // Every gait, and the fastest; each name once.
    let all = names("quadruped.urdf", &Task::default());
    for name in ["walk", "trot", "running trot", "pace", "canter", "bound", "pronk"] {
        assert_eq!(all.iter().filter(|other| *other == name).count(), 1, "{name} in {all:?}");
    }
    assert!(
        all.iter().any(|name| name.contains("gallop")) && all.iter().any(|name| name.contains("fastest"))
    );
    assert_eq!(names("quadruped.urdf", &gait("trot")), ["trot"]);
    assert_eq!(names("quadruped.urdf", &Task { froude: Some(1.5), ..gait("trot") }), ["running trot"]);
    // Of gaits that are used in several ways each has a name of its own.
    assert_eq!(names("quadruped.urdf", &gait("running trot")), ["running trot"]);
    assert_eq!(names("quadruped.urdf", &gait("rotary gallop")), ["rotary gallop"]);
    assert_eq!(names("hexapod.json", &gait("ripple")), ["ripple"]);
    assert_eq!(names("biped.urdf", &gait("run")), ["run"]);
    // A speed in m/s is the same as its Froude number v² / (g l).
    let setup = setup("quadruped.urdf", Task::default(), Learning::default(), 1);
    let LearningSetup { model, stance, scene, accuracy, .. } = &setup;
    let subject = Subject::new(model, stance, scene, accuracy, [1.0, 0.0, 0.0]).unwrap();
    let speed = (0.2 * GRAVITY * subject.legs.hip_height).sqrt();
    let task = Task { speed: Some(AskedSpeed::Number(speed)), ..gait("walk") };
    let NichePace::Cheapest { first, others } = &niches(&task, &subject)[0].pace else { panic!() };
    assert!((first - 0.2).abs() < 1e-12 && others.is_empty());
    let task = Task { speed: Some(AskedSpeed::Word(SpeedWord::Fastest)), ..Task::default() };
    assert!(matches!(niches(&task, &subject)[0].pace, NichePace::Fastest { .. }));
}

#[test]
fn a_gait_that_the_legs_do_not_allow_is_refused() {
    let asked = |character: &str, name: &str| {
        let setup = setup(character, gait(name), Learning::default(), 1);
        train(&setup, &mut Witness::default(), &Cancel::default(), None).unwrap_err().to_string()
    };
    assert!(asked("biped.urdf", "trot").contains("walk, run, hop"), "{}", asked("biped.urdf", "trot"));
    assert!(asked("quadruped.urdf", "tripod").contains("/task/gait"));
    assert!(asked("snake.json", "walk").contains("undulation, crawling"));
}

fn few(generations: u32) -> Learning {
    Learning { generations: Some(generations), gait_generations: 6, ..Learning::default() }
}

#[test]
fn the_repertoire_is_the_same_with_any_threads_and_after_an_interruption() {
    let task = Task { speed: Some(AskedSpeed::Number(0.9)), ..Task::default() };
    // Two gaits: the second is cut short by the budget.
    let whole = |threads| {
        let mut witness = Witness::default();
        let setup = setup("quadruped.urdf", task.clone(), few(8), threads);
        let trained = train(&setup, &mut witness, &Cancel::default(), None).unwrap();
        (trained, witness)
    };
    let ((alone, witness), (together, _)) = (whole(1), whole(3));
    assert_eq!(alone.motions, together.motions);
    assert_eq!(timeless(&alone.curve), timeless(&together.curve));
    assert_eq!(alone.ended, StopReason::Generations);
    assert_eq!(alone.curve.len(), 8);
    assert_eq!(witness.finished, alone.motions);
    assert!(alone.motions.len() == 2 && !witness.improved.is_empty());

    let cancel = Cancel::default();
    let mut witness = Witness { cancel: Some(cancel.clone()), ..Witness::default() };
    let setup = setup("quadruped.urdf", task.clone(), few(8), 2);
    let cut: Trained = train(&setup, &mut witness, &cancel, None).unwrap();
    assert_eq!((cut.ended, cut.motions.len()), (StopReason::Cancelled, 1));
    // As a file would have it.
    let text = serde_json::to_string(&witness.checkpoints[0]).unwrap();
    let checkpoint: TrainingCheckpoint = serde_json::from_str(&text).unwrap();
    let resumed =
        train(&setup, &mut Witness::default(), &Cancel::default(), Some(checkpoint.clone())).unwrap();
    assert_eq!(resumed.motions, alone.motions);
    assert_eq!(timeless(&resumed.curve), timeless(&alone.curve));
    // That of another training is refused.
    let other = LearningSetup { seed: 4, ..setup };
    let error = train(&other, &mut Witness::default(), &Cancel::default(), Some(checkpoint)).unwrap_err();
    assert!(error.to_string().contains("/checkpoint/seed"), "{error}");
}

/// A search without end is cut short in time to compare its best and to set it straight: what is broken off has no checkpoint. By a
/// clock that counts the looks at it, the same work takes the same time whatever else the machine does.
#[test]
fn a_search_that_runs_out_of_time_is_ended_properly() {
    let learning = Learning { seconds: Some(12.0), gait_generations: 100_000, ..Learning::default() };
    let setup = setup("quadruped.urdf", gait("trot"), learning, 1);
    let cancel = Cancel::of_learner_with(Clock::of_readings(Duration::from_micros(5)));
    let mut witness = Witness::default();
    let trained = train(&setup, &mut witness, &cancel, None).unwrap();
    assert_eq!(trained.ended, StopReason::Seconds);
    assert_eq!(trained.motions.len(), 1);
    assert_eq!(trained.motions, witness.finished);
    assert_eq!(witness.checkpoints.len(), 1, "broken off: {:?}", trained.curve.last());
}

/// A search that is broken off, here too soon for a proper end, still gives what it has seen to be natural.
#[test]
fn what_was_natural_on_the_way_is_not_lost_when_time_ends() {
    for seconds in [2.0, 3.0, 4.0] {
        let learning = Learning { seconds: Some(seconds), gait_generations: 100_000, ..Learning::default() };
        let setup = setup("quadruped.urdf", gait("trot"), learning, 1);
        let cancel = Cancel::of_learner_with(Clock::of_readings(Duration::from_micros(5)));
        let mut witness = Witness::default();
        let trained = train(&setup, &mut witness, &cancel, None).unwrap();
        assert_eq!((trained.ended, witness.checkpoints.len()), (StopReason::Seconds, 0));
        // The first natural motion is shown, after the seed that stays up.
        assert_eq!(witness.improved.len(), 2);
        let motion = &trained.motions[0];
        let player = motion.player(&setup.stance.angles);
        let checked = motion.check(&setup, &player).run(&|| false).unwrap();
        assert!(checked.gait.natural, "after {seconds} s: {:#?}", checked.gait.naturalness);
    }
}

#[test]
fn a_few_generations_teach_a_walk_that_is_a_walk() {
    let learning = once(40);
    let task = Task { froude: Some(0.1), ..gait("walk") };
    let setup = setup("quadruped.urdf", task, learning, 2);
    let trained = train(&setup, &mut Witness::default(), &Cancel::default(), None).unwrap();
    assert_eq!(trained.ended, StopReason::Complete);
    let motion = &trained.motions[0];
    assert_eq!(motion.behaviour.cycle.len(), 8, "the whole stride is kept");

    let LearningSetup { model, stance, scene, accuracy, .. } = &setup;
    let player = motion.player(&stance.angles);
    // It was taken for keeping every trial, and comes with them: they need not be tried again.
    let check = motion.check(&setup, &player);
    let mut checked = check.run(&|| false).unwrap();
    assert_eq!(motion.trials, check.trials(&checked, 1, &|| false).unwrap());
    assert!(motion.trials.len() == 10 && motion.trials.iter().all(Trial::kept), "{:?}", motion.trials);
    // The step is no part of what moves, so that the speed may hardly depend on it.
    let (steps, others): (Vec<_>, Vec<_>) =
        motion.trials.iter().partition(|trial| trial.change.starts_with("step of "));
    assert!(steps.len() == 2 && steps.iter().all(|trial| trial.tolerance == 0.05), "{steps:?}");
    assert!(others.iter().all(|trial| trial.tolerance == 0.2), "{others:?}");
    // What goes by the name of a leap is tried as one, on ground four times as hard, whatever was asked for.
    checked.gait.gait = Some("bound".to_owned());
    let of_leap = check.trials(&checked, 1, &|| false).unwrap();
    let softness = |trials: &[Trial]| -> f64 {
        let named =
            |trial: &Trial| trial.change.strip_prefix("soft contacts of ")?.split(' ').next()?.parse().ok();
        trials.iter().find_map(named).unwrap()
    };
    let (of_walk, of_leap) = (softness(&motion.trials), softness(&of_leap));
    assert!((of_leap / of_walk - 0.25).abs() < 1e-3, "{of_leap} and {of_walk} ms");
    let played_at = |factor: f64| {
        let accuracy = Accuracy { step: factor * accuracy.step, ..*accuracy };
        let plan = StepPlan::compile(scene, &accuracy, Some(&motion.gains), model).unwrap();
        let playback = Playback {
            model,
            plan: &Arc::new(plan),
            start: &stance.state,
            player: &player,
            upright: &Upright::new(model, stance, scene),
            seconds: 15.0,
            sample_every: 0.004,
        };
        let mut trace = playback.run(|| false);
        assert_eq!(trace.fell_at, None, "at {factor} of the step");
        trace.samples.retain(|sample| sample.time > player.lead() + 2.0 * player.period());
        trace
    };
    let trace = played_at(1.0);
    let standing = link_poses(model, &stance.state);
    let gait = measure(
        &trace,
        &GaitContext {
            model,
            support: &stance.support,
            standing: &standing,
            ground: 0.0,
            mass: model.mass,
            gravity: GRAVITY,
            direction: [1.0, 0.0, 0.0],
        },
    );
    assert_eq!(gait.gait.as_deref(), Some("walk"), "{gait:?}");
    // Lateral sequence (Hildebrand 1965): hind, fore of one side, then of the other, a quarter of a stride apart.
    let wanted = motion.speed.unwrap();
    assert!((gait.speed / wanted - 1.0).abs() < 0.1, "{} of {wanted} m/s", gait.speed);
    // What was learned is not the step: at a quarter of it and at twice it the walk is as fast.
    let way = |trace: &Trace| {
        let [first, last] = [trace.samples.first(), trace.samples.last()].map(Option::unwrap);
        last.center_of_mass.x - first.center_of_mass.x
    };
    for factor in [0.25, 2.0] {
        let kept = way(&played_at(factor)) / way(&trace);
        assert!((kept - 1.0).abs() < 0.05, "{kept} of the speed at {factor} of the step");
    }
    // Each foot stands for more than half of the stride: a walk, not a hop.
    assert!(gait.feet.iter().all(|foot| foot.duty_factor > 0.5), "{:?}", gait.feet);
}

/// Two, six and eight legs: what is found stays up for 20 s, has the name of what was asked for, and its speed.
#[test]
fn two_legs_walk_and_six_and_eight_legs_go_by_threes_and_fours() {
    for (name, asked, froude) in
        [("biped.urdf", "walk", 0.03), ("hexapod.json", "tripod", 0.08), ("spider.json", "tetrapod", 0.08)]
    {
        let learning = once(20);
        let task = Task { froude: Some(froude), ..gait(asked) };
        let setup = setup(name, task, learning, 2);
        let trained = train(&setup, &mut Witness::default(), &Cancel::default(), None).unwrap();
        let motion = &trained.motions[0];
        let player = motion.player(&setup.stance.angles);
        let checked = motion.check(&setup, &player).run(&|| false).unwrap();
        assert_eq!(checked.trace.fell_at, None, "{name}");
        let measures = &checked.gait.naturalness;
        for measure in ["upright", "strides", "named", "asked_gait", "speed", "travel", "symmetry"] {
            assert!(measures[measure].holds, "{name}: {measure} {:?}", measures[measure]);
        }
    }
}

/// The bundled runner stays up for 20 s in a run of the speed asked for: each foot stands for less than half of the stride, half a
/// stride after the other, so that it flies between them. With a third of the usual generations not every seed gets there.
#[test]
fn two_legs_run() {
    let learning = Learning { generations: Some(60), gait_generations: 20, ..Learning::default() };
    let task = Task { froude: Some(0.7), ..gait("run") };
    let setup = LearningSetup { seed: 2, ..setup("runner.urdf", task, learning, 2) };
    let trained = train(&setup, &mut Witness::default(), &Cancel::default(), None).unwrap();
    let motion = &trained.motions[0];
    let checked = motion.check(&setup, &motion.player(&setup.stance.angles)).run(&|| false).unwrap();
    assert_eq!(checked.trace.fell_at, None);
    let GaitReport { naturalness, feet, gait, .. } = &checked.gait;
    for measure in ["upright", "strides", "asked_gait", "speed", "cost_of_transport", "symmetry"] {
        assert!(naturalness[measure].holds, "{measure}: {:?}", naturalness[measure]);
    }
    assert_eq!(gait.as_deref(), Some("run"));
    assert!(feet.iter().all(|foot| foot.duty_factor < 0.5), "{feet:?}");
}

/// The bundled quadruped of 12 mg, of 300 t, and on the Moon: all learn a trot that is natural by every measure.
#[test]
fn the_smallest_and_the_largest_learn_a_natural_trot_and_so_does_who_is_on_the_moon() {
    for (mass, gravity) in [(12e-6, GRAVITY), (3e5_f64, GRAVITY), (12.0, 1.62)] {
        let reading = read_file(&crate::common::example_path("quadruped.urdf"), Default::default()).unwrap();
        let scale = (mass / 12.0).cbrt();
        let learning = once(30);
        let task = Task { froude: Some(0.4), ..gait("trot") };
        let character = crate::common::scaled(&reading.character, scale);
        let model = Arc::new(Model::new(Arc::new(character), Base::Floating));
        let accuracy = Accuracy { step: usual_step(model.size), ..Accuracy::default() };
        let scene = Scene { gravity: [0.0, 0.0, -gravity], ..Scene::default() };
        let setup = setup_of(model, (scene, accuracy), task, learning, 2);
        assert!((setup.model.mass / mass - 1.0).abs() < 1e-6);
        let trained = train(&setup, &mut Witness::default(), &Cancel::default(), None).unwrap();
        let motion = &trained.motions[0];
        let player = motion.player(&setup.stance.angles);
        assert!(!motion.trials.is_empty());
        for trial in &motion.trials {
            let rounds = (trial.of_seconds - player.lead()) / player.period();
            assert!(rounds > 9.99 && rounds < 120.01, "{mass} kg at {gravity} m/s²: {rounds} rounds");
        }
        let checked = motion.check(&setup, &player).run(&|| false).unwrap();
        let broken: Vec<_> = checked.gait.naturalness.iter().filter(|(_, measure)| !measure.holds).collect();
        assert!(checked.gait.natural, "{mass} kg at {gravity} m/s²: {broken:?}");
    }
}

/// The least that QDSEGA can be asked for.
fn brief_qdsega(generations: u32) -> Learning {
    Learning {
        generations: Some(generations),
        population: 4,
        islands: 1,
        elite: 1,
        episodes: 2,
        check_seconds: 2.0,
        cache_generations: 1,
        seeds: Seeds::None,
        ..Learning::default()
    }
}

#[test]
fn without_seeds_qdsega_searches() {
    for character in ["quadruped.urdf", "snake.json"] {
        let setup = setup(character, Task::default(), brief_qdsega(1), 2);
        let mut witness = Witness::default();
        let trained = train(&setup, &mut witness, &Cancel::default(), None).unwrap();
        assert_eq!(trained.ended, StopReason::Generations);
        assert_eq!(trained.curve.len(), 1);
        assert!(trained.curve[0].gait.is_none() && !witness.improved.is_empty());
        for motion in trained.motions.iter().chain(&witness.improved) {
            assert!(motion.gait.is_none() && motion.gains == setup.stance.gains);
        }
    }
}

/// The first five segments of the snake, on ground without friction: no wave gets them anywhere.
fn without_friction(learning: Learning) -> LearningSetup {
    let text = std::fs::read_to_string(crate::common::example_path("snake.json")).unwrap();
    let mut document: Value = serde_json::from_str(&text).unwrap();
    document["links"].as_array_mut().unwrap().truncate(5);
    document["joints"].as_array_mut().unwrap().truncate(4);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("snake.json");
    std::fs::write(&path, document.to_string()).unwrap();
    let reading = read_file(&path, Default::default()).unwrap();
    let model = Arc::new(Model::new(Arc::new(reading.character), Base::Floating));
    let scene = Scene { friction: 0.0, ..Scene::default() };
    setup_of(model, (scene, Accuracy::default()), gait("undulation"), learning, 2)
}

/// Where no gait gets on, QDSEGA takes over with what is left of the budget, also where the clock decided that one gait was not
/// searched for again; what is learned then depends on the clock, which the result says.
#[test]
fn qdsega_takes_over_where_no_gait_gets_on() {
    // One attempt takes four generations. In the second case there are generations for another, but no time.
    let cases = [(7, None, StopReason::Generations), (8, Some(10.0), StopReason::Seconds)];
    for (generations, seconds, ended) in cases {
        let seeds = Seeds::Templates;
        let learning = Learning { gait_generations: 1, seconds, seeds, ..brief_qdsega(generations) };
        let setup = without_friction(learning);
        let cancel = Cancel::of_learner_with(Clock::of_readings(Duration::from_micros(5)));
        let trained = train(&setup, &mut Witness::default(), &cancel, None).unwrap();
        let gaits: Vec<Option<&str>> = trained.curve.iter().map(|figures| figures.gait.as_deref()).collect();
        let (in_gaits, after) = gaits.split_at(4.min(gaits.len()));
        assert!(in_gaits.iter().all(|gait| *gait == Some("undulation")), "{gaits:?}");
        assert_eq!(after, vec![None; generations as usize - 4]);
        assert_eq!(trained.ended, ended);
    }
}

/// Where QDSEGA took over from the search gait by gait, a resumed training still knows what that one showed.
#[test]
fn what_was_shown_before_qdsega_took_over_is_not_lost_when_it_is_resumed() {
    let first =
        setup("quadruped.urdf", gait("trot"), Learning { generations: Some(1), ..Learning::default() }, 2);
    let mut witness = Witness::default();
    let trot = train(&first, &mut witness, &Cancel::default(), None).unwrap();
    let shown = vec![Milestone { motion: witness.improved.remove(0), finished: false }];

    let qdsega = setup("quadruped.urdf", Task::default(), brief_qdsega(1), 2);
    let mut witness = Witness::default();
    train(&qdsega, &mut witness, &Cancel::default(), None).unwrap();
    let Some(TrainingCheckpoint::Qdsega { learner, .. }) = witness.checkpoints.pop() else { panic!() };
    let before = trot.curve.clone();
    let shown_before = shown.clone();
    let resumed =
        TrainingCheckpoint::Qdsega { learner, before, shown: shown_before, spent: 0.0, by_the_clock: false };

    let more = setup("quadruped.urdf", Task::default(), brief_qdsega(2 + trot.curve.len() as u32), 2);
    let mut witness = Witness::default();
    train(&more, &mut witness, &Cancel::default(), Some(resumed)).unwrap();
    let last = witness.checkpoints.pop().unwrap();
    assert_eq!(last.curve().len(), trot.curve.len() + 2);
    assert_eq!(last.milestones(&more)[..1], shown);
}
