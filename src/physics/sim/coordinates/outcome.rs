//! How a step in either coordinates ends.

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepOutcome {
    /// The state is that after the step.
    Completed,
    /// A body turns or swings too fast for the step. The state's positions may have moved, its
    /// velocities not.
    TooFast {
        /// Index of the body.
        body: usize,
        /// Longest step that could follow it, s.
        longest: f64,
    },
    /// The step would make energy or drive what touches into the ground. The state is as after
    /// [`TooFast`](StepOutcome::TooFast).
    TooCoarse {
        /// Longest step that is likely not to, s.
        longest: f64,
    },
}
