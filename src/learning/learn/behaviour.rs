//! A learned behaviour: postures in turn.

use serde::{Deserialize, Serialize};

/// A cyclic behaviour: states of joint angles and velocities visited in turn, `transition_time` apart.
///
/// It starts in the standing pose at rest, passes through `entry` and then repeats `cycle`; between
/// two postures the targets follow a cubic Hermite spline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Behaviour {
    /// Over the continuous check, m/s: the least of its fitnesses undisturbed and after small pushes.
    pub fitness: f64,
    /// Generation that found it.
    pub generation: u32,
    /// Seconds between two states.
    pub transition_time: f64,
    /// Visited once, from the standing pose; may be empty.
    pub entry: Vec<Posture>,
    /// Visited over and over; not empty.
    pub cycle: Vec<Posture>,
}

/// A state of the learner: angle and velocity of every joint (rad, rad/s; m, m/s).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Posture {
    /// rad or m.
    pub angles: Vec<f64>,
    /// rad/s or m/s.
    pub velocities: Vec<f64>,
}

impl Posture {
    /// At rest.
    pub fn resting(angles: &[f64]) -> Self {
        Self { angles: angles.to_vec(), velocities: vec![0.0; angles.len()] }
    }

    /// Angles and velocities.
    pub fn parts(&self) -> (&[f64], &[f64]) {
        (&self.angles, &self.velocities)
    }
}
