//! How a character stands.

use crate::scene::Gains;
use crate::sim::State;

/// How a character stands.
#[derive(Debug, Clone, PartialEq)]
pub struct Stance {
    /// The state reached: at rest on the ground, root above the world's origin, time 0.
    pub state: State,
    /// Targets that hold it, rad or m, one a joint.
    pub angles: Vec<f64>,
    /// Height of the root link's origin above the ground, m.
    pub root_height: f64,
    /// Links that carry the character, by index into the character's links, in ascending order.
    pub support: Vec<usize>,
    /// Whether it came to rest without falling when it was held in the simulator.
    pub stable: bool,
    /// Whether the author gave the pose.
    pub given: bool,
    /// Gains suited to this character, with its own torque limits.
    pub gains: Gains,
}
