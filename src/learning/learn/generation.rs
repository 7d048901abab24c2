//! One point of the learning curve.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Figures of one generation: one point of the learning curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Generation {
    /// Number of the generation, from 0.
    pub generation: u32,
    /// Fitness of the best behaviour so far, m/s along the task's direction less its costs; until one
    /// has passed the continuous check, that of the best individual of this generation.
    pub best: f64,
    /// Mean fitness of the populations, m/s.
    pub mean: f64,
    /// Standard deviation of the populations' fitness, m/s.
    pub spread: f64,
    /// Share of the transitions asked for so far that came from the cache, 0 to 1.
    pub cache_hit_rate: f64,
    /// Simulated time so far, s.
    pub simulated_seconds: f64,
    /// Simulated time that the cache saved so far, s.
    pub saved_seconds: f64,
    /// Wall clock time since the start, s; not part of any result.
    pub elapsed: f64,
}
