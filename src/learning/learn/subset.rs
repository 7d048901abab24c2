//! A subset of states as an environment for Q-learning, its transitions simulated once.

use std::sync::Arc;

use super::Posture;
use super::cache::{Additions, Cache, SimulationTotals, TrackedTransition, TransitionKey};
use super::evaluation::World;
use super::genome::Genome;
use super::grid::Grid;
use super::observer::{Interrupted, Stop};
use super::parameters::Parameters;
use super::policy::Edge;
use super::qlearning::{ActionOutcome, Environment};
use super::task::Objective;
use super::transition::Transition;

/// Actions between two looks at whether to go on: one that is known takes a microsecond, but a learner may be
/// given ten thousand million of them.
const ACTIONS_UNASKED: u64 = 1024;

/// What stays the same from individual to individual.
#[derive(Debug, Clone, Copy)]
pub struct Rules<'a> {
    /// The division of the joints.
    pub grid: &'a Grid,
    /// How motion is scored.
    pub objective: &'a Objective,
    /// The learner's parameters.
    pub parameters: &'a Parameters,
    /// When to break off.
    pub stop: &'a Stop,
}

/// The states of a genome, with the trunk's cell, as situations; going to a state as action. The last
/// situation is the standing pose, in which every episode starts.
///
/// A transition is simulated when it is asked for the first time, from the physical state that the
/// character is in then; after that its reward and the physical state after it are taken from memory.
pub struct Subset<'a, W: World> {
    rules: Rules<'a>,
    world: &'a mut W,
    shared: &'a Cache<W::State>,
    genome: &'a Genome,
    postures: Vec<Posture>,
    standing: Posture,
    /// Whether a state (or the standing pose, last) can go to a state without leaving a range of motion.
    permitted: Vec<bool>,
    /// Transitions known here, by situation and action.
    known: Vec<Option<Arc<TrackedTransition<W::State>>>>,
    /// Transitions simulated here.
    additions: Additions<W::State>,
    account: SimulationTotals,
    situation: usize,
    /// The transition that led to the present physical state; `None` when standing.
    last: Option<Arc<TrackedTransition<W::State>>>,
}

impl<'a, W: World> Subset<'a, W> {
    /// The subset `genome`, with what `shared` knows of it.
    pub fn new(rules: Rules<'a>, world: &'a mut W, shared: &'a Cache<W::State>, genome: &'a Genome) -> Self {
        let postures: Vec<Posture> = genome.states.iter().map(|state| rules.grid.posture(state)).collect();
        let standing = rules.grid.standing();
        let duration = rules.parameters.transition_time;
        let permitted = postures.iter().chain([&standing]).flat_map(|from| {
            postures.iter().map(move |to| Transition { from, to, duration }.stays_within(rules.grid))
        });
        let permitted = permitted.collect();
        let start = postures.len() * world.cells();
        let known = vec![None; (start + 1) * postures.len()];
        Self {
            rules,
            world,
            shared,
            genome,
            postures,
            standing,
            permitted,
            known,
            additions: Vec::new(),
            account: SimulationTotals::default(),
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

    /// What was simulated and what was saved.
    pub fn into_parts(self) -> (Additions<W::State>, SimulationTotals) {
        (self.additions, self.account)
    }

    fn arrival(&self, action: usize, cell: usize) -> usize {
        action * self.world.cells() + cell
    }

    fn reward(&self, tracked: &TrackedTransition<W::State>) -> f64 {
        let earned = self.rules.objective.reward(&tracked.terms, tracked.seconds);
        if tracked.after.is_some() { earned } else { earned - self.rules.objective.fall_cost() }
    }

    /// The transition from the present situation, from the shared cache or simulated.
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
        self.rules.stop.check()?;
        let tracked = Arc::new(self.simulate(state, action)?);
        self.account.simulated += 1;
        self.account.seconds += tracked.seconds;
        self.additions.push((key, tracked.clone()));
        Ok(tracked)
    }

    fn simulate(&mut self, state: usize, action: usize) -> Result<TrackedTransition<W::State>, Interrupted> {
        let transition = Transition {
            from: self.postures.get(state).unwrap_or(&self.standing),
            to: &self.postures[action],
            duration: self.rules.parameters.transition_time,
        };
        let targets = |t: f64, angles: &mut [f64]| transition.targets(t, angles);
        let steps = 0..self.rules.parameters.transition_steps;
        let before = self.last.as_ref().and_then(|tracked| tracked.after.as_ref());
        let outcome = match before {
            Some((before, _)) => self.world.track(before, &targets, steps, self.rules.stop)?,
            None => {
                let standing = self.world.standing().clone();
                self.world.track(&standing, &targets, steps, self.rules.stop)?
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
        self.account.asked += 1;
        if self.account.asked.is_multiple_of(ACTIONS_UNASKED) {
            self.rules.stop.check()?;
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
