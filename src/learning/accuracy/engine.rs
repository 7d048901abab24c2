//! Who takes the steps of a trial.

use std::sync::Arc;

use super::table::Engine;
use crate::accuracy::rapier::Rapier;
use crate::scenario::Setup;
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::StepPlan;
use gaitwright_physics::sim::{Command, Simulator, State};

/// An engine at one problem.
pub(super) enum Stepper {
    /// This simulator.
    Own {
        simulator: Box<Simulator>,
        /// Evaluations before the last restart.
        before: u64,
    },
    /// rapier's multibodies; made anew at every restart.
    Rapier { model: Arc<Model>, plan: Arc<StepPlan>, rapier: Box<Rapier> },
}

impl Stepper {
    /// `engine` in the scene of `setup`, with steps as `plan` has them.
    ///
    /// # Errors
    /// What the engine cannot do.
    pub fn new(engine: Engine, setup: &Setup, plan: &Arc<StepPlan>) -> Result<Self, String> {
        let model = &setup.model;
        match engine {
            Engine::Gaitwright => {
                let simulator = Simulator::new(plan.clone(), setup.start.clone());
                Ok(Self::Own { simulator: Box::new(simulator), before: 0 })
            }
            Engine::Rapier => {
                let rapier = Rapier::new(model, plan, &setup.start).map_err(|error| error.to_string())?;
                Ok(Self::Rapier { model: model.clone(), plan: plan.clone(), rapier: Box::new(rapier) })
            }
        }
    }

    /// Goes on from `state`.
    ///
    /// # Errors
    /// Why the engine cannot.
    pub fn restart(&mut self, state: &State) -> Result<(), String> {
        match self {
            Self::Own { simulator, before } => {
                simulator.set_state(state);
                *before = simulator.evaluations();
            }
            Self::Rapier { model, plan, rapier } => {
                **rapier = Rapier::new(model, plan, state).map_err(|error| error.to_string())?;
            }
        }
        Ok(())
    }

    /// One step.
    ///
    /// # Errors
    /// Why the simulation cannot go on.
    pub fn step(&mut self, command: Command<'_>) -> Result<(), String> {
        let stepped = match self {
            Self::Own { simulator, .. } => simulator.step(command),
            Self::Rapier { rapier, .. } => rapier.step(command),
        };
        stepped.map_err(|failure| failure.to_string())
    }

    /// The present state.
    pub fn state(&self) -> &State {
        match self {
            Self::Own { simulator, .. } => simulator.state(),
            Self::Rapier { rapier, .. } => rapier.state(),
        }
    }

    /// This simulator, if it is the engine: another does not tell what it computes within a step.
    pub fn own(&self) -> Option<&Simulator> {
        match self {
            Self::Own { simulator, .. } => Some(simulator),
            Self::Rapier { .. } => None,
        }
    }

    /// How often new velocities have been computed since the last restart.
    pub fn evaluations(&self) -> Option<u64> {
        match self {
            Self::Own { simulator, before } => Some(simulator.evaluations() - before),
            Self::Rapier { .. } => None,
        }
    }
}
