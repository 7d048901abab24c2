//! A gait that was tried.

use gaitwright_physics::scene::Gains;

use super::cost::{undisturbed, when_disturbed};
use super::figures::RolloutFigures;
use super::ring::{Ring, Wanted};
use super::rollout::Arena;
use super::subject::Subject;

/// A gait and what it costs.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// Of the leg program.
    pub parameters: Vec<f64>,
    /// The same in keyframes.
    pub ring: Ring,
    /// Springs and dampers that go with it.
    pub gains: Gains,
    /// What it did.
    pub figures: RolloutFigures,
    /// What it did under each disturbance.
    pub disturbed: Vec<RolloutFigures>,
    /// Less is better (see [`cost`](super::cost::cost)).
    pub cost: f64,
}

impl Candidate {
    /// The gait of `parameters`, tried over `strides` strides without any disturbance: its cost is the least that it can be.
    pub fn undisturbed(
        subject: &Subject,
        arena: &Arena,
        wanted: &Wanted,
        parameters: &[f64],
        strides: usize,
    ) -> Self {
        let (ring, gains) = subject.ring(wanted, parameters);
        let figures = arena.run(&ring, &gains, strides);
        let disturbed = Vec::new();
        let mut tried = Self { parameters: parameters.to_vec(), ring, gains, figures, disturbed, cost: 0.0 };
        tried.cost = tried.least_cost(subject, wanted);
        tried
    }

    /// What it costs without what a disturbance takes from it.
    pub fn least_cost(&self, subject: &Subject, wanted: &Wanted) -> f64 {
        self.least_cost_with(&self.figures, subject, wanted)
    }

    /// What it costs by what it did, disturbances included, but for the drift and the turn of its way: they are still to be mended.
    pub fn cost_if_straight(&self, subject: &Subject, wanted: &Wanted) -> f64 {
        let least = self.least_cost_with(&self.figures.if_straight(), subject, wanted);
        least + when_disturbed(&self.figures, &self.disturbed)
    }

    /// What it costs without what a disturbance takes from it, had it done what `figures` tell.
    fn least_cost_with(&self, figures: &RolloutFigures, subject: &Subject, wanted: &Wanted) -> f64 {
        let Self { parameters, ring, .. } = self;
        // A weak penalty keeps parameters within ±3 unless more gains something.
        let far = 0.01 * parameters.iter().map(|p| (p.abs() - 3.0).max(0.0).powi(2)).sum::<f64>();
        let missed = 5.0 * ring.missed / subject.legs.length;
        undisturbed(wanted, ring.period, &subject.legs, figures) + far + missed
    }

    /// What it costs where that is what is wanted, by what it did.
    pub fn cost_as(&self, subject: &Subject, wanted: &Wanted) -> f64 {
        self.least_cost(subject, wanted) + when_disturbed(&self.figures, &self.disturbed)
    }

    /// The same after it was disturbed, too.
    pub fn disturbed(mut self, arena: &Arena, strides: usize) -> Self {
        self.disturbed = arena.run_disturbed(&self.figures, &self.ring, &self.gains, strides);
        self.cost += when_disturbed(&self.figures, &self.disturbed);
        self
    }

    /// s simulated for it.
    pub fn seconds(&self) -> f64 {
        self.figures.seconds + self.disturbed_seconds()
    }

    /// s simulated for it while it was disturbed.
    pub fn disturbed_seconds(&self) -> f64 {
        self.disturbed.iter().map(|disturbed| disturbed.seconds).sum()
    }
}

/// Tries the gait of `parameters` over `strides` strides.
pub fn evaluate(
    subject: &Subject,
    arena: &Arena,
    wanted: &Wanted,
    parameters: &[f64],
    strides: usize,
) -> Candidate {
    Candidate::undisturbed(subject, arena, wanted, parameters, strides).disturbed(arena, strides)
}
