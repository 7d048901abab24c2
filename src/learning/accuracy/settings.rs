//! A single setting to be tried.

use super::engine::Engine;
use gaitwright_physics::scene::Accuracy;

/// What a trial is run with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrialSettings {
    /// The simulator that computes the steps.
    pub engine: Engine,
    /// Step, integrator, solver and coordinates. Of these, [`Engine::Rapier`] takes the step alone.
    pub accuracy: Accuracy,
}
