//! One speed of a niche: candidates for it, refined generation by generation.

use std::time::Instant;

use super::proof::Found;
use super::{NicheSearch, STREAMS};
use crate::gait::leaps;
use crate::learn::{Generation, Interrupted};
use crate::program::cost::HOLDS;
use crate::program::refine::{Candidate, PAIRED, Refinement};
use crate::program::ring::Wanted;
use crate::program::rollout::{STEERED_STRIDES, STRIDES};
use crate::training::motion::LearnedMotion;
use crate::training::shared::Shared;

/// Generations after which it is looked whether the best is natural already.
const LOOK: usize = 5;

/// A refinement at one speed.
pub(super) struct Stage {
    pub(super) wanted: Wanted,
    pub(super) refinement: Refinement,
}

impl Stage {
    pub(super) fn best(&self) -> &Candidate {
        self.refinement.best()
    }

    pub(super) fn holds(&self) -> bool {
        self.best().cost < HOLDS
    }

    pub(super) fn found(&self) -> Found {
        let (wanted, candidate) = (self.wanted.clone(), self.best().clone());
        Found { wanted, candidate, natural: false, trials: Vec::new() }
    }

    /// Whether it does what is wanted for less than `other`.
    pub(super) fn beats(&self, other: &Self) -> bool {
        let cost = |stage: &Self| stage.best().figures.cost_of_transport;
        self.holds() && (!other.holds() || cost(self) < cost(other))
    }
}

/// Whether what a refinement finds is the niche's best.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Rank {
    Leading,
    Rival,
}

/// At which step candidates are tried.
#[derive(Debug, Clone, Copy)]
pub(super) enum Fidelity {
    Coarse,
    Fine,
}

impl NicheSearch<'_> {
    /// A refinement at another Froude number, on from the best of `leading`.
    pub(super) fn from(
        &mut self,
        leading: &Stage,
        froude: f64,
        generations: u32,
    ) -> Result<Stage, Interrupted> {
        let mut other = self.stage(froude, &[leading.best().parameters.clone()])?;
        self.refine(&mut other, Fidelity::Coarse, generations, Rank::Rival)?;
        Ok(other)
    }

    /// Begins a refinement at a Froude number.
    pub(super) fn stage(&mut self, froude: f64, starts: &[Vec<f64>]) -> Result<Stage, Interrupted> {
        let Shared { setup, subject, pool, stop, .. } = self.shared;
        let coarse = &self.coarse;
        stop.check()?;
        let usual = Wanted::at_froude(&subject.legs, self.niche.gait, froude, subject.gravity());
        let wanted = Wanted { weights: setup.task.weights, ..usual };
        // Steps of the golden ratio keep the seeds of all stages apart (Steele, Lea & Flood 2014).
        let strides = if self.steered { STEERED_STRIDES } else { STRIDES };
        let number = STREAMS * self.index as u64 + self.stages + 1;
        let seed = setup.seed.wrapping_add(0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(number));
        self.stages += 1;
        let paired = if self.steered || leaps(self.niche.gait.gait) { 0 } else { PAIRED };
        let chances = (strides, paired, seed);
        let refinement = Refinement::new((pool, stop), subject, coarse, &wanted, starts, chances)?;
        self.progress.simulated += refinement.seconds;
        Ok(Stage { wanted, refinement })
    }

    /// So many generations, or as many as the budget has.
    pub(super) fn refine(
        &mut self,
        stage: &mut Stage,
        fidelity: Fidelity,
        generations: u32,
        rank: Rank,
    ) -> Result<(), Interrupted> {
        let Shared { pool, stop, subject, .. } = self.shared;
        for _ in 0..generations {
            self.progress.hurried |= self.is_late(stage);
            if self.shared.used_up(self.progress).is_some() {
                break;
            }
            let arena = match fidelity {
                Fidelity::Coarse => &self.coarse,
                Fidelity::Fine => &self.fine,
            };
            let Stage { wanted, refinement } = &mut *stage;
            let (before, begun) = (refinement.seconds, Instant::now());
            refinement.generation((pool, stop), subject, arena, wanted)?;
            let simulated = refinement.seconds - before;
            self.step_time = begun.elapsed().as_secs_f64() * arena.step() / simulated;
            self.progress.simulated += simulated;
            if rank == Rank::Leading {
                self.found = Some(stage.found());
            }
            let figures = self.figures(&stage.refinement);
            self.observer.generation(&figures);
            self.progress.curve.push(figures);
            if rank == Rank::Leading && self.progress.curve.len().is_multiple_of(LOOK) {
                self.show_first_natural(stage);
            }
        }
        Ok(())
    }

    fn figures(&self, refinement: &Refinement) -> Generation {
        let values: Vec<f64> = refinement.costs.iter().map(|&cost| fitness(cost)).collect();
        let count = values.len().max(1) as f64;
        let mean = values.iter().sum::<f64>() / count;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
        Generation {
            generation: self.progress.curve.len() as u32,
            gait: Some(self.niche.name.clone()),
            best: fitness(refinement.best().cost),
            mean,
            spread: variance.sqrt(),
            cache_hit_rate: 0.0,
            simulated_seconds: self.progress.simulated,
            saved_seconds: 0.0,
            elapsed: self.progress.elapsed(),
        }
    }

    pub(super) fn motion(&self, wanted: &Wanted, candidate: &Candidate) -> LearnedMotion {
        let Candidate { ring, gains, parameters, cost, .. } = candidate;
        LearnedMotion {
            name: self.niche.name.clone(),
            gait: Some(self.niche.gait.gait.to_owned()),
            speed: Some(wanted.speed),
            behaviour: ring.behaviour(fitness(*cost), self.progress.curve.len() as u32),
            gains: gains.clone(),
            parameters: parameters.clone(),
            trials: Vec::new(),
        }
    }
}

/// From 0 to 1, the more the less a gait costs.
fn fitness(cost: f64) -> f64 {
    if cost.is_finite() { 1.0 / (1.0 + cost.max(0.0)) } else { 0.0 }
}
