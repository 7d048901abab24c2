//! What the reward decides: a choice among the states of a gait, paid by speed alone or by the natural cost.

use std::sync::Arc;

use gaitwright_learning::learn::cache::{Cache, TrackedTransition, TransitionKey};
use gaitwright_learning::learn::evaluation::{SimulatedWorld, World};
use gaitwright_learning::learn::genome::Genome;
use gaitwright_learning::learn::grid::{Grid, GridState, JointGrid};
use gaitwright_learning::learn::policy::greedy_path;
use gaitwright_learning::learn::qlearning::{QTable, Rates, learn};
use gaitwright_learning::learn::ratio::best_path;
use gaitwright_learning::learn::subset::{SearchContext, Subset};
use gaitwright_learning::learn::transition::Transition;
use gaitwright_learning::learn::trial::{Bar, judge, run_check};
use gaitwright_learning::learn::{
    Behaviour, Learning, Objective, Parameters, Posture, Repair, Repairs, Stop, Task,
};
use gaitwright_learning::program::refine::{PAIRED, Refinement};
use gaitwright_learning::program::ring::Ring;
use gaitwright_learning::program::rollout::STRIDES;
use gaitwright_learning::program::starts::Starts;
use gaitwright_learning::program::subject::Subject;
use gaitwright_physics::motion::Player;
use gaitwright_physics::scene::StepPlan;
use gaitwright_physics::sim::{Command, Simulator, State};
use gaitwright_physics::stance::Stance;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::plain_task;
use crate::program::{GRAVITY, subject, trot};

/// Strides after the entry until a gait has settled.
const SETTLED: usize = 8;

/// A gait that walks, and its keyframes as states.
struct Gait {
    subject: Subject,
    /// How it stands, with the gait's gains; its state is one in the middle of the gait, at the first keyframe.
    stance: Stance,
    parameters: Parameters,
    grid: Grid,
    genome: Genome,
}

impl Gait {
    fn new(subject: Subject, ring: Ring, stance: Stance) -> Self {
        let step = subject.accuracy.step;
        let repairs = Repairs::default()
            .without(Repair::TransitionTimes)
            .without(Repair::Symmetry)
            .without(Repair::BoundedStart);
        let learning = Learning {
            transition_time: Some(ring.transition_time()),
            repairs,
            episodes: 200,
            episode_length: 48,
            ..Learning::default()
        };
        let parameters = learning.resolve(&stance, GRAVITY, step).unwrap();
        let state = settled(&subject, &ring, &stance, &parameters);
        let stance = Stance { state, ..stance };
        let (grid, genome) = states(&subject, &ring.cycle, parameters.transition_time);
        Self { subject, stance, parameters, grid, genome }
    }

    fn world(&self) -> SimulatedWorld {
        let Subject { model, scene, accuracy, direction, .. } = &self.subject;
        SimulatedWorld::new(model, &self.stance, (scene, accuracy, *direction), None, &self.parameters)
            .unwrap()
    }

    /// What is known of it: the transitions from each of its states to the next.
    fn known(&self) -> Cache<State> {
        let mut world = self.world();
        let mut cache = Cache::new(100);
        let mut state = world.standing().clone();
        let states = &self.genome.states;
        for from in 0..states.len() {
            let to = (from + 1) % states.len();
            let [a, b] = [from, to].map(|index| self.grid.posture(&states[index]));
            let transition = Transition { from: &a, to: &b, duration: self.parameters.beat() };
            let targets = |t: f64, angles: &mut [f64]| transition.targets(t, angles);
            let steps = 0..self.parameters.beat_steps();
            let outcome = world.track(&state, &targets, steps, &Stop::default()).unwrap();
            state = outcome.after.clone().expect("the gait stays up");
            let key = TransitionKey {
                from: Some(states[from].levels.clone()),
                to: states[to].clone(),
                cell: 0,
                mirrored: false,
            };
            let terms = outcome.terms.seen_from(outcome.heading);
            let tracked =
                TrackedTransition { terms, seconds: outcome.seconds, after: Some((state.clone(), 0)) };
            cache.merge(vec![(key, Arc::new(tracked))]);
        }
        cache
    }

    /// Gives an objective for `task` to `evaluate`, with what else an evaluation of these states needs.
    fn paid<T>(&self, task: &Task, evaluate: impl FnOnce(SearchContext<'_>, &mut SimulatedWorld) -> T) -> T {
        let objective = Objective::new(task, &self.subject.model, &self.stance, GRAVITY).unwrap();
        let Self { grid, parameters, .. } = self;
        let stop = Stop::default();
        evaluate(SearchContext { grid, objective: &objective, parameters, stop: &stop }, &mut self.world())
    }

    /// The states that Q-learning comes to visit over and over, and those of the best cycle among the transitions it has tried.
    fn learned(&self, task: &Task, cache: &Cache<State>, seed: u64) -> [Vec<usize>; 2] {
        self.paid(task, |context, world| {
            let mut subset = Subset::new(context, world, cache, &self.genome);
            let mut table = QTable::new(&subset);
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            learn(&mut subset, &mut table, &Rates::from(&self.parameters), &mut rng).unwrap();
            let greedy = greedy_path(&mut subset, &table).unwrap();
            let best = best_path(subset.unfolded_situations(), &subset.edges(), subset.start_situation());
            [greedy.cycle, best.unwrap().cycle]
        })
    }

    /// The states of the behaviour that an evaluation of all of them ends with, in their order.
    fn chosen(&self, task: &Task, cache: &Cache<State>, seed: u64) -> Vec<usize> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let verdict = self.paid(task, |context, world| {
            judge(context, world, cache, &self.genome, (0, None), &mut rng).unwrap()
        });
        let behaviour = verdict.accepted.expect("it stays up").behaviour;
        let states = self.keyframes();
        let state = |posture| states.iter().position(|state| state == posture).expect("one of them");
        behaviour.cycle.iter().map(state).collect()
    }

    /// The fitness of a cycle of all states but `left_out` in one continuous simulation.
    fn played_without(&self, task: &Task, left_out: Option<usize>) -> f64 {
        let mut cycle = self.keyframes();
        if let Some(state) = left_out {
            cycle.remove(state);
        }
        let behaviour = Behaviour {
            fitness: 0.0,
            generation: 0,
            transition_time: self.parameters.beat(),
            entry: Vec::new(),
            cycle,
            steering: None,
        };
        self.paid(task, |context, world| run_check(context, world, &behaviour, Bar::None).unwrap().fitness)
    }

    fn keyframes(&self) -> Vec<Posture> {
        self.genome.states.iter().map(|state| self.grid.posture(state)).collect()
    }
}

/// A state of the simulation in the middle of a gait, at its first keyframe.
fn settled(subject: &Subject, ring: &Ring, stance: &Stance, parameters: &Parameters) -> State {
    let plan =
        StepPlan::compile(&subject.scene, &subject.accuracy, Some(&stance.gains), &subject.model).unwrap();
    let mut simulator = Simulator::new(Arc::new(plan), stance.state.clone());
    let [entry, cycle] = [&ring.entry, &ring.cycle].map(|postures| postures.iter().map(Posture::parts));
    let player = Player::from_postures(&stance.angles, entry, cycle, parameters.transition_time);
    let keyframes = ring.entry.len() + SETTLED * ring.cycle.len() + 1;
    let mut now = vec![0.0; subject.model.joint_count()];
    let mut next = now.clone();
    for step in 0..keyframes as u64 * parameters.beat_steps() {
        player.targets(step as f64 * subject.accuracy.step, &mut now);
        player.targets((step + 1) as f64 * subject.accuracy.step, &mut next);
        simulator.step(Command::Track { now: &now, next: &next }).unwrap();
    }
    simulator.state().clone()
}

/// Keyframes as states, on a grid that is fine enough for them and takes the first one for the standing pose.
fn states(subject: &Subject, keyframes: &[Posture], duration: f64) -> (Grid, Genome) {
    let joint = |joint: usize| {
        let first = keyframes[0].angles[joint];
        let greatest =
            |of: &dyn Fn(&Posture) -> f64| keyframes.iter().map(|k| of(k).abs()).fold(0.01, f64::max);
        let reach = greatest(&|keyframe| keyframe.angles[joint] - first);
        let speed = greatest(&|keyframe| keyframe.velocities[joint]);
        JointGrid::new(first, subject.model.limits[joint], speed, reach, (101, 101), duration)
    };
    let joints: Vec<JointGrid> = (0..subject.model.joint_count()).map(joint).collect();
    let level = |(grid, (angle, velocity)): (&JointGrid, (&f64, &f64))| {
        let angle = (angle - grid.standing) / grid.angle_step;
        let velocity = velocity / grid.velocity_step;
        grid.clamp(angle.round() as i16, velocity.round() as i16)
    };
    let state = |keyframe: &Posture| {
        let places = keyframe.angles.iter().zip(&keyframe.velocities);
        GridState { levels: joints.iter().zip(places).map(level).collect(), beats: 1 }
    };
    let states = keyframes.iter().map(state).collect();
    (Grid { joints, limbs: Vec::new(), beats: 1, symmetry: None }, Genome { states })
}

/// A trot, refined for so many generations, as a choice among its keyframes.
fn learned_trot(generations: u32) -> Gait {
    let subject = subject("quadruped.urdf", [1.0, 0.0, 0.0]);
    let wanted = trot(&subject.legs);
    let (arena, stop) = (subject.arena().unwrap(), Stop::default());
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    let seeds = subject.seeds(&wanted.gait);
    let starts = Starts::new((&pool, &stop), &subject, &arena, &wanted, &seeds, STRIDES).unwrap();
    let mut refinement = Refinement::new(&subject, &wanted, (&starts, 0), (STRIDES, PAIRED, 1));
    for _ in 0..generations {
        refinement.generation((&pool, &stop), &subject, &arena, &wanted).unwrap();
    }
    let best = refinement.best().clone();
    let stance = Stance { gains: best.gains, ..(*subject.stance).clone() };
    Gait::new(subject, best.ring, stance)
}

#[test]
fn a_ring_of_eight_is_worth_more_by_natural_cost_than_any_seven_of_its_states() {
    let gait = learned_trot(40);
    for task in [Task::default(), asked()] {
        let whole = gait.played_without(&task, None);
        for state in 0..8 {
            let cut = gait.played_without(&task, Some(state));
            assert!(cut < whole, "without state {state}: {cut} and {whole}");
        }
    }
}

#[test]
fn speed_alone_cuts_a_ring_of_eight_short_and_the_natural_cost_keeps_it() {
    let gait = learned_trot(20);
    let cache = gait.known();
    // Each state is followed by the next one, all round.
    let whole = |cycle: &[usize]| {
        let next = |place: usize| cycle[(place + 1) % cycle.len()];
        cycle.len() == 8 && (0..8).all(|place| next(place) == (cycle[place] + 1) % 8)
    };
    for seed in 10..15 {
        let [greedy, best] = gait.learned(&plain_task(), &cache, seed);
        assert!(greedy.len() < 8 && best.len() < 8, "by speed, seed {seed}: {greedy:?} and {best:?}");
        for task in [Task::default(), asked()] {
            let [greedy, _] = gait.learned(&task, &cache, seed);
            assert!(whole(&greedy), "by natural cost, seed {seed}: {greedy:?}");
            // The best cycle among transitions that were simulated apart from each other may leave out a state; in one simulation
            // the whole ring then does better, and an evaluation ends with that.
            let chosen = gait.chosen(&task, &cache, seed);
            assert!(whole(&chosen), "an evaluation by natural cost, seed {seed}: {chosen:?}");
        }
    }
}

/// A trot at a speed, paid by the natural cost.
fn asked() -> Task {
    Task { froude: Some(0.4), ..Task::default() }
}
