//! The genetic algorithm that chooses the next subsets: an island model with tournament selection, crossover, mutation
//! and elitism.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use super::breeding::Crossover;
use super::chance::{Purpose, stream};
use super::genome::Genome;
use super::grid::Grid;
use super::parameters::Parameters;
use super::repairs::Repair;

/// Mates drawn for a crossover with a neighbour; the closest of them is taken.
const NEIGHBOURS: usize = 5;
/// Attempts to breed a child that differs from all others before one is drawn at random.
pub(super) const ATTEMPTS: usize = 4;

/// A subset of states and the fitness of its behaviour, or, where the population is the subset, one state and what it is
/// worth there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Individual {
    /// The subset.
    pub genome: Genome,
    /// m/s, see [`super::trial::IndividualVerdict::fitness`]; of a state from 0 to 2, see
    /// [`super::subset::Subset::worths`].
    pub fitness: f64,
}

/// A population that evolves by itself but for migration.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Island {
    /// Fittest first; empty before the first generation.
    pub members: Vec<Individual>,
    /// Fitness of the best behaviour that passed the continuous check here, m/s, at every inspection of the check.
    #[serde(rename = "proven")]
    pub accepted: Option<Vec<f64>>,
    /// Number of generations from that in which `accepted` last changed, or from the first, that one included.
    pub stale: u32,
}

impl Island {
    /// The genomes to be evaluated in `generation`: a population drawn at random at first, then the
    /// children that fill the places below the elite.
    pub fn ask(
        &self,
        grid: &Grid,
        parameters: &Parameters,
        seed: u64,
        generation: u32,
        island: usize,
    ) -> Vec<Genome> {
        let places = if self.members.is_empty() {
            parameters.population
        } else {
            parameters.population - parameters.elite
        };
        let mut asked: Vec<Genome> = Vec::with_capacity(places);
        for place in 0..places {
            let mut rng = stream(seed, Purpose::Breeding, generation, island, place);
            let known = |genome: &Genome| {
                asked.contains(genome) || self.members.iter().any(|member| member.genome == *genome)
            };
            let attempts = if self.members.is_empty() { 0 } else { ATTEMPTS };
            let child =
                (0..attempts).map(|_| self.breed(grid, parameters, &mut rng)).find(|genome| !known(genome));
            let count = grid.drawn(parameters.states);
            let child = child.unwrap_or_else(|| Genome::random(grid, count, parameters.coupled(), &mut rng));
            asked.push(child);
        }
        asked
    }

    /// Replaces all members by those of a population that is one subset.
    pub fn replace(&mut self, members: Vec<Individual>) {
        self.members = members;
        self.rank();
        self.stale += 1;
    }

    /// Replaces all members but the elite by the evaluated children.
    pub fn tell(&mut self, children: Vec<Individual>, parameters: &Parameters) {
        self.members.truncate(parameters.elite);
        self.members.extend(children);
        self.rank();
        self.stale += 1;
    }

    /// Records the inspections of a behaviour that passed the check, if its final fitness is the greatest here.
    pub fn accept(&mut self, inspections: &[f64]) {
        let known = self.accepted.as_ref().and_then(|known| known.last());
        if known.is_none_or(|known| inspections.last().is_some_and(|new| new > known)) {
            self.accepted = Some(inspections.to_vec());
            self.stale = 0;
        }
    }

    /// Replaces the least fit member by an individual from another island, unless the same genome is here already or
    /// the island is empty.
    pub fn receive(&mut self, guest: Individual) {
        let known = self.members.iter().any(|member| member.genome == guest.genome);
        if !known && self.members.pop().is_some() {
            self.members.push(guest);
            self.rank();
        }
    }

    fn rank(&mut self) {
        // Stable, so that equals keep the order in which they were made.
        self.members.sort_by(|a, b| b.fitness.total_cmp(&a.fitness));
    }

    fn breed(&self, grid: &Grid, parameters: &Parameters, rng: &mut impl Rng) -> Genome {
        let parent = &select(&self.members, parameters, rng).genome;
        let mut child = if rng.random_bool(parameters.crossover_rate) {
            self.cross(parent, grid, parameters, rng)
        } else {
            parent.clone()
        };
        child.mutate(grid, &parameters.mutation, rng);
        child.repair(grid, rng);
        child
    }

    fn cross(&self, parent: &Genome, grid: &Grid, parameters: &Parameters, rng: &mut impl Rng) -> Genome {
        let Crossover { uniform, limb, neighbouring } = parameters.crossover;
        let draw = rng.random_range(0.0..uniform + limb + neighbouring);
        // States are paired in their order where limbs follow others in turn.
        let paired = grid.symmetry.is_none() && parameters.repairs.has(Repair::WholeGroups);
        let group = if paired { 2 } else { 1 };
        if draw < uniform {
            parent.cross_uniform(&select(&self.members, parameters, rng).genome, group, rng)
        } else if draw < uniform + limb {
            let mate = &select(&self.members, parameters, rng).genome;
            let groups = parent.limb_groups(mate, grid, parameters);
            parent.cross_by_limb(mate, &groups, grid, rng)
        } else {
            nearest(parent, &self.members, parameters, rng)
                .map_or_else(|| parent.clone(), |mate| parent.cross_uniform(mate, group, rng))
        }
    }
}

/// The fittest of a few of `members`, fittest first, drawn at random.
pub(super) fn select<'a>(
    members: &'a [Individual],
    parameters: &Parameters,
    rng: &mut impl Rng,
) -> &'a Individual {
    let draws = (0..parameters.tournament).map(|_| rng.random_range(0..members.len()));
    // Members are ranked: the smallest index is the fittest.
    &members[draws.min().unwrap_or(0)]
}

/// The one of a few selected mates that is nearest to `parent`; `None` if all of them are like it.
pub(super) fn nearest<'a>(
    parent: &Genome,
    members: &'a [Individual],
    parameters: &Parameters,
    rng: &mut impl Rng,
) -> Option<&'a Genome> {
    let mates = (0..NEIGHBOURS).map(|_| &select(members, parameters, rng).genome);
    let others: Vec<&Genome> = mates.filter(|mate| *mate != parent).collect();
    let apart = |mate: &&Genome| parent.distance(mate);
    others.into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b)))
}

/// Empties every island that is in the `patience`-th generation from that in which its accepted behaviour last improved, except the one
/// with the best of all, or the first where none has any: its next population is drawn at random, so that the search leaves local optima.
pub fn restart_stale(islands: &mut [Island], patience: u32) {
    let fitness =
        |island: &Island| island.accepted.as_ref().and_then(|inspections| inspections.last().copied());
    let best_fitness = |island: &Island| fitness(island).unwrap_or(f64::NEG_INFINITY);
    let best = (0..islands.len()).reduce(|best, index| {
        if best_fitness(&islands[index]) > best_fitness(&islands[best]) { index } else { best }
    });
    for (index, island) in islands.iter_mut().enumerate() {
        if island.stale >= patience && best != Some(index) {
            *island = Island::default();
        }
    }
}

/// Migration: sends a copy of each island's best member to the next island of a ring, all at the same time.
pub fn migrate(islands: &mut [Island]) {
    let best: Vec<Option<Individual>> =
        islands.iter().map(|island| island.members.first().cloned()).collect();
    let count = islands.len();
    for (from, guest) in best.into_iter().enumerate() {
        if let (Some(guest), true) = (guest, count > 1) {
            islands[(from + 1) % count].receive(guest);
        }
    }
}
