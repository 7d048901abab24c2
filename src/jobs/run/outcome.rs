//! What comes of a run.

use gaitwright_learning::accuracy::AccuracyCheck;
use gaitwright_learning::learn::StopReason;
use gaitwright_physics::motion::Metrics;

/// What came of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunOutcome {
    /// Why the learning stopped.
    pub ended: StopReason,
    /// Figures of the motion found, or why there is none.
    pub motion: Result<Metrics, Unsuccessful>,
    /// Whether that motion keeps the tolerance that was asked for, where one was.
    pub accuracy_check: Option<AccuracyCheck>,
}

/// Why a run that came to its end has no motion to show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsuccessful {
    /// It was cancelled while the standing pose or an accuracy was looked for.
    #[error("called off before the learning began")]
    NotBegun,
    /// No behaviour passed the learner's acceptance test.
    #[error("nothing was learned that keeps the character upright; more time or generations may help")]
    NothingLearned,
    /// The same, of a character for which no pose was found in which it stands.
    #[error(
        "nothing was learned that keeps the character upright, and no pose was found in which it stands (`standing` in the \
         report): look at its motors, at the ranges of its joints and at what is around it"
    )]
    NothingStands,
    /// It was cancelled, and the check took longer than it may then take.
    #[error("called off before it was checked what was learned")]
    NotChecked,
    /// The character fell in the check.
    #[error("the character fell before it had gone round its loop once")]
    Fell,
    /// It stayed where it was, or went the other way.
    #[error(
        "the character does not travel along the direction that was asked for; more time or generations may help"
    )]
    DoesNotTravel,
}
