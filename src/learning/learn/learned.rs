//! The result of learning.

use super::behaviour::Behaviour;
use super::generation::Generation;
use super::parameters::Parameters;
use super::stop::StopReason;

/// The result of learning.
#[derive(Debug, Clone, PartialEq)]
pub struct Learned {
    /// Why the search ended.
    pub ended: StopReason,
    /// The fittest behaviour; `None` when none was found that stays upright through the continuous check.
    pub best: Option<Behaviour>,
    /// The learning curve: one point a generation, in order.
    pub curve: Vec<Generation>,
    /// The parameters that were used, defaults filled in.
    pub parameters: Parameters,
}
