//! One point of the learning curve.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Figures of one generation: one point of the learning curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Generation {
    /// Number of the generation, from 0.
    pub generation: u32,
    /// What was searched for in it, where gaits are searched for one by one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gait: Option<String>,
    /// Fitness of the best motion so far. Of QDSEGA it is m/s along the task's direction less costs; until a
    /// behaviour has passed the continuous check, that of the best individual of this generation. Of a gait it is
    /// 1 / (1 + cost), from 0 to 1.
    pub best: f64,
    /// Mean fitness of this generation.
    pub mean: f64,
    /// Standard deviation of this generation's fitness.
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

impl Generation {
    /// The same as it follows on the curve of another search before it.
    pub fn after(&self, before: &[Self]) -> Self {
        let Some(last) = before.last() else { return self.clone() };
        Self {
            generation: last.generation + 1 + self.generation,
            simulated_seconds: last.simulated_seconds + self.simulated_seconds,
            elapsed: last.elapsed + self.elapsed,
            ..self.clone()
        }
    }
}
