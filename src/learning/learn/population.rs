//! The coding in which an individual is one state and the population is the subset (Ito & Matsuno 2002).

use rand::{Rng, RngExt};

use super::breeding::Crossover;
use super::chance::{Purpose, stream};
use super::ga::{ATTEMPTS, Individual, nearest, select};
use super::genome::Genome;
use super::grid::{Grid, GridState};
use super::parameters::Parameters;

/// The next subset after `members`, fittest first: the fitter half of them, and children for the others. At first it is drawn
/// at random.
pub(super) fn next_subset(
    members: &[Individual],
    (grid, parameters): (&Grid, &Parameters),
    seed: u64,
    generation: u32,
    island: usize,
) -> Genome {
    let count = grid.drawn(parameters.states);
    let draw = |place| stream(seed, Purpose::Breeding, generation, island, place);
    if members.is_empty() {
        return Genome::random(grid, count, parameters.coupled(), &mut draw(0));
    }
    let survivors = &members[..members.len().div_ceil(2).min(count - 1).max(usize::from(count > 1))];
    let mut states: Vec<_> = survivors.iter().flat_map(|member| member.genome.states.clone()).collect();
    for place in states.len()..count {
        let mut rng = draw(place);
        let mut bred = (0..ATTEMPTS).map(|_| {
            let parent = &select(members, parameters, &mut rng).genome;
            let mut child = if rng.random_bool(parameters.crossover_rate) {
                cross(parent, members, (grid, parameters), &mut rng)
            } else {
                parent.clone()
            };
            child.mutate(grid, &parameters.mutation, &mut rng);
            child
        });
        let child = bred.find(|child| !states.contains(&child.states[0]));
        // Duplicates are replaced by states that are not.
        let child = child.unwrap_or_else(|| Genome::random(grid, 1, parameters.coupled(), &mut rng));
        states.extend(child.states);
    }
    let mut subset = Genome { states };
    subset.repair(grid, &mut draw(count));
    subset
}

/// The members of the next population: the states of an evaluated subset with what each was worth.
pub(super) fn members(subset: &Genome, worths: &[f64]) -> Vec<Individual> {
    let single = |state: &GridState| Genome { states: vec![state.clone()] };
    let pairs = subset.states.iter().zip(worths);
    pairs.map(|(state, &fitness)| Individual { genome: single(state), fitness }).collect()
}

fn cross(
    parent: &Genome,
    members: &[Individual],
    (grid, parameters): (&Grid, &Parameters),
    rng: &mut impl Rng,
) -> Genome {
    let Crossover { uniform, limb, neighbouring } = parameters.crossover;
    let draw = rng.random_range(0.0..uniform + limb + neighbouring);
    if (uniform..uniform + limb).contains(&draw) {
        let mate = &select(members, parameters, rng).genome;
        let groups = parent.limb_groups(mate, grid, parameters);
        parent.cross_by_limb(mate, &groups, grid, rng)
    } else if draw < uniform {
        let mate = &select(members, parameters, rng).genome;
        parent.cross_by_joint(mate, rng)
    } else {
        nearest(parent, members, parameters, rng)
            .map_or_else(|| parent.clone(), |mate| parent.cross_by_joint(mate, rng))
    }
}
