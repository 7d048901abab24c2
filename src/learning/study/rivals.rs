//! Searches of cyclic keyframes without Q-learning.

use super::arena::StudyArena;
use super::keyframes::{HALF, Keyframes};
use super::trail::Trail;
use super::variants::KeyframeStart;
use crate::learn::ga::{Individual, Island};
use crate::learn::genome::Genome;
use crate::learn::grid::{Grid, GridState};
use crate::learn::{LearnError, Learning, Posture, Trunk, reference_gravity};
use crate::program::cma::Cma;
use crate::program::ring::Ring;
use crate::program::rollout::{Arena, STRIDES};

/// Candidates of a generation of CMA-ES; the genetic algorithm has a population of twice as many.
const CANDIDATES: usize = 16;
/// Reach of CMA-ES at its start, in units of the numbers of a ring: from nothing, and from a seed.
const SIGMA: [f64; 2] = [0.5, 0.2];

/// What a candidate cost, and the best of a run.
struct Scores<'a> {
    arena: &'a StudyArena,
    trials: Arena,
    keyframes: &'a Keyframes<'a>,
    least: f64,
    trail: Trail,
}

impl<'a> Scores<'a> {
    fn new(arena: &'a StudyArena, keyframes: &'a Keyframes<'a>) -> Result<Self, LearnError> {
        let trials = arena.arena(Trunk::Free)?;
        Ok(Self { arena, trials, keyframes, least: f64::INFINITY, trail: Trail::default() })
    }

    /// What a ring costs over the strides of a search.
    fn cost(&mut self, ring: &Ring) -> f64 {
        let (cost, seconds) = self.arena.cost(&self.trials, ring, self.keyframes.gains(), STRIDES);
        self.trail.simulated += seconds;
        if cost < self.least {
            self.least = cost;
            self.trail.found.push(self.keyframes.found(ring, cost, self.trail.simulated));
        }
        cost
    }
}

/// A genetic algorithm on the grid, with the selection, crossover, mutation and elitism of QDSEGA: an individual is the first
/// half of a ring, and its fitness is what the ring costs.
pub(super) fn genetic(
    arena: &StudyArena,
    start: KeyframeStart,
    seed: u64,
    seconds: f64,
) -> Result<Trail, LearnError> {
    let keyframes = Keyframes::new(arena)?;
    let subject = &arena.subject;
    let learning = Learning { population: 2 * CANDIDATES, ..Learning::default() };
    let gravity = reference_gravity(&subject.scene);
    let parameters = learning.resolve(&subject.stance, gravity, subject.accuracy.step)?;
    // What is bred are halves of rings, of which none is multiplied by symmetry.
    let grid = Grid { symmetry: None, beats: 1, ..keyframes.grid().clone() };
    let parameters = crate::learn::Parameters { states: HALF, ..parameters };
    let mut scores = Scores::new(arena, &keyframes)?;
    let mut island = Island::default();
    let mut generation = 0;
    while scores.trail.simulated < seconds {
        let mut asked = island.ask(&grid, &parameters, seed, generation, 0);
        if generation == 0 && start == KeyframeStart::Seeds {
            let seeds = keyframes.seeds();
            for (genome, (half, _)) in asked.iter_mut().zip(&seeds) {
                *genome = Genome { states: half.iter().map(|posture| rounded(&grid, posture)).collect() };
            }
        }
        let mut children = Vec::with_capacity(asked.len());
        for genome in asked {
            let half: Vec<Posture> = genome.states.iter().map(|state| grid.posture(state)).collect();
            let fitness = -scores.cost(&keyframes.closed(half, keyframes.period));
            children.push(Individual { genome, fitness });
        }
        island.tell(children, &parameters);
        generation += 1;
    }
    Ok(scores.trail)
}

/// The state of the grid that is nearest to a posture.
fn rounded(grid: &Grid, posture: &Posture) -> GridState {
    let places = posture.angles.iter().zip(&posture.velocities);
    let levels = grid.joints.iter().zip(places).map(|(joint, (angle, velocity))| {
        let level = |value: f64, step: f64| if step > 0.0 { (value / step).round() as i16 } else { 0 };
        joint.clamp(level(angle - joint.standing, joint.angle_step), level(*velocity, joint.velocity_step))
    });
    GridState { levels: levels.collect(), beats: 1 }
}

/// CMA-ES on the numbers of a ring.
pub(super) fn continuous(
    arena: &StudyArena,
    start: KeyframeStart,
    seed: u64,
    seconds: f64,
) -> Result<Trail, LearnError> {
    let keyframes = Keyframes::new(arena)?;
    let mut scores = Scores::new(arena, &keyframes)?;
    let (mean, sigma) = match start {
        KeyframeStart::Nothing => (vec![0.0; keyframes.dimension()], SIGMA[0]),
        KeyframeStart::Seeds => {
            let mut best = (f64::INFINITY, vec![0.0; keyframes.dimension()]);
            for (half, period) in keyframes.seeds() {
                let numbers = keyframes.numbers(&half, period);
                let cost = scores.cost(&keyframes.ring(&numbers));
                if cost < best.0 {
                    best = (cost, numbers);
                }
            }
            (best.1, SIGMA[1])
        }
    };
    let mut search = Cma::new(&mean, sigma, CANDIDATES, seed);
    while scores.trail.simulated < seconds {
        let asked = search.ask();
        let costs: Vec<f64> = asked.iter().map(|numbers| scores.cost(&keyframes.ring(numbers))).collect();
        search.tell(&asked, &costs);
    }
    Ok(scores.trail)
}
