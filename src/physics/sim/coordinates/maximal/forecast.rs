//! The step in joint coordinates that precedes each step in maximal coordinates.

use crate::model::Model;
use crate::scene::{Accuracy, Coordinates, StepPlan};
use crate::sim::command::Command;
use crate::sim::coordinates::outcome::StepOutcome;
use crate::sim::coordinates::reduced::ReducedCoordinates;
use crate::sim::failure::Failure;
use crate::sim::state::State;
use crate::sim::step::step;
use crate::sim::step_data::StepData;
use crate::sim::workspace::Workspace;

/// A step in joint coordinates on a copy of the state.
#[derive(Debug, Clone)]
pub struct Forecast {
    /// The copy, after the step.
    pub state: State,
    /// Scratch memory of that step: its bodies move with the mean velocities.
    pub work: Workspace,
    system: ReducedCoordinates,
}

impl Forecast {
    /// For `model` as `plan` steps it.
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let accuracy = Accuracy { coordinates: Coordinates::Reduced, ..plan.accuracy };
        let reduced = StepPlan { accuracy, ..plan.clone() };
        Self {
            state: State::new(model),
            work: Workspace::new(model, &reduced),
            system: ReducedCoordinates::new(model, &reduced),
        }
    }

    /// The kinetic energy against the centre of mass that a whirl in flight ends the step with, J.
    pub fn energy(&self) -> Option<f64> {
        self.system.energy
    }

    /// Computes the step of `data`.
    ///
    /// # Errors
    /// As [`Simulator::step`](crate::sim::Simulator::step).
    pub fn run(&mut self, data: &StepData<'_>, command: Command<'_>) -> Result<StepOutcome, Failure> {
        let Self { state, work, system } = self;
        state.clone_from(data.state);
        work.feedforward.reference.copy_from_slice(&data.work.feedforward.reference);
        step(data.model, data.plan, state, work, system, command, data.step)
    }
}
