//! Whether the repeated passes over the forces of velocity converge.

/// Greatest number of passes until then. Each has to halve what is left, or the step is too long.
const MOST_PASSES: usize = 20;

/// Passes over the forces of velocity, which depend on the new velocities that they help to make.
#[derive(Debug)]
pub(super) struct Passes {
    count: usize,
    /// By how much the last pass was off, rad or m a step.
    last: f64,
}

/// What a pass leaves to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Left {
    Nothing,
    Something,
    /// The passes do not approach anything.
    Everything,
}

impl Passes {
    /// None so far.
    pub(super) const NONE: Self = Self { count: 0, last: f64::INFINITY };

    /// What is left after a pass whose mean was off by `change`, where no more than `settled` may be. The next one
    /// will be off by about the share of it that a body turns in the step, `turn` (rad).
    pub(super) fn left(&mut self, change: f64, turn: f64, settled: f64) -> Left {
        let share = turn.max(change / self.last);
        self.count += 1;
        self.last = change;
        if change <= settled {
            Left::Nothing
        } else if share <= 0.5 && self.count < MOST_PASSES {
            Left::Something
        } else {
            Left::Everything
        }
    }
}
