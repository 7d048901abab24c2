//! A subset of states as a chromosome, and what chance does to it.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use super::grid::{Grid, GridState, Level};
use super::parameters::Mutation;

/// Attempts to turn a duplicate into something new by mutation before it is drawn afresh.
const REPAIRS: usize = 8;

/// A subset of all states: what one individual of the genetic algorithm stands for.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Genome {
    /// The states, all different as far as the grid has enough of them.
    pub states: Vec<GridState>,
}

impl Genome {
    /// Draws `count` states around the standing pose: how far from it, and how many limbs follow others,
    /// is drawn first, so that a population holds timid and bold, symmetric and asymmetric ones.
    pub fn random(grid: &Grid, count: usize, rng: &mut impl Rng) -> Self {
        let boldness = rng.random_range(0.1..=1.0);
        let likeness = rng.random_range(0.0..=1.0);
        let states = (0..count).map(|_| random_state(grid, boldness, rng)).collect();
        let mut genome = Self { states };
        for limb in 0..grid.limbs.len() {
            if rng.random_bool(likeness)
                && let Some(leader) = Leader::random(grid, limb, rng)
            {
                genome.follow(grid, limb, &leader);
            }
        }
        genome.repair(grid, rng);
        genome
    }

    /// Takes every state whole from one parent or the other.
    pub fn cross_uniform(&self, other: &Self, rng: &mut impl Rng) -> Self {
        let states = self.states.iter().zip(&other.states);
        let states = states.map(|(ours, theirs)| if rng.random_bool(0.5) { ours } else { theirs }.clone());
        Self { states: states.collect() }
    }

    /// Takes every limb's part of all states from one parent or the other.
    pub fn cross_by_limb(&self, other: &Self, grid: &Grid, rng: &mut impl Rng) -> Self {
        let mut child = self.clone();
        for limb in &grid.limbs {
            if rng.random_bool(0.5) {
                for (state, theirs) in child.states.iter_mut().zip(&other.states) {
                    for &joint in &limb.joints {
                        state.0[joint] = theirs.0[joint];
                    }
                }
            }
        }
        child
    }

    /// Changes angles, velocities, limbs and whole states at random, at the given rates. Limbs that
    /// followed others before still do afterwards, unless that was what changed: otherwise every small
    /// change would cost a symmetric motion its symmetry, and send it off in a curve.
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
                let boldness = rng.random_range(0.1..=1.0);
                *state = random_state(grid, boldness, rng);
            }
            for (joint, level) in grid.joints.iter().zip(&mut state.0) {
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

    /// The first limb that `limb` follows in all states; `None` if it goes its own way.
    pub fn leader(&self, grid: &Grid, limb: usize) -> Option<Leader> {
        let mut choices =
            (0..limb).flat_map(|other| [false, true].map(|swapped| Leader { limb: other, swapped }));
        choices.find(|leader| {
            let followed = self.led(grid, limb, leader);
            followed.is_some_and(|followed| {
                let joints = &grid.limbs[limb].joints;
                let ours = self.states.iter().flat_map(|state| joints.iter().map(|&joint| state.0[joint]));
                ours.eq(followed.into_iter().flatten())
            })
        })
    }

    /// Makes `limb` do what `leader` does.
    fn follow(&mut self, grid: &Grid, limb: usize, leader: &Leader) {
        if let Some(followed) = self.led(grid, limb, leader) {
            for (state, levels) in self.states.iter_mut().zip(followed) {
                for (&joint, level) in grid.limbs[limb].joints.iter().zip(levels) {
                    state.0[joint] = level;
                }
            }
        }
    }

    /// Levels of `limb` in every state if it follows `leader`; `None` if it cannot.
    fn led(&self, grid: &Grid, limb: usize, leader: &Leader) -> Option<Vec<Vec<Level>>> {
        let (target, source) = (&grid.limbs[limb], &grid.limbs[leader.limb]);
        let signs = target.like(source)?;
        let states = (0..self.states.len()).map(|index| {
            let partner = if leader.swapped && index ^ 1 < self.states.len() { index ^ 1 } else { index };
            let joints = target.joints.iter().zip(&source.joints).zip(&signs);
            let levels = joints.map(|((&to, &from), &sign)| {
                let Level { angle, velocity } = self.states[partner].0[from];
                let turned = |level: i8| i16::from(level) * i16::from(sign);
                grid.joints[to].clamp(turned(angle), turned(velocity))
            });
            levels.collect()
        });
        Some(states.collect())
    }

    /// Replaces every state that equals an earlier one by a different one close to it.
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

    /// Distance in state space: levels of angle, and half as much for levels of velocity.
    pub fn distance(&self, other: &Self) -> f64 {
        let levels =
            |genome: &Self| genome.states.iter().flat_map(|state| state.0.clone()).collect::<Vec<_>>();
        let apart = |a: i8, b: i8| f64::from((i16::from(a) - i16::from(b)).abs());
        let pairs = levels(self).into_iter().zip(levels(other));
        pairs.map(|(a, b)| apart(a.angle, b.angle) + 0.5 * apart(a.velocity, b.velocity)).sum()
    }
}

/// Whom a limb follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Leader {
    /// The limb that leads; an earlier one than the one that follows.
    pub limb: usize,
    /// Whether the follower does in each state what the leader does in its partner, states being paired
    /// in their order (0 with 1, 2 with 3, …): in a motion to and fro between partners the two limbs
    /// alternate. Otherwise they move together.
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
        Some(Self { limb: others[rng.random_range(0..others.len())], swapped: rng.random_bool(0.5) })
    }
}

/// One or two levels up or down.
fn random_nudge(rng: &mut impl Rng) -> i16 {
    let size = rng.random_range(1..=2);
    if rng.random_bool(0.5) { size } else { -size }
}

/// A state drawn evenly from the share `boldness` of the grid around the standing pose.
fn random_state(grid: &Grid, boldness: f64, rng: &mut impl Rng) -> GridState {
    let mut within = |lowest: i8, highest: i8| {
        let end = |level: i8| (boldness * f64::from(level)).round() as i8;
        rng.random_range(end(lowest)..=end(highest))
    };
    let levels = grid.joints.iter().map(|joint| {
        let angle = within(joint.lowest, joint.highest());
        let [slowest, fastest] = joint.velocity_range(angle);
        Level { angle, velocity: within(slowest, fastest) }
    });
    GridState(levels.collect())
}

/// Moves the angle or the velocity of one joint.
fn nudge_one(grid: &Grid, state: &mut GridState, rng: &mut impl Rng) {
    if grid.joints.is_empty() {
        return;
    }
    let joint = rng.random_range(0..grid.joints.len());
    let Level { angle, velocity } = state.0[joint];
    let (angle, velocity) = (i16::from(angle), i16::from(velocity));
    let by = random_nudge(rng);
    state.0[joint] = if rng.random_bool(0.5) {
        grid.joints[joint].clamp(angle + by, velocity)
    } else {
        grid.joints[joint].clamp(angle, velocity + by)
    };
}
