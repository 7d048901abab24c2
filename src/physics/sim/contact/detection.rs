//! How far ahead of a step contacts are detected, and how they rebound.

/// A contact that closes more slowly than this many steps of free fall does not rebound: what the
/// weight adds in each step must not keep a resting contact from resting.
const RESTING_STEPS: f64 = 4.0;

/// How far ahead of a step contacts are detected, and how they rebound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DetectionSettings {
    /// Length of the step, s.
    pub step: f64,
    /// Time ahead for which contacts are detected, s: the step's, and more where a feedforward pass looks farther ahead.
    pub ahead: f64,
    /// Acceleration for which the look ahead makes room, m/s²: gravity, or standard gravity where there is none.
    pub acceleration: f64,
    /// Magnitude of gravity, m/s².
    pub gravity: f64,
    /// Whether a point that can be reached within twice the time ahead is a candidate already, so that its row stops it on
    /// the surface instead of in it. Otherwise only points at or below the surface are candidates.
    pub anticipate: bool,
    /// Coefficient of restitution.
    pub restitution: f64,
}

impl DetectionSettings {
    /// For the contacts closed at present.
    pub const PRESENT: Self =
        Self { step: 0.0, ahead: 0.0, acceleration: 0.0, gravity: 0.0, anticipate: false, restitution: 0.0 };

    /// Greatest gap that can be closed within twice the time ahead at a present speed of `approach`, m.
    #[inline]
    pub fn margin(&self, approach: f64) -> f64 {
        if self.anticipate {
            4.0 * self.ahead * self.ahead * self.acceleration + 2.0 * self.ahead * approach.max(0.0)
        } else {
            0.0
        }
    }

    /// Newton's law of restitution: the separation speed, m/s, of a contact that closes at `approach`.
    ///
    /// The speed is that at the beginning of the step in which the contact closes. With it, a point that
    /// bounces with coefficient 1 under constant gravity keeps v² / 2 + g z − g h v / 2, which is what
    /// semi-implicit steps of free flight keep, to the last bit of rounding: its height neither rises nor falls over time.
    #[inline]
    pub fn rebound(&self, approach: f64) -> f64 {
        if approach > RESTING_STEPS * self.gravity * self.step { self.restitution * approach } else { 0.0 }
    }
}
