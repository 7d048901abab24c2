//! The units of a simulation: a length, a time and what follows from them, taken from the character and its weight.
//!
//! Every threshold of a step is a number of these units, so that a character a hundred times larger or smaller moves alike at
//! a step in proportion to the square root of its length.

use nalgebra::Vector3;

/// Standard gravity, in scenes without any, m/s².
pub(crate) const STANDARD_GRAVITY: f64 = 9.81;

/// The size (m) at which a character is stepped by 2 ms where no step is given: that of a dog.
const USUAL_SIZE: f64 = 0.11;
const USUAL_STEP: f64 = 0.002;

/// Shortest and longest step that follows from a size, s.
const STEPS: [f64; 2] = [1e-5, 0.05];

/// The step for a character of this `size` ([`Model::size`](crate::model::Model::size), m) where none is given, s: in
/// proportion to the time in which its limbs swing, and so to the square root of the size; rounded to 1, 2 or 5 times a power of
/// ten.
pub fn usual_step(size: f64) -> f64 {
    let [shortest, longest] = STEPS;
    let wanted = (USUAL_STEP * (size / USUAL_SIZE).sqrt()).clamp(shortest, longest);
    let decade = wanted.log10().floor();
    let digits = [1.0_f64, 2.0, 5.0, 10.0];
    let mantissa = wanted / 10.0_f64.powf(decade);
    let apart = |digit: &f64| (digit / mantissa).ln().abs();
    let nearest = digits.into_iter().min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(1.0);
    // A quotient of whole numbers is the number that its decimal fraction reads as.
    nearest / 10.0_f64.powf(-decade)
}

/// A length and a time in which a character's motion is counted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CharacterUnits {
    /// The size ℓ of its bodies ([`Model::size`](crate::model::Model::size)), m.
    pub length: f64,
    /// √(ℓ / g), s.
    pub time: f64,
    /// g, m/s².
    pub acceleration: f64,
}

impl CharacterUnits {
    /// Of a character of this `size` (m) under `gravity` (m/s²). Without weight there is no time but that under standard
    /// gravity.
    pub fn new(size: f64, gravity: &Vector3<f64>) -> Self {
        let acceleration = gravity.norm();
        let acceleration = if acceleration > 0.0 { acceleration } else { STANDARD_GRAVITY };
        Self { length: size, time: (size / acceleration).sqrt(), acceleration }
    }

    /// ℓ / √(ℓ / g), m/s.
    pub fn speed(&self) -> f64 {
        self.length / self.time
    }
}
