//! When a step is divided or refused: every threshold, and what dividing a step has to keep.

use super::account::Account;
use super::state::State;
use crate::model::Model;
use crate::scene::StepPlan;

/// Greatest number of parts that a step is divided into.
pub const MOST_PARTS: f64 = 4096.0;

/// Part of the aim at which the next part's error is put, so that most parts are not computed twice.
pub const SAFETY: f64 = 0.9;

/// Bounds on how much longer the next part may be than the last.
pub const GROWTH: [f64; 2] = [0.2, 4.0];

/// How much longer a part may be than the one before it after a part would have made energy.
pub const RELAXATION: f64 = 1.1;

/// Farthest that a body may turn in a step, rad, at its old velocity as at its new one. What turns faster has
/// to be stepped more finely.
pub const FARTHEST_TURN: f64 = 0.3;

/// Farthest that the phase of a body swinging under tension may go in a step, rad: such a swing is explicit
/// in its position, and unstable from 2 on.
pub const FARTHEST_SWING: f64 = 1.0;

/// Where no body would turn farther than this in a whole step, rad, and the solver leaves no velocity that matters,
/// nothing is looked into: paths are straight enough.
pub const STRAIGHT: f64 = 0.02;

/// Share of the kinetic energy that may be made in a second, for each second of the whole step, 1/s²: 1.6 % at steps of
/// 2 ms, and the less the finer the step.
pub const ENERGY_SHARE: f64 = 8.0;

/// Greatest depth that a touch may gain in a step, m.
pub const GREATEST_SINKING: f64 = 2e-4;

/// A part as short as the whole step over this is taken as it is.
pub const FINEST: f64 = 32.0;

/// How much shorter than the step that failed the next trial may be.
pub const SHORTENING: [f64; 2] = [0.2, 0.7];

/// Aimed-at part of what is allowed.
pub const BALANCE_SAFETY: f64 = 0.9;

/// What dividing a step needs to keep in mind.
#[derive(Debug, Clone)]
pub(super) struct Division {
    /// The state before a part.
    pub before: State,
    /// The state before a probe.
    pub probed: State,
    /// Targets at the beginning and at the end of a part, rad or m.
    pub now: Vec<f64>,
    pub next: Vec<f64>,
    /// How many parts have been computed.
    pub parts: u64,
    /// Under error control: whether nothing but a smooth motion of second order has been seen
    /// since the beginning of a part.
    pub smooth: bool,
    /// Under error control: the state before a part, and that after the part taken as a whole.
    pub control: Option<[State; 2]>,
    /// What acted in the parts that were kept, and under error control in those before a part.
    pub account: Account,
    pub accounted: Account,
}

impl Division {
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let joints = model.joint_count();
        let state = || State::new(model);
        Self {
            before: state(),
            probed: state(),
            now: vec![0.0; joints],
            next: vec![0.0; joints],
            parts: 0,
            smooth: false,
            control: plan.accuracy.step_tolerance.map(|_| [state(), state()]),
            account: Account::default(),
            accounted: Account::default(),
        }
    }

    pub fn keep_account(&mut self) {
        self.accounted.clone_from(&self.account);
    }

    pub fn take_account_back(&mut self) {
        self.account.clone_from(&self.accounted);
    }
}
