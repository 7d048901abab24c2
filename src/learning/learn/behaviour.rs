//! A learned behaviour: a sequence of postures.

use gaitwright_physics::motion::{Player, Steering};
use serde::{Deserialize, Serialize};

/// A cyclic behaviour: a sequence of joint angles and velocities, `transition_time` apart.
///
/// It starts in the standing pose at rest, passes through `entry` and then repeats `cycle`; between
/// two postures the targets follow a cubic Hermite spline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Behaviour {
    /// How good it is, the more the better. From QDSEGA, m/s: the least reward per time of the continuous checks from the standing pose
    /// and after small pushes. From the search gait by gait 1 / (1 + cost) with its [`cost`](crate::program::cost::cost).
    pub fitness: f64,
    /// Number of the generation that found it.
    pub generation: u32,
    /// Time between two states, s.
    pub transition_time: f64,
    /// Visited once, after the standing pose; may be empty.
    pub entry: Vec<Posture>,
    /// Visited repeatedly; not empty.
    pub cycle: Vec<Posture>,
    /// How the postures of the cycle, and those of the entry that grow into them, are changed by what the trunk does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering: Option<Steering>,
}

impl Behaviour {
    /// The targets of the joints over time, from the standing pose with these targets (rad or m).
    pub fn player(&self, standing: &[f64]) -> Player {
        let [entry, cycle] = [&self.entry, &self.cycle].map(|postures| postures.iter().map(Posture::parts));
        Player::from_postures(standing, entry, cycle, self.transition_time).steered(self.steering.clone())
    }
}

/// A state of the learner: angle and velocity of every joint (rad, rad/s; m, m/s).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Posture {
    /// rad or m, one a joint of the model.
    pub angles: Vec<f64>,
    /// rad/s or m/s, one a joint of the model.
    pub velocities: Vec<f64>,
}

impl Posture {
    /// These angles at rest.
    pub fn resting(angles: &[f64]) -> Self {
        Self { angles: angles.to_vec(), velocities: vec![0.0; angles.len()] }
    }

    /// Angles and velocities.
    pub fn parts(&self) -> (&[f64], &[f64]) {
        (&self.angles, &self.velocities)
    }

    /// The same, to be changed.
    pub fn parts_mut(&mut self) -> (&mut [f64], &mut [f64]) {
        (&mut self.angles, &mut self.velocities)
    }
}
