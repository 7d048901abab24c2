//! How a substep ends, in either coordinates.

/// How a substep ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepOutcome {
    /// The state is that after the substep.
    Completed,
    /// A body rotates, or a pendulum under joint tension oscillates, too fast for the substep. The state's positions may
    /// have moved, its velocities not.
    TooFast {
        /// Index of the body.
        body: usize,
        /// Longest substep that resolves it, s.
        longest: f64,
    },
    /// The substep would create energy or drive a contact into the ground. The state is as after
    /// [`TooFast`](StepOutcome::TooFast).
    TooCoarse {
        /// Longest substep that is likely not to, s.
        longest: f64,
    },
}
