//! When the learning ends.

/// When the learning ends, unless it is cancelled before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Budget {
    /// After this many generations.
    Generations(u32),
    /// After this time of the wall clock, s.
    Seconds(f64),
    /// Whichever of the two comes first.
    Either {
        /// Most generations.
        generations: u32,
        /// Most time of the wall clock, s.
        seconds: f64,
    },
}

impl Budget {
    /// Most generations, where they are limited.
    pub fn generations(self) -> Option<u32> {
        match self {
            Self::Generations(generations) | Self::Either { generations, .. } => Some(generations),
            Self::Seconds(_) => None,
        }
    }

    /// Most time of the wall clock, where it is limited, s.
    pub fn seconds(self) -> Option<f64> {
        match self {
            Self::Seconds(seconds) | Self::Either { seconds, .. } => Some(seconds),
            Self::Generations(_) => None,
        }
    }

    /// What is left after so many generations and seconds.
    pub fn after(self, generations: u32, seconds: f64) -> Self {
        let fewer = |all: u32| all.saturating_sub(generations);
        let less = |all: f64| (all - seconds).max(0.0);
        match self {
            Self::Generations(all) => Self::Generations(fewer(all)),
            Self::Seconds(all) => Self::Seconds(less(all)),
            Self::Either { generations: most, seconds: longest } => {
                Self::Either { generations: fewer(most), seconds: less(longest) }
            }
        }
    }

    /// Share that is used up after so many generations and seconds, 0 to 1.
    pub fn fraction(self, generations: u32, seconds: f64) -> f64 {
        let generations = self.generations().map(|all| f64::from(generations) / f64::from(all.max(1)));
        let seconds = self.seconds().map(|all| seconds / all);
        generations.into_iter().chain(seconds).fold(0.0, f64::max).clamp(0.0, 1.0)
    }
}
