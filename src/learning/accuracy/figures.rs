//! What is measured of a setting, and how its trial can end.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::fault::{Divergence, LeftOutReason};
use super::spread::ErrorSpread;

/// What was measured of a setting. Means and extremes are over all marks, that is, all states that were compared
/// with true ones; what is about single steps is the extreme over all steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Figures {
    /// Mean error, in the unit of the subject.
    pub error: f64,
    /// How the errors are spread over the marks, in the unit of the subject.
    pub spread: ErrorSpread,
    /// Computing time of the steps alone for a simulated second, s: the sum over the pieces of the shortest of
    /// several repeats. 0 for a trial that was not timed.
    pub seconds: f64,
    /// How often new velocities were computed for a simulated second, 1/s: a measure of work that does not depend
    /// on the machine or its load; `null` where the engine does not report it.
    pub evaluations: Option<f64>,
    /// Mean difference of the energy from the true one, J.
    pub energy_error: f64,
    /// Mean difference of the linear momentum from the true one, kg m/s.
    pub momentum_error: f64,
    /// Greatest penetration, m; `null` where the engine does not report it.
    pub penetration: Option<f64>,
    /// Greatest distance of a joint from its range of motion, rad or m.
    pub limit_overshoot: f64,
    /// Greatest distance (m) or angle (rad) by which the two bodies of a joint or of a closed loop are apart. In
    /// joint coordinates only loops can open; `null` where the engine does not report it.
    pub joint_separation: Option<f64>,
    /// Greatest residual of the complementarity problem, m/s or rad/s; `null` where the engine has none.
    pub residual: Option<f64>,
    /// Steps that went on with forces that do not solve their complementarity problem; `null` where the engine does not report
    /// it.
    pub unsolved_steps: Option<u64>,
}

impl Figures {
    /// Whether every step's problem was solved, as far as the engine says. A setting of which one was not is not recommended,
    /// however small its error on the pieces that were tried.
    pub fn is_solved(&self) -> bool {
        self.unsolved_steps.unwrap_or(0) == 0
    }
}

/// How the trial of a setting ended.
#[derive(Debug, Clone, PartialEq)]
pub enum TrialOutcome {
    /// The simulation reached the end of every piece.
    Measured(Figures),
    /// The simulation broke off, or its error grew beyond any use.
    Diverged(Divergence),
    /// The setting does not apply to this problem, or takes too long on it.
    LeftOut(LeftOutReason),
}
