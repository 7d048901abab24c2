//! Whether the fixed-point iteration for the mean velocities converges.

/// Greatest number of iterations. Each has to halve the error, or the step is too long.
const MAX_ITERATIONS: usize = 20;

/// The fixed-point iteration for the velocities at which velocity-dependent forces are taken: they depend on the new
/// velocities, which they help to determine.
#[derive(Debug)]
pub struct FixedPoint {
    count: usize,
    /// Error of the last iteration, rad or sizes of the character a step.
    last: f64,
}

/// State of an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convergence {
    /// The error is within the tolerance.
    Converged,
    /// The error is likely to halve in the next iteration.
    Improving,
    /// The error does not halve from one iteration to the next, or there have been too many.
    Stalled,
}

impl FixedPoint {
    /// Before the first iteration.
    pub const START: Self = Self { count: 0, last: f64::INFINITY };

    /// Judges an iteration whose error was `error`, where no more than `tolerance` may be. The error of the next one
    /// will be about that times `rotation_angle` (rad), by which a body rotates in the step.
    pub fn judge(&mut self, error: f64, rotation_angle: f64, tolerance: f64) -> Convergence {
        let ratio = rotation_angle.max(error / self.last);
        self.count += 1;
        self.last = error;
        if error <= tolerance {
            Convergence::Converged
        } else if ratio <= 0.5 && self.count < MAX_ITERATIONS {
            Convergence::Improving
        } else {
            Convergence::Stalled
        }
    }
}
