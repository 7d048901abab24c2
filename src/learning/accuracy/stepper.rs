//! One interface to the engines that are compared.

use std::sync::Arc;

use super::engine::Engine;
use super::rapier::{Rapier, Unsupported};
use crate::scenario::ScenarioSetup;
use gaitwright_physics::model::Model;
use gaitwright_physics::scene::StepPlan;
use gaitwright_physics::sim::{Command, Failure, Simulator, State};

/// An engine with a simulation of one problem in it.
pub(super) enum Stepper {
    /// This simulator.
    Own {
        simulator: Box<Simulator>,
        /// Number of evaluations before the last restart.
        before: u64,
    },
    /// rapier's multibodies; built anew at every restart.
    Rapier { model: Arc<Model>, plan: Arc<StepPlan>, rapier: Box<Rapier> },
}

impl Stepper {
    /// `engine` in the scene of `setup`, with steps as `plan` has them.
    ///
    /// # Errors
    /// What the scene asks for and the engine does not do.
    pub fn new(engine: Engine, setup: &ScenarioSetup, plan: &Arc<StepPlan>) -> Result<Self, Unsupported> {
        let model = &setup.model;
        match engine {
            Engine::Gaitwright => {
                let simulator = Simulator::new(plan.clone(), setup.start.clone());
                Ok(Self::Own { simulator: Box::new(simulator), before: 0 })
            }
            Engine::Rapier => {
                let rapier = Rapier::new(model, plan, &setup.start)?;
                Ok(Self::Rapier { model: model.clone(), plan: plan.clone(), rapier: Box::new(rapier) })
            }
        }
    }

    /// Continues from `state`.
    ///
    /// # Errors
    /// What `state` needs and the engine does not do.
    pub fn restart(&mut self, state: &State) -> Result<(), Unsupported> {
        match self {
            Self::Own { simulator, before } => {
                simulator.set_state(state);
                *before = simulator.evaluations();
            }
            Self::Rapier { model, plan, rapier } => {
                **rapier = Rapier::new(model, plan, state)?;
            }
        }
        Ok(())
    }

    /// One step.
    ///
    /// # Errors
    /// Why the simulation cannot continue.
    pub fn step(&mut self, command: Command<'_>) -> Result<(), Failure> {
        match self {
            Self::Own { simulator, .. } => simulator.step(command),
            Self::Rapier { rapier, .. } => rapier.step(command),
        }
    }

    /// The present state.
    pub fn state(&self) -> &State {
        match self {
            Self::Own { simulator, .. } => simulator.state(),
            Self::Rapier { rapier, .. } => rapier.state(),
        }
    }

    /// Steps since the stepper was made whose problem was not solved, if the engine reports it.
    pub fn unsolved_steps(&self) -> Option<u64> {
        self.own().map(|simulator| simulator.record().unsolved_steps)
    }

    /// This simulator, if it is the engine; others do not report what they compute within a step.
    pub fn own(&self) -> Option<&Simulator> {
        match self {
            Self::Own { simulator, .. } => Some(simulator),
            Self::Rapier { .. } => None,
        }
    }

    /// How often new velocities have been computed since the last restart; `None` where the engine does not report it.
    pub fn evaluations(&self) -> Option<u64> {
        match self {
            Self::Own { simulator, before } => Some(simulator.evaluations() - before),
            Self::Rapier { .. } => None,
        }
    }
}
