//! Tabular Q-learning with an ε-greedy policy (Watkins & Dayan 1992), in any environment.

use rand::{Rng, RngExt};

use super::parameters::Parameters;

/// What a Q-learner acts in.
pub trait Environment {
    /// Why learning breaks off before an action is carried out.
    type Break;
    /// Number of situations: rows of the Q-table.
    fn situations(&self) -> usize;
    /// Number of actions: columns of the Q-table.
    fn actions(&self) -> usize;
    /// Starts an episode and returns its first situation.
    fn start(&mut self) -> usize;
    /// Whether the action can be chosen in the situation.
    fn permits(&self, situation: usize, action: usize) -> bool;
    /// Carries the action out in the present situation.
    ///
    /// # Errors
    /// Whatever the environment breaks off for.
    fn act(&mut self, action: usize) -> Result<ActionOutcome, Self::Break>;
}

/// What an action leads to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ActionOutcome {
    /// Its reward.
    pub reward: f64,
    /// The situation it led to; `None` ends the episode.
    pub next: Option<usize>,
    /// How long it took, in units of the time for which the discount is given.
    pub duration: f64,
}

/// Parameters of Q-learning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Number of episodes.
    pub episodes: u32,
    /// Number of actions after which an episode ends.
    pub episode_length: u32,
    /// α, 0 to 1.
    pub learning_rate: f64,
    /// γ, 0 to 1, of a time of 1: where actions take different times, so do their discounts (Bradtke & Duff 1994).
    pub discount: f64,
    /// ε: share of actions drawn at random, 0 to 1.
    pub exploration: f64,
}

impl From<&Parameters> for Rates {
    fn from(parameters: &Parameters) -> Self {
        Self {
            episodes: parameters.episodes,
            episode_length: parameters.episode_length,
            learning_rate: parameters.learning_rate,
            discount: parameters.discount,
            exploration: parameters.exploration,
        }
    }
}

/// Q: the expected discounted return of every action in every situation, situations × actions, row by row; 0 at first.
#[derive(Debug, Clone, PartialEq)]
pub struct QTable {
    actions: usize,
    values: Vec<f64>,
}

impl QTable {
    /// A table of zeros for the situations and actions of `environment`.
    pub fn new<E: Environment>(environment: &E) -> Self {
        let actions = environment.actions();
        Self { actions, values: vec![0.0; environment.situations() * actions] }
    }

    /// Q of an action in a situation.
    pub fn value(&self, situation: usize, action: usize) -> f64 {
        self.values[situation * self.actions + action]
    }

    /// The permitted action of greatest Q, the lowest index of several; `None` if none is permitted.
    pub fn greedy<E: Environment>(&self, environment: &E, situation: usize) -> Option<usize> {
        let permitted = (0..self.actions).filter(|&action| environment.permits(situation, action));
        permitted.reduce(|best, action| {
            if self.value(situation, action) > self.value(situation, best) { action } else { best }
        })
    }

    /// Q ← Q + α (r + γᵗ max Q′ − Q) with the action's time t, and Q′ = 0 at the end of an episode.
    fn update<E: Environment>(
        &mut self,
        environment: &E,
        (situation, action): (usize, usize),
        step: ActionOutcome,
        rates: &Rates,
    ) {
        let best = |next| self.greedy(environment, next).map_or(0.0, |action| self.value(next, action));
        let future = step.next.map_or(0.0, best);
        let value = &mut self.values[situation * self.actions + action];
        *value += rates.learning_rate * (step.reward + rates.discount.powf(step.duration) * future - *value);
    }
}

/// Learns for the given number of episodes.
///
/// # Errors
/// The environment's reason to break off.
pub fn learn<E: Environment>(
    environment: &mut E,
    table: &mut QTable,
    rates: &Rates,
    rng: &mut impl Rng,
) -> Result<(), E::Break> {
    for _ in 0..rates.episodes {
        let mut situation = environment.start();
        for _ in 0..rates.episode_length {
            let action = if rng.random_bool(rates.exploration) {
                random_action(environment, situation, rng)
            } else {
                table.greedy(environment, situation)
            };
            let Some(action) = action else { break };
            let step = environment.act(action)?;
            table.update(environment, (situation, action), step, rates);
            let Some(next) = step.next else { break };
            situation = next;
        }
    }
    Ok(())
}

/// A permitted action, each with the same probability; `None` if none is permitted.
fn random_action<E: Environment>(environment: &E, situation: usize, rng: &mut impl Rng) -> Option<usize> {
    let permitted = || (0..environment.actions()).filter(|&action| environment.permits(situation, action));
    let count = permitted().count();
    if count == 0 { None } else { permitted().nth(rng.random_range(0..count)) }
}
