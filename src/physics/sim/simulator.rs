//! The simulator: a model, a step plan, a state and a workspace.

use std::sync::Arc;

use nalgebra::{Isometry3, Point3};

use super::contact::Contact;
use super::coordinates::maximal::MaximalCoordinates;
use super::coordinates::reduced::ReducedCoordinates;
use super::diagnostics;
use super::energy::Energy;
use super::lcp::SolverWork;
use super::momentum::Momentum;
use super::rows;
use super::state::State;
use super::step_control::StepControl;
use super::step_record::StepRecord;
use super::step_totals::StepTotals;
use super::workspace::Workspace;
use crate::model::Model;
use crate::scene::{Coordinates, StepPlan};

/// A character in a scene, stepped through time.
#[derive(Debug, Clone)]
pub struct Simulator {
    pub(super) model: Arc<Model>,
    pub(super) plan: Arc<StepPlan>,
    pub(super) state: State,
    pub(super) work: Workspace,
    /// The coordinates that the plan chose.
    pub(super) system: ChosenCoordinates,
    pub(super) step_control: StepControl,
    /// Whether the state was given from outside and no step has looked at it.
    pub(super) unchecked: bool,
}

/// The coordinates that a plan chose.
#[derive(Debug, Clone)]
pub(super) enum ChosenCoordinates {
    Reduced(Box<ReducedCoordinates>),
    Maximal(Box<MaximalCoordinates>),
}

impl ChosenCoordinates {
    fn new(model: &Model, plan: &StepPlan) -> Self {
        match plan.accuracy.coordinates {
            Coordinates::Reduced => Self::Reduced(Box::new(ReducedCoordinates::new(model, plan))),
            Coordinates::Maximal => Self::Maximal(Box::new(MaximalCoordinates::new(model, plan))),
        }
    }
}

impl Simulator {
    /// The model that `plan` was compiled for, in the plan's scene, starting from `state` (made for this model).
    pub fn new(plan: Arc<StepPlan>, state: State) -> Self {
        let model = plan.model.clone();
        let work = Workspace::new(&model, &plan);
        let step_control = StepControl::new(&model, &plan);
        let system = ChosenCoordinates::new(&model, &plan);
        Self { model, plan, state, work, system, step_control, unchecked: true }
    }

    /// The model.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The step plan.
    pub fn plan(&self) -> &Arc<StepPlan> {
        &self.plan
    }

    /// The present state.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// Continues from `state`, which is copied without allocating.
    pub fn set_state(&mut self, state: &State) {
        self.state.clone_from(state);
        self.unchecked = true;
    }

    /// Torques of the actuators, N m or N, one a joint: the means over the last step.
    pub fn torques(&self) -> &[f64] {
        self.step_control.totals.of_substeps().map_or(&self.work.drives.torque, StepTotals::torques)
    }

    /// Torques of dry friction, N m or N, one a joint: those of the last substep.
    pub fn joint_friction(&self) -> &[f64] {
        &self.state.memory.dry_friction
    }

    /// Residual of the last step's complementarity problem, m/s or rad/s (see [`lcp::residual`](super::lcp::residual())); the greatest if the
    /// step was computed in several substeps.
    pub fn residual(&self) -> f64 {
        self.step_control.totals.of_substeps().map_or(self.work.problem.residual, StepTotals::residual)
    }

    /// How often new velocities have been computed since this simulator was made: once a step where the mean
    /// velocity is predicted well, more often elsewhere and in steps of several substeps. A measure of work that does not
    /// depend on the machine.
    pub fn evaluations(&self) -> u64 {
        self.work.evaluations
    }

    /// What the solver has done since this simulator was made.
    pub fn solver_work(&self) -> SolverWork {
        self.work.problem.solver.work
    }

    /// Number of substeps computed since this simulator was made, refused ones included.
    pub fn substeps(&self) -> u64 {
        self.step_control.substeps
    }

    /// What the steps since this simulator was made took, and what they left unsolved. A step that failed is not among them.
    pub fn record(&self) -> &StepRecord {
        &self.step_control.record
    }

    /// What each row of the last step's complementarity problem belonged to, in the order of the rows.
    pub fn rows(&self) -> &[rows::RowOwner] {
        &self.work.problem.rows.owner
    }

    /// Greatest distance by which a joint is outside its range of motion, rad or m.
    pub fn limit_violation(&self) -> f64 {
        let outside = self
            .model
            .limits
            .iter()
            .zip(&self.state.angles)
            .map(|(limit, angle)| limit.map_or(0.0, |[lower, upper]| (lower - angle).max(angle - upper)));
        outside.fold(0.0, f64::max)
    }

    /// Greatest distance (m) or angle (rad) by which the two bodies of a joint or of a closed loop are apart at
    /// the present state. Only loops can come apart in reduced coordinates.
    pub fn joint_separation(&self) -> f64 {
        diagnostics::joint_separation(&self.model, &self.state)
    }

    /// Contacts of the last step that carried force or penetrate, in the order of the model's slots; after a step that was not divided,
    /// those that came with an impact are the last.
    pub fn contacts(&self) -> impl Iterator<Item = Contact> + '_ {
        let totals = self.step_control.totals.of_substeps();
        let whole = totals.is_none().then(|| self.work.contacts(&self.plan));
        totals
            .into_iter()
            .flat_map(StepTotals::contacts)
            .chain(whole.into_iter().flatten())
            .filter(|contact| contact.depth > 0.0 || contact.force.dot(&contact.normal) > 0.0)
    }

    /// Frame of a link of the character in the world, at the present state.
    pub fn link_poses(&self) -> Vec<Isometry3<f64>> {
        diagnostics::link_poses(&self.model, &self.state)
    }

    /// Centre of mass at the present state, world frame, m.
    pub fn center_of_mass(&self) -> Point3<f64> {
        diagnostics::center_of_mass(&self.model, &self.state)
    }

    /// Energy at the present state.
    pub fn energy(&self) -> Energy {
        diagnostics::energy(&self.model, &self.plan, &self.state)
    }

    /// Momentum at the present state.
    pub fn momentum(&self) -> Momentum {
        diagnostics::momentum(&self.model, &self.state)
    }
}
