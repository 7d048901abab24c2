//! The units of a simulation: a length, a time and what follows from them, taken from the character and its weight.
//!
//! Every threshold of a step is a number of these units, so that a character a hundred times larger or smaller moves alike at
//! a step in proportion to the square root of its length.

use nalgebra::Vector3;

/// Standard gravity, in scenes without any, m/s².
pub const STANDARD_GRAVITY: f64 = 9.81;

/// A length and a time in which a character's motion is counted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharacterUnits {
    /// The size ℓ of its bodies ([`Model::size`](crate::model::Model::size)), m.
    pub length: f64,
    /// √(ℓ / g), s.
    pub time: f64,
}

impl CharacterUnits {
    /// Of a character of this `size` (m) under `gravity` (m/s²). Without weight there is no time but that under standard
    /// gravity.
    pub fn new(size: f64, gravity: &Vector3<f64>) -> Self {
        let acceleration = gravity.norm();
        let acceleration = if acceleration > 0.0 { acceleration } else { STANDARD_GRAVITY };
        Self { length: size, time: (size / acceleration).sqrt() }
    }

    /// ℓ / √(ℓ / g), m/s.
    pub fn speed(&self) -> f64 {
        self.length / self.time
    }
}
