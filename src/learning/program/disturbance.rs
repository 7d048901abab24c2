//! What a motion has to withstand, in the search as in the trials that it is played in at its end.

/// Factors of the coefficient of friction.
pub const FRICTION: [f64; 2] = [0.6, 1.4];

/// Factor of stiffness and damping.
pub const GAINS: f64 = 0.75;

/// Change of velocity by a push, in √(g h).
const PUSH: f64 = 0.06;

/// Time constant of soft contacts, in √(h / g).
///
/// For a dog 25 ms, a little more than what MuJoCo's contacts have where nothing is said of them (`solref` 0.02): what only hard ground
/// makes steady stumbles on either.
const SOFT: f64 = 0.15;

/// Change of velocity by a push, m/s, for a `height` of root or hips above the ground, m, under `gravity`, m/s².
pub fn push(height: f64, gravity: f64) -> f64 {
    PUSH * (gravity * height.max(0.0)).sqrt()
}

/// Time constant of soft contacts, s; for the others see [`push`]. 0 without weight or height.
pub fn soft_contact(height: f64, gravity: f64) -> f64 {
    if gravity > 0.0 { SOFT * (height.max(0.0) / gravity).sqrt() } else { 0.0 }
}
