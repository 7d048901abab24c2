//! What each effect costs: work and time of a step with the effects that a plan has by default, with each of those
//! switched off, and with each of the others switched on.
//!
//! Every variant takes each step from the same state: the one that the default plan has come to there. So a ratio
//! is that of the same step with and without the effect, and not of another course of the motion. What vanishes is
//! counted beside the time: evaluations of the dynamics, complementarity problems, their rows and the solver's iterations.

mod common;

use std::sync::Arc;
use std::time::Instant;

use gaitwright_physics::model::Model;
use gaitwright_physics::scene::{Accuracy, Effect, Feedforward, Gains, Ground, Scene, StepPlan, Switch};
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;

/// A character, what it does and where.
struct Case {
    name: &'static str,
    model: Arc<Model>,
    gains: Gains,
    start: State,
    targets: Vec<Vec<f64>>,
    /// Height of the ground, m; `None` for none.
    ground: Option<f64>,
}

/// Steps of a case.
const STEPS: usize = 250;

/// Dry friction of a joint where that is switched on, N m.
const DRY_FRICTION: f64 = 0.1;

fn cases() -> Vec<Case> {
    let quadruped = common::robot();
    let stance = Stance::find(&quadruped, &Scene::default());
    let of_quadruped = |name, sway, ground| Case {
        name,
        model: quadruped.clone(),
        gains: stance.gains.clone(),
        start: stance.state.clone(),
        targets: common::sway(&stance.angles, sway, Accuracy::default().step, STEPS),
        ground,
    };
    vec![
        of_quadruped("quadruped, standing", 0.0, Some(0.0)),
        of_quadruped("quadruped, swaying", 0.3, Some(0.0)),
        of_quadruped("quadruped, flying", 0.3, None),
        chain(),
    ]
}

/// A chain of 60 links that lies on five balls.
fn chain() -> Case {
    let mut model = Model::clone(&common::chain(60, Some(15), false));
    model.limits.fill(Some([-1.0, 1.0]));
    let joints = model.joint_count();
    let mut start = State::new(&model);
    start.root.position.z = 0.05;
    Case {
        name: "chain of 60 links",
        gains: Gains {
            stiffness: vec![100.0; joints],
            damping: vec![5.0; joints],
            max_torque: vec![Some(100.0); joints],
            ..Gains::default()
        },
        targets: vec![start.angles.clone(); STEPS + 1],
        start,
        model: Arc::new(model),
        ground: Some(0.0),
    }
}

/// A step of the case that differs from the default one in a single effect.
struct Variant {
    name: String,
    simulator: Simulator,
    /// The least time of each step, ns.
    times: Vec<f64>,
    counts: Counts,
}

/// Work of all steps together.
#[derive(Clone, Copy, Default)]
struct Counts {
    evaluations: u64,
    problems: u64,
    rows: u64,
    iterations: u64,
}

impl Variant {
    /// The default plan with `change`; `None` where that cannot be simulated.
    fn new(
        case: &Case,
        name: String,
        change: impl FnOnce(&mut Model, &mut Scene, &mut Gains),
    ) -> Option<Self> {
        let (mut model, mut gains) = (Model::clone(&case.model), case.gains.clone());
        let ground = case.ground.map(|height| Ground::Plane { height });
        let mut scene = Scene { ground, ..Scene::default() };
        change(&mut model, &mut scene, &mut gains);
        let plan = StepPlan::compile(&scene, &Accuracy::default(), Some(&gains), &Arc::new(model)).ok()?;
        let simulator = Simulator::new(Arc::new(plan), case.start.clone());
        Some(Self { name, simulator, times: vec![f64::INFINITY; STEPS], counts: Counts::default() })
    }

    /// Takes step number `index` from `state` and keeps its time if it is the least so far; `counted` adds its work.
    ///
    /// The step is taken twice, and the second time counts: what a simulator remembers of the step before, from which
    /// it guesses velocities and forces, is then that of the same effects.
    fn step(&mut self, state: &State, index: usize, targets: &[Vec<f64>], counted: bool) {
        let command = Command::Track { now: &targets[index], next: &targets[index + 1] };
        self.simulator.set_state(state);
        self.simulator.step(command).expect("a step");
        let mut again = self.simulator.state().clone();
        (again.time, again.root) = (state.time, state.root);
        again.angles.clone_from(&state.angles);
        again.velocities.clone_from(&state.velocities);
        self.simulator.set_state(&again);
        let before = self.so_far();
        let begun = Instant::now();
        self.simulator.step(command).expect("a step");
        let time = begun.elapsed().as_secs_f64() * 1e9;
        self.times[index] = self.times[index].min(time);
        if counted {
            let after = self.so_far();
            self.counts.evaluations += after.evaluations - before.evaluations;
            self.counts.problems += after.problems - before.problems;
            self.counts.rows += after.rows - before.rows;
            self.counts.iterations += after.iterations - before.iterations;
        }
    }

    fn so_far(&self) -> Counts {
        let solved = self.simulator.solver_work();
        Counts {
            evaluations: self.simulator.evaluations(),
            problems: solved.problems,
            rows: solved.rows,
            iterations: solved.iterations,
        }
    }

    /// Mean time of a step, ns.
    fn nanoseconds(&self) -> f64 {
        self.times.iter().sum::<f64>() / STEPS as f64
    }
}

/// The default plan, and what differs from it in one effect.
fn variants(case: &Case) -> Vec<Variant> {
    let mut variants: Vec<Variant> = Vec::new();
    variants.extend(Variant::new(case, "as it is by default".to_owned(), |_, _, _| {}));
    let decisions = variants[0].simulator.plan().decisions.clone();
    let switched = |effect: Effect, switch, word: &str| {
        Variant::new(case, format!("{} {word}", effect.name()), |_, scene: &mut Scene, _| {
            scene.effects.insert(effect, switch);
        })
    };
    for effect in Effect::ALL.into_iter().filter(|effect| decisions[effect].on) {
        variants.extend(switched(effect, Switch::Off, "off"));
    }
    if !decisions[&Effect::JointFriction].on {
        variants.extend(Variant::new(case, "joint_friction on".to_owned(), |model, _, _| {
            model.friction.fill(DRY_FRICTION);
        }));
    }
    for (feedforward, word) in
        [(Feedforward::ContactFree, "contact-free"), (Feedforward::ContactAware, "contact-aware")]
    {
        variants.extend(Variant::new(case, format!("{word} feedforward"), |_, _, gains| {
            gains.feedforward = feedforward;
        }));
    }
    variants.extend(switched(Effect::TrunkRotationLock, Switch::On, "on"));
    variants.extend(Variant::new(case, "everything off".to_owned(), |_, scene, _| {
        scene.effects = Effect::ALL.into_iter().map(|effect| (effect, Switch::Off)).collect();
    }));
    variants
}

fn main() {
    let rounds = if common::measuring() { 20 } else { 1 };
    for case in cases() {
        let mut variants = variants(&case);
        // The course of the default plan, from whose states all of them take their steps.
        let mut course = vec![case.start.clone()];
        let mut simulator = variants[0].simulator.clone();
        for pair in case.targets.windows(2) {
            simulator.step(Command::Track { now: &pair[0], next: &pair[1] }).expect("a step");
            course.push(simulator.state().clone());
        }
        // In turns, so that what disturbs the machine disturbs all of them.
        for round in 0..rounds {
            for variant in &mut variants {
                for (index, state) in course.iter().take(STEPS).enumerate() {
                    variant.step(state, index, &case.targets, round == 0);
                }
            }
        }
        println!(
            "\n| {} | µs a step | of the default | evaluations | problems | rows | iterations |",
            case.name
        );
        println!("|---|---|---|---|---|---|---|");
        let whole = variants[0].nanoseconds();
        for variant in &variants {
            let (time, counts) = (variant.nanoseconds(), variant.counts);
            let each = |count: u64| count as f64 / STEPS as f64;
            println!(
                "| {} | {:.1} | {:.2} | {:.2} | {:.2} | {:.1} | {:.1} |",
                variant.name,
                time / 1e3,
                time / whole,
                each(counts.evaluations),
                each(counts.problems),
                each(counts.rows),
                each(counts.iterations),
            );
        }
    }
}
