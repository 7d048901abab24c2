//! What a run has found on its way.

use gaitwright_physics::scene::Gains;

use crate::learn::Behaviour;

/// A motion that was a run's best.
#[derive(Debug, Clone)]
pub(super) struct Found {
    /// Simulated time when it was found, s.
    pub(super) at: f64,
    pub(super) behaviour: Behaviour,
    pub(super) gains: Gains,
}

/// The course of a run.
#[derive(Debug, Clone, Default)]
pub(super) struct Trail {
    /// Every motion that was its best, in order.
    pub(super) found: Vec<Found>,
    /// Simulated time in all, s.
    pub(super) simulated: f64,
    /// Simulated time that caches saved, s.
    pub(super) saved: f64,
    /// Share of the transitions that came from caches; `None` where there are none.
    pub(super) hit_rate: Option<f64>,
}
