//! A subset of states as a chromosome: random initialisation, crossover, mutation and repair.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use super::breeding::Mutation;
use super::grid::{Grid, GridState, Level};
use super::parameters::Parameters;
use super::repairs::Repair;

/// Attempts to change a duplicate state by mutation before it is drawn at random.
const REPAIRS: usize = 8;
/// Most beats of a state that is drawn at random: the paper's transition time is two.
const BEATS: u8 = 4;

/// The genotype of an individual: states of the grid, from which those of its subset follow by symmetry.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Genome {
    /// The states, all different as far as the grid has enough of them.
    pub states: Vec<GridState>,
}

impl Genome {
    /// Draws `count` states around the standing pose. How far they are from it, and how many limbs are coupled to
    /// others (none unless `coupled`), is drawn first, so that a population contains small and large, symmetric and
    /// asymmetric motions.
    pub fn random(grid: &Grid, count: usize, coupled: bool, rng: &mut impl Rng) -> Self {
        let amplitude = rng.random_range(0.1..=1.0);
        let coupling = if coupled { rng.random_range(0.0..=1.0) } else { 0.0 };
        let states = (0..count).map(|_| random_state(grid, amplitude, rng)).collect();
        let mut genome = Self { states };
        for limb in 0..grid.limbs.len() {
            if rng.random_bool(coupling)
                && let Some(leader) = Leader::random(grid, limb, rng)
            {
                genome.follow(grid, limb, &leader);
            }
        }
        genome.repair(grid, rng);
        genome
    }

    /// Takes every group of `group` successive states whole from one parent or the other.
    pub fn cross_uniform(&self, other: &Self, group: usize, rng: &mut impl Rng) -> Self {
        let groups = self.states.chunks(group).zip(other.states.chunks(group));
        let states =
            groups.flat_map(|(ours, theirs)| if rng.random_bool(0.5) { ours } else { theirs }.to_vec());
        Self { states: states.collect() }
    }

    /// Takes every joint's levels, state by state, from one parent or the other, and so the beats.
    pub fn cross_by_joint(&self, other: &Self, rng: &mut impl Rng) -> Self {
        let mut child = self.clone();
        for (state, theirs) in child.states.iter_mut().zip(&other.states) {
            for (level, other) in state.levels.iter_mut().zip(&theirs.levels) {
                if rng.random_bool(0.5) {
                    *level = *other;
                }
            }
            if rng.random_bool(0.5) {
                state.beats = theirs.beats;
            }
        }
        child
    }

    /// Takes the levels of each group of limbs, in all states, from one parent or the other.
    pub fn cross_by_limb(
        &self,
        other: &Self,
        groups: &[Vec<usize>],
        grid: &Grid,
        rng: &mut impl Rng,
    ) -> Self {
        let mut child = self.clone();
        for group in groups {
            if rng.random_bool(0.5) {
                for (state, theirs) in child.states.iter_mut().zip(&other.states) {
                    for &joint in group.iter().flat_map(|&limb| &grid.limbs[limb].joints) {
                        state.levels[joint] = theirs.levels[joint];
                    }
                }
            }
        }
        child
    }

    /// The limbs, where groups are kept whole together with those that they follow here or in `other`.
    pub fn limb_groups(&self, other: &Self, grid: &Grid, parameters: &Parameters) -> Vec<Vec<usize>> {
        let single = (0..grid.limbs.len()).map(|limb| vec![limb]);
        if !parameters.repairs.has(Repair::WholeGroups) {
            return single.collect();
        }
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for mut group in single {
            let limb = group[0];
            for leader in [self.leader(grid, limb), other.leader(grid, limb)].into_iter().flatten() {
                if let Some(place) = groups.iter().position(|group| group.contains(&leader.limb)) {
                    group.extend(groups.remove(place));
                }
            }
            groups.push(group);
        }
        groups
    }

    /// Changes angles, velocities, limbs and whole states at random, at the given rates. Limbs that were coupled to
    /// others before still are afterwards, unless the coupling itself was mutated: otherwise every small change would
    /// make a symmetric motion asymmetric, and the character would turn.
    pub fn mutate(&mut self, grid: &Grid, rates: &Mutation, rng: &mut impl Rng) {
        let mut leaders: Vec<Option<Leader>> =
            (0..grid.limbs.len()).map(|limb| self.leader(grid, limb)).collect();
        for (limb, leader) in leaders.iter_mut().enumerate() {
            if rng.random_bool(rates.limb) {
                *leader = if rng.random_bool(0.5) { Leader::random(grid, limb, rng) } else { None };
            }
        }
        for state in &mut self.states {
            if rng.random_bool(rates.state) {
                let amplitude = rng.random_range(0.1..=1.0);
                *state = random_state(grid, amplitude, rng);
            }
            if grid.beats > 1 && rng.random_bool(rates.time) {
                let by = if rng.random_bool(0.5) { 1 } else { -1 };
                state.beats = state.beats.saturating_add_signed(by).clamp(1, grid.beats);
            }
            for (joint, level) in grid.joints.iter().zip(&mut state.levels) {
                let mut nudge = |rate| if rng.random_bool(rate) { random_nudge(rng) } else { 0 };
                let angle = i16::from(level.angle) + nudge(rates.angle);
                let velocity = i16::from(level.velocity) + nudge(rates.velocity);
                *level = joint.clamp(angle, velocity);
            }
        }
        for (limb, leader) in leaders.iter().enumerate() {
            if let Some(leader) = leader {
                self.follow(grid, limb, leader);
            }
        }
    }

    /// The first limb whose motion `limb` repeats in all states; `None` if it moves independently.
    pub fn leader(&self, grid: &Grid, limb: usize) -> Option<Leader> {
        let ways: &[bool] = if Leader::takes_turns(grid) { &[false, true] } else { &[false] };
        let mut choices =
            (0..limb).flat_map(|other| ways.iter().map(move |&swapped| Leader { limb: other, swapped }));
        choices.find(|leader| {
            let followed = self.led(grid, limb, leader);
            followed.is_some_and(|followed| {
                let joints = &grid.limbs[limb].joints;
                let ours =
                    self.states.iter().flat_map(|state| joints.iter().map(|&joint| state.levels[joint]));
                ours.eq(followed.into_iter().flatten())
            })
        })
    }

    /// Couples `limb` to `leader` in all states.
    fn follow(&mut self, grid: &Grid, limb: usize, leader: &Leader) {
        if let Some(followed) = self.led(grid, limb, leader) {
            for (state, levels) in self.states.iter_mut().zip(followed) {
                for (&joint, level) in grid.limbs[limb].joints.iter().zip(levels) {
                    state.levels[joint] = level;
                }
            }
        }
    }

    /// Levels of `limb` in every state if it is coupled to `leader`: states × joints of the limb. `None` if the limbs
    /// differ in their number of joints.
    fn led(&self, grid: &Grid, limb: usize, leader: &Leader) -> Option<Vec<Vec<Level>>> {
        let (target, source) = (&grid.limbs[limb], &grid.limbs[leader.limb]);
        let signs = target.signs_from(source)?;
        let states = (0..self.states.len()).map(|index| {
            let partner = if leader.swapped && index ^ 1 < self.states.len() { index ^ 1 } else { index };
            let joints = target.joints.iter().zip(&source.joints).zip(&signs);
            let levels = joints.map(|((&to, &from), &sign)| {
                let Level { angle, velocity } = self.states[partner].levels[from];
                let mirrored = |level: i8| i16::from(level) * i16::from(sign);
                grid.joints[to].clamp(mirrored(angle), mirrored(velocity))
            });
            levels.collect()
        });
        Some(states.collect())
    }

    /// Replaces every state that equals an earlier one by a different state close to it.
    pub fn repair(&mut self, grid: &Grid, rng: &mut impl Rng) {
        for index in 1..self.states.len() {
            for attempt in 0..2 * REPAIRS {
                let (earlier, rest) = self.states.split_at_mut(index);
                let state = &mut rest[0];
                if !earlier.contains(state) {
                    break;
                }
                if attempt < REPAIRS {
                    nudge_one(grid, state, rng);
                } else {
                    *state = random_state(grid, 1.0, rng);
                }
            }
        }
    }

    /// Sum over all states and joints of the differences of angle levels and half the differences of velocity levels;
    /// times do not count.
    pub fn distance(&self, other: &Self) -> f64 {
        let levels =
            |genome: &Self| genome.states.iter().flat_map(|state| state.levels.clone()).collect::<Vec<_>>();
        let apart = |a: i8, b: i8| f64::from((i16::from(a) - i16::from(b)).abs());
        let pairs = levels(self).into_iter().zip(levels(other));
        pairs.map(|(a, b)| apart(a.angle, b.angle) + 0.5 * apart(a.velocity, b.velocity)).sum()
    }
}

/// The limb that another is coupled to, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leader {
    /// The limb that leads; an earlier one than the one that follows.
    pub limb: usize,
    /// Whether the follower's levels in a state are the leader's in the partner of that state, states being paired in
    /// their order (0 with 1, 2 with 3, …): in a motion that alternates between partners the two limbs then move in
    /// antiphase. Otherwise they move in phase.
    pub swapped: bool,
}

impl Leader {
    /// Draws one for `limb`; `None` if no earlier limb has as many joints.
    fn random(grid: &Grid, limb: usize, rng: &mut impl Rng) -> Option<Self> {
        let count = grid.limbs[limb].joints.len();
        let others: Vec<usize> = (0..limb).filter(|&other| grid.limbs[other].joints.len() == count).collect();
        if others.is_empty() {
            return None;
        }
        let swapped = Self::takes_turns(grid) && rng.random_bool(0.5);
        Some(Self { limb: others[rng.random_range(0..others.len())], swapped })
    }

    /// Whether a limb can follow another in turn: where subsets are closed under shifts, that does so already.
    fn takes_turns(grid: &Grid) -> bool {
        grid.symmetry.is_none()
    }
}

/// One or two levels up or down.
fn random_nudge(rng: &mut impl Rng) -> i16 {
    let size = rng.random_range(1..=2);
    if rng.random_bool(0.5) { size } else { -size }
}

/// A state drawn with uniform probability from the share `amplitude` (0 to 1) of the grid around the standing pose.
fn random_state(grid: &Grid, amplitude: f64, rng: &mut impl Rng) -> GridState {
    let mut within = |lowest: i8, highest: i8| {
        let end = |level: i8| (amplitude * f64::from(level)).round() as i8;
        rng.random_range(end(lowest)..=end(highest))
    };
    let levels = grid.joints.iter().map(|joint| {
        let angle = within(joint.lowest, joint.highest());
        let [slowest, fastest] = joint.velocity_range(angle);
        Level { angle, velocity: within(slowest, fastest) }
    });
    let levels = levels.collect();
    let beats = if grid.beats > 1 { rng.random_range(1..=grid.beats.min(BEATS)) } else { 1 };
    GridState { levels, beats }
}

/// Changes the angle or the velocity of one joint by one or two levels.
fn nudge_one(grid: &Grid, state: &mut GridState, rng: &mut impl Rng) {
    if grid.joints.is_empty() {
        return;
    }
    let joint = rng.random_range(0..grid.joints.len());
    let Level { angle, velocity } = state.levels[joint];
    let (angle, velocity) = (i16::from(angle), i16::from(velocity));
    let by = random_nudge(rng);
    state.levels[joint] = if rng.random_bool(0.5) {
        grid.joints[joint].clamp(angle + by, velocity)
    } else {
        grid.joints[joint].clamp(angle, velocity + by)
    };
}
