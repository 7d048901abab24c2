//! What every stage of a step works on.

use super::root_freedom::RootFreedom;
use super::state::State;
use super::workspace::Workspace;
use crate::model::Model;
use crate::scene::{Feedforward, Integrator, StepPlan};

/// What every stage of a step works on, whatever the coordinates.
pub struct StepData<'a> {
    /// The character.
    pub model: &'a Model,
    /// What the step computes.
    pub plan: &'a StepPlan,
    /// The state before the step; in Moreau and Jean's step with the positions of its midpoint.
    pub state: &'a mut State,
    /// What the stages before this one found.
    pub work: &'a mut Workspace,
    /// In which directions the root may accelerate.
    pub root_freedom: RootFreedom,
    /// Length of the step, s.
    pub step: f64,
    /// Time at its beginning, s.
    pub time: f64,
    /// Whether positions are those of the step's midpoint while it is computed (Moreau and Jean).
    pub midpoint: bool,
    /// The body that rotates fastest before the step. (place)
    pub fastest: usize,
}

impl<'a> StepData<'a> {
    /// A step of `step` seconds.
    pub fn new(
        model: &'a Model,
        plan: &'a StepPlan,
        state: &'a mut State,
        work: &'a mut Workspace,
        step: f64,
    ) -> Self {
        let root_freedom = RootFreedom::new(model, plan);
        let midpoint = plan.accuracy.integrator == Integrator::MoreauJean;
        let time = state.time;
        Self { model, plan, state, work, root_freedom, step, time, midpoint, fastest: 0 }
    }

    /// Whether the plan's drive has feedforward torques.
    pub fn feeds_forward(&self) -> bool {
        self.plan.feedforward() != Feedforward::None
    }
}
