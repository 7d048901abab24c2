//! A subset of states as an environment for Q-learning, its transitions simulated once.

use std::sync::Arc;

use super::behaviour::Posture;
use super::cache::{Additions, Cache, SimulationTotals, TrackedTransition, TransitionKey};
use super::evaluation::World;
use super::genome::Genome;
use super::grid::{Grid, GridState};
use super::objective::Objective;
use super::parameters::Parameters;
use super::policy::ActionPath;
use super::qlearning::{ActionOutcome, Environment, QTable};
use super::ratio::Edge;
use super::repairs::Repair;
use super::stop::{Interrupted, Stop};
use super::transition::Transition;

/// Number of actions between two checks whether to stop. An action whose transition is known takes a microsecond, but
/// a job may ask for 10¹⁰ of them.
const ACTIONS_BETWEEN_CHECKS: u64 = 1024;

/// What is the same for every individual of a search.
#[derive(Debug, Clone, Copy)]
pub struct SearchContext<'a> {
    /// The division of the joints.
    pub grid: &'a Grid,
    /// How motion is scored.
    pub objective: &'a Objective,
    /// The learner's parameters.
    pub parameters: &'a Parameters,
    /// When to break off.
    pub stop: &'a Stop,
}

/// A state of a subset as actions lead to it.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedPosture {
    /// Angles and velocities.
    pub posture: Posture,
    /// Beats that it takes to get there.
    pub beats: u8,
}

/// The environment of a genome: situations are its states with the trunk's cell, actions are transitions to its states.
///
/// With n states and c cells, situation `state * c + cell` is being in that state and cell, and situation `n * c` is the
/// standing pose, in which every episode starts; action `a` goes to state `a`.
///
/// A subset that is closed under symmetry is folded: its n states are one of each pair of mirror images, with what becomes
/// of the genome's states by the shift of limbs, and actions n to 2n − 1 go to their mirror images. Having gone to a mirror
/// image, the whole world is taken for its own, so that the situation is again one of the n; what follows then happens in
/// the mirror. So half of a cycle is learned, and the mirrored half follows from it.
///
/// A transition is simulated when it is asked for the first time, from the physical state that the character is in then.
/// After that its reward and the physical state after it are taken from memory, unless there is no cache.
pub struct Subset<'a, W: World> {
    context: SearchContext<'a>,
    world: &'a mut W,
    shared: &'a Cache<W::State>,
    /// The n states.
    states: Vec<GridState>,
    /// Indices of those that each state of the genome becomes.
    images: Vec<Vec<usize>>,
    /// Where each action leads to: the n states, then their mirror images where it is folded.
    targets: Vec<(GridState, TimedPosture)>,
    standing: Posture,
    /// Whether the transition from a state (the standing pose last) to a target keeps to every joint's range and speed:
    /// (n + 1) × actions, row by row.
    permitted: Vec<bool>,
    /// Transitions tried here: situations × actions, row by row.
    known: Vec<Option<Arc<TrackedTransition<W::State>>>>,
    /// Transitions simulated here.
    additions: Additions<W::State>,
    totals: SimulationTotals,
    /// The present situation.
    situation: usize,
    /// The transition that led to the present physical state; `None` when standing.
    last: Option<Arc<TrackedTransition<W::State>>>,
}

impl<'a, W: World> Subset<'a, W> {
    /// The environment of `genome`; transitions in `shared` are not simulated again.
    pub fn new(
        context: SearchContext<'a>,
        world: &'a mut W,
        shared: &'a Cache<W::State>,
        genome: &Genome,
    ) -> Self {
        let grid = context.grid;
        let (states, images) = closed(grid, genome);
        let mirrored = grid.symmetry.iter().flat_map(|symmetry| {
            states.iter().map(|state| symmetry.mirrored(&grid.joints, state)).collect::<Vec<_>>()
        });
        let keyframe = |state: &GridState| TimedPosture { posture: grid.posture(state), beats: state.beats };
        let targets = states.iter().cloned().chain(mirrored);
        let targets: Vec<_> = targets.map(|state| (state.clone(), keyframe(&state))).collect();
        let standing = grid.standing();
        let beat = context.parameters.beat();
        let starts = targets[..states.len()].iter().map(|(_, from)| &from.posture).chain([&standing]);
        let permitted = starts.flat_map(|from| {
            targets.iter().map(move |(_, to)| {
                let duration = beat * f64::from(to.beats);
                Transition { from, to: &to.posture, duration }.stays_within(grid)
            })
        });
        let permitted = permitted.collect();
        let start = states.len() * world.cells();
        let known = vec![None; (start + 1) * targets.len()];
        Self {
            context,
            world,
            shared,
            states,
            images,
            targets,
            standing,
            permitted,
            known,
            additions: Vec::new(),
            totals: SimulationTotals::default(),
            situation: start,
            last: None,
        }
    }

    /// Index of the state of a situation; the number of states for the standing pose.
    fn state(&self, situation: usize) -> usize {
        situation / self.world.cells()
    }

    /// The standing pose as a situation.
    pub fn start_situation(&self) -> usize {
        self.states.len() * self.world.cells()
    }

    /// Whether an action goes to the mirror image of a state.
    fn flips(&self, action: usize) -> bool {
        action >= self.states.len()
    }

    /// The same action in the mirror.
    fn mirrored(&self, action: usize) -> usize {
        (action + self.states.len()) % self.targets.len()
    }

    /// Every transition known here that does not end in a fall, in both halves where the subset is folded: situation `s`
    /// of the second half is `situations() + s`.
    pub fn edges(&self) -> Vec<Edge> {
        let mut edges = Vec::new();
        let (actions, situations) = (self.targets.len(), self.situations());
        for (slot, tracked) in self.known.iter().enumerate() {
            let Some((tracked, (_, cell))) =
                tracked.as_ref().and_then(|tracked| Some((tracked, tracked.after.as_ref()?)))
            else {
                continue;
            };
            let (from, action) = (slot / actions, slot % actions);
            let to = self.arrival(action, *cell);
            let earned = self.context.objective.earnings(&tracked.terms, tracked.seconds);
            let flips = usize::from(self.flips(action));
            // The standing pose is its own mirror image.
            let halves = if self.folded() && from != self.start_situation() { 2 } else { 1 };
            for half in 0..halves {
                let (earned, action) =
                    if half == 0 { (earned, action) } else { (earned.mirrored(), self.mirrored(action)) };
                let (reward, signed) = if self.context.parameters.repairs.has(Repair::WholeCycle) {
                    (earned.plain, earned.signed)
                } else {
                    (earned.total(), [0.0; 3])
                };
                let (from, to) = (from + half * situations, to + (half ^ flips) * situations);
                edges.push(Edge { from, to, action, reward, signed, time: tracked.seconds });
            }
        }
        edges
    }

    /// Number of situations that [`Subset::edges`] connect.
    pub fn unfolded_situations(&self) -> usize {
        if self.folded() { 2 * self.situations() } else { self.situations() }
    }

    fn folded(&self) -> bool {
        self.targets.len() > self.states.len()
    }

    /// A path through the folded subset as the character goes it: a cycle that ends in the mirror image of its beginning is
    /// only half of one.
    pub fn unfolded(&self, path: &ActionPath) -> ActionPath {
        let mut half = false;
        let mut go = |action: &usize| {
            let gone = if half { self.mirrored(*action) } else { *action };
            half ^= self.flips(*action);
            gone
        };
        let entry: Vec<usize> = path.entry.iter().map(&mut go).collect();
        let mut cycle: Vec<usize> = path.cycle.iter().map(&mut go).collect();
        let flips = path.cycle.iter().filter(|action| self.flips(**action)).count();
        if flips % 2 == 1 {
            cycle.extend(path.cycle.iter().map(&mut go));
        }
        ActionPath { entry, cycle }
    }

    /// Where each action leads to, mirror images included.
    pub fn keyframes(&self) -> Vec<TimedPosture> {
        self.targets.iter().map(|(_, keyframe)| keyframe.clone()).collect()
    }

    /// What each state of the genome is worth in the coding in which it is an individual (Ito & Matsuno 2002): the value of
    /// going there, from 0 to 1 between the least and the greatest of each situation's actions and averaged over the
    /// situations, plus how often `path` goes there in its cycle, from 0 to 1 for the state it goes to most often. That of
    /// a state which symmetry multiplies is the greatest of its images.
    pub fn worths(&self, table: &QTable, path: &ActionPath) -> Vec<f64> {
        let (actions, count) = (self.targets.len(), self.states.len());
        let (mut values, mut uses, mut rows) = (vec![0.0; count], vec![0.0; count], 0.0_f64);
        for situation in 0..self.situations() {
            let row = || (0..actions).filter(|&action| self.permits(situation, action));
            let value = |action: usize| table.value(situation, action);
            let least = row().map(value).fold(f64::INFINITY, f64::min);
            let greatest = row().map(value).fold(f64::NEG_INFINITY, f64::max);
            if greatest > least {
                rows += 1.0;
                let mut best = vec![0.0; count];
                for action in row() {
                    let share = (value(action) - least) / (greatest - least);
                    let best: &mut f64 = &mut best[action % count];
                    *best = best.max(share);
                }
                values.iter_mut().zip(best).for_each(|(value, best)| *value += best);
            }
        }
        for action in &path.cycle {
            uses[action % count] += 1.0;
        }
        let most = uses.iter().copied().fold(1.0, f64::max);
        let worth = |state: &usize| values[*state] / rows.max(1.0) + uses[*state] / most;
        self.images.iter().map(|images| images.iter().map(worth).fold(0.0, f64::max)).collect()
    }

    /// The transitions that were simulated here, and how much that was.
    pub fn into_parts(self) -> (Additions<W::State>, SimulationTotals) {
        (self.additions, self.totals)
    }

    /// The situation after `action`, with the trunk in `cell`.
    fn arrival(&self, action: usize, cell: usize) -> usize {
        action % self.states.len() * self.world.cells() + cell
    }

    /// The task's reward, less the cost of a fall.
    fn reward(&self, tracked: &TrackedTransition<W::State>) -> f64 {
        let SearchContext { objective, parameters, .. } = self.context;
        let earned = objective.earnings(&tracked.terms, tracked.seconds);
        let earned =
            if parameters.repairs.has(Repair::WholeCycle) { earned.without_sway() } else { earned.total() };
        if tracked.after.is_some() { earned } else { earned - objective.fall_cost() }
    }

    /// The transition from the present situation, taken from the shared cache or simulated.
    fn look_up(&mut self, action: usize) -> Result<Arc<TrackedTransition<W::State>>, Interrupted> {
        let state = self.state(self.situation);
        let key = TransitionKey {
            from: self.states.get(state).map(|state| state.levels.clone()),
            to: self.targets[action].0.clone(),
            cell: self.situation % self.world.cells(),
            mirrored: self.flips(action),
        };
        if let Some(tracked) = self.shared.get(&key) {
            self.totals.saved += tracked.seconds;
            return Ok(tracked.clone());
        }
        self.context.stop.check()?;
        let tracked = Arc::new(self.simulate(state, action)?);
        self.totals.simulated += 1;
        self.totals.seconds += tracked.seconds;
        if self.context.parameters.cache_transitions > 0 {
            self.additions.push((key, tracked.clone()));
        }
        Ok(tracked)
    }

    /// Simulates the transition from the present physical state, which is in `state`.
    fn simulate(&mut self, state: usize, action: usize) -> Result<TrackedTransition<W::State>, Interrupted> {
        let parameters = self.context.parameters;
        let (_, to) = &self.targets[action];
        let transition = Transition {
            from: self.targets[..self.states.len()]
                .get(state)
                .map_or(&self.standing, |(_, from)| &from.posture),
            to: &to.posture,
            duration: parameters.beat() * f64::from(to.beats),
        };
        let targets = |t: f64, angles: &mut [f64]| transition.targets(t, angles);
        let steps = 0..parameters.beat_steps() * u64::from(to.beats);
        let before = self.last.as_ref().and_then(|tracked| tracked.after.as_ref());
        let outcome = match before {
            Some((before, _)) => self.world.track(before, &targets, steps, self.context.stop)?,
            None => {
                let standing = self.world.standing().clone();
                self.world.track(&standing, &targets, steps, self.context.stop)?
            }
        };
        let after = outcome.after.map(|after| {
            let after = if self.flips(action) { self.world.mirrored(&after) } else { after };
            let cell = self.world.cell(&after);
            (after, cell)
        });
        let terms = if parameters.repairs.has(Repair::HeadingFrame) {
            outcome.terms.seen_from(outcome.heading)
        } else {
            outcome.terms
        };
        Ok(TrackedTransition { terms, seconds: outcome.seconds, after })
    }
}

/// The states of a genome's subset, one of each pair of mirror images (the lesser one, whichever was drawn) where there is
/// symmetry, and those that each state of the genome becomes.
fn closed(grid: &Grid, genome: &Genome) -> (Vec<GridState>, Vec<Vec<usize>>) {
    let Some(symmetry) = &grid.symmetry else {
        return (genome.states.clone(), (0..genome.states.len()).map(|index| vec![index]).collect());
    };
    let mut states: Vec<GridState> = Vec::new();
    let mut place = |state: GridState| {
        let mirrored = symmetry.mirrored(&grid.joints, &state);
        let state = state.min(mirrored);
        states.iter().position(|known| *known == state).unwrap_or_else(|| {
            states.push(state);
            states.len() - 1
        })
    };
    let images = genome
        .states
        .iter()
        .map(|state| symmetry.shifted(&grid.joints, state).into_iter().map(&mut place).collect());
    let images = images.collect();
    (states, images)
}

impl<W: World> Environment for Subset<'_, W> {
    type Break = Interrupted;

    fn situations(&self) -> usize {
        self.start_situation() + 1
    }

    fn actions(&self) -> usize {
        self.targets.len()
    }

    fn start(&mut self) -> usize {
        self.last = None;
        self.situation = self.start_situation();
        self.situation
    }

    fn permits(&self, situation: usize, action: usize) -> bool {
        self.permitted[self.state(situation) * self.targets.len() + action]
    }

    fn act(&mut self, action: usize) -> Result<ActionOutcome, Interrupted> {
        self.totals.asked += 1;
        if self.totals.asked.is_multiple_of(ACTIONS_BETWEEN_CHECKS) {
            self.context.stop.check()?;
        }
        let slot = self.situation * self.targets.len() + action;
        let tracked = match &self.known[slot] {
            Some(tracked) if self.context.parameters.cache_transitions > 0 => {
                self.totals.saved += tracked.seconds;
                tracked.clone()
            }
            _ => self.look_up(action)?,
        };
        self.known[slot] = Some(tracked.clone());
        let reward = self.reward(&tracked);
        let next = tracked.after.as_ref().map(|(_, cell)| self.arrival(action, *cell));
        if let Some(next) = next {
            self.situation = next;
        }
        let duration = tracked.seconds / self.context.parameters.transition_time;
        self.last = Some(tracked);
        Ok(ActionOutcome { reward, next, duration })
    }
}
