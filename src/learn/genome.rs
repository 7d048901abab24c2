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
    /// Draws `count` states around the standing pose: how far from it, and how often limbs do the
    /// same, is drawn first, so that a population holds timid and bold, symmetric and asymmetric ones.
    pub fn random(grid: &Grid, count: usize, rng: &mut impl Rng) -> Self {
        let boldness = rng.random_range(0.1..=1.0);
        let likeness = rng.random_range(0.0..=1.0);
        let mut genome = Self { states: Vec::with_capacity(count) };
        for _ in 0..count {
            let mut state = random_state(grid, boldness, rng);
            copy_limbs(grid, &mut state, likeness, rng);
            genome.states.push(state);
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

    /// Changes angles, velocities, limbs and whole states at random, at the given rates.
    pub fn mutate(&mut self, grid: &Grid, rates: &Mutation, rng: &mut impl Rng) {
        for state in &mut self.states {
            if rng.random_bool(rates.state) {
                let boldness = rng.random_range(0.1..=1.0);
                *state = random_state(grid, boldness, rng);
            }
            copy_limbs(grid, state, rates.limb, rng);
            for (joint, level) in grid.joints.iter().zip(&mut state.0) {
                let mut nudge = |rate| if rng.random_bool(rate) { random_nudge(rng) } else { 0 };
                let angle = i16::from(level.angle) + nudge(rates.angle);
                let velocity = i16::from(level.velocity) + nudge(rates.velocity);
                *level = joint.clamp(angle, velocity);
            }
        }
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

/// Gives each limb, with probability `rate`, the levels of another limb with as many joints, turned so
/// that both do the same ([`Limb::like`](super::limb::Limb::like)).
fn copy_limbs(grid: &Grid, state: &mut GridState, rate: f64, rng: &mut impl Rng) {
    for target in &grid.limbs {
        if !rng.random_bool(rate) {
            continue;
        }
        let source = &grid.limbs[rng.random_range(0..grid.limbs.len())];
        if let Some(signs) = target.like(source) {
            for ((&to, &from), sign) in target.joints.iter().zip(&source.joints).zip(signs) {
                let Level { angle, velocity } = state.0[from];
                let turned = |level: i8| i16::from(level) * i16::from(sign);
                state.0[to] = grid.joints[to].clamp(turned(angle), turned(velocity));
            }
        }
    }
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
