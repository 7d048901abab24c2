//! A subset of states as an environment for Q-learning, its transitions simulated once.

use std::sync::Arc;

use super::behaviour::Posture;
use super::cache::{Additions, Cache, SimulationTotals, TrackedTransition, TransitionKey};
use super::evaluation::World;
use super::genome::Genome;
use super::grid::Grid;
use super::objective::Objective;
use super::parameters::Parameters;
use super::policy::Edge;
use super::qlearning::{ActionOutcome, Environment};
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

/// The environment of a genome: situations are its states with the trunk's cell, actions are transitions to its states.
///
/// With n states and c cells, situation `state * c + cell` is being in that state and cell, and situation `n * c` is the
/// standing pose, in which every episode starts; action `a` goes to state `a`.
///
/// A transition is simulated when it is asked for the first time, from the physical state that the character is in then.
/// After that its reward and the physical state after it are taken from memory.
pub struct Subset<'a, W: World> {
    context: SearchContext<'a>,
    world: &'a mut W,
    shared: &'a Cache<W::State>,
    genome: &'a Genome,
    /// Angles and velocities of the n states.
    postures: Vec<Posture>,
    standing: Posture,
    /// Whether the transition from a state (the standing pose last) to a state keeps to every joint's range and speed:
    /// (n + 1) × n, row by row.
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
        genome: &'a Genome,
    ) -> Self {
        let postures: Vec<Posture> = genome.states.iter().map(|state| context.grid.posture(state)).collect();
        let standing = context.grid.standing();
        let duration = context.parameters.transition_time;
        let permitted = postures.iter().chain([&standing]).flat_map(|from| {
            postures.iter().map(move |to| Transition { from, to, duration }.stays_within(context.grid))
        });
        let permitted = permitted.collect();
        let start = postures.len() * world.cells();
        let known = vec![None; (start + 1) * postures.len()];
        Self {
            context,
            world,
            shared,
            genome,
            postures,
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
        self.postures.len() * self.world.cells()
    }

    /// Every transition known here that does not end in a fall.
    pub fn edges(&self) -> Vec<Edge> {
        let actions = self.postures.len();
        let known = self.known.iter().enumerate();
        let edges = known.filter_map(|(slot, tracked)| {
            let tracked = tracked.as_ref()?;
            let (_, cell) = tracked.after.as_ref()?;
            let (from, action) = (slot / actions, slot % actions);
            Some(Edge { from, to: self.arrival(action, *cell), action, reward: self.reward(tracked) })
        });
        edges.collect()
    }

    /// The postures of the states.
    pub fn postures(&self) -> &[Posture] {
        &self.postures
    }

    /// The transitions that were simulated here, and how much that was.
    pub fn into_parts(self) -> (Additions<W::State>, SimulationTotals) {
        (self.additions, self.totals)
    }

    /// The situation after `action`, with the trunk in `cell`.
    fn arrival(&self, action: usize, cell: usize) -> usize {
        action * self.world.cells() + cell
    }

    /// The task's reward, less the cost of a fall.
    fn reward(&self, tracked: &TrackedTransition<W::State>) -> f64 {
        let earned = self.context.objective.reward(&tracked.terms, tracked.seconds);
        if tracked.after.is_some() { earned } else { earned - self.context.objective.fall_cost() }
    }

    /// The transition from the present situation, taken from the shared cache or simulated.
    fn look_up(&mut self, action: usize) -> Result<Arc<TrackedTransition<W::State>>, Interrupted> {
        let state = self.state(self.situation);
        let key = TransitionKey {
            from: self.genome.states.get(state).cloned(),
            to: self.genome.states[action].clone(),
            cell: self.situation % self.world.cells(),
        };
        if let Some(tracked) = self.shared.get(&key) {
            return Ok(tracked.clone());
        }
        self.context.stop.check()?;
        let tracked = Arc::new(self.simulate(state, action)?);
        self.totals.simulated += 1;
        self.totals.seconds += tracked.seconds;
        self.additions.push((key, tracked.clone()));
        Ok(tracked)
    }

    /// Simulates the transition from the present physical state, which is in `state`.
    fn simulate(&mut self, state: usize, action: usize) -> Result<TrackedTransition<W::State>, Interrupted> {
        let transition = Transition {
            from: self.postures.get(state).unwrap_or(&self.standing),
            to: &self.postures[action],
            duration: self.context.parameters.transition_time,
        };
        let targets = |t: f64, angles: &mut [f64]| transition.targets(t, angles);
        let steps = 0..self.context.parameters.transition_steps;
        let before = self.last.as_ref().and_then(|tracked| tracked.after.as_ref());
        let outcome = match before {
            Some((before, _)) => self.world.track(before, &targets, steps, self.context.stop)?,
            None => {
                let standing = self.world.standing().clone();
                self.world.track(&standing, &targets, steps, self.context.stop)?
            }
        };
        let after = outcome.after.map(|after| {
            let cell = self.world.cell(&after);
            (after, cell)
        });
        Ok(TrackedTransition { terms: outcome.terms, seconds: outcome.seconds, after })
    }
}

impl<W: World> Environment for Subset<'_, W> {
    type Break = Interrupted;

    fn situations(&self) -> usize {
        self.start_situation() + 1
    }

    fn actions(&self) -> usize {
        self.postures.len()
    }

    fn start(&mut self) -> usize {
        self.last = None;
        self.situation = self.start_situation();
        self.situation
    }

    fn permits(&self, situation: usize, action: usize) -> bool {
        self.permitted[self.state(situation) * self.postures.len() + action]
    }

    fn act(&mut self, action: usize) -> Result<ActionOutcome, Interrupted> {
        self.totals.asked += 1;
        if self.totals.asked.is_multiple_of(ACTIONS_BETWEEN_CHECKS) {
            self.context.stop.check()?;
        }
        let slot = self.situation * self.postures.len() + action;
        let tracked = match &self.known[slot] {
            Some(tracked) => tracked.clone(),
            None => self.look_up(action)?,
        };
        self.known[slot] = Some(tracked.clone());
        let reward = self.reward(&tracked);
        let next = tracked.after.as_ref().map(|(_, cell)| self.arrival(action, *cell));
        if let Some(next) = next {
            self.situation = next;
        }
        self.last = Some(tracked);
        Ok(ActionOutcome { reward, next })
    }
}
