//! The simulator: articulated bodies, contact, joint limits and torque-limited tracking as one
//! linear complementarity problem each step.
//!
//! A [`Simulator`] is a model, a step plan, a state and a workspace; a step is a function of the four
//! ([`Simulator::step`], whose stages stand by name in `reduced/stages` and `maximal/stages.rs`).
//! It allocates nothing once it is warm.
//!
//! Its kernels are free functions that are compiled for AVX2 as well, and the processor decides at run time
//! (`multiversion`). Helpers that would not be compiled along with them by themselves are `inline(always)`. A product and
//! a sum are never fused, so that a kernel gives the same bits with AVX2 as without.

mod account;
pub mod contact;
mod diagnostics;
mod integrate;
pub mod lcp;
mod maximal;
pub mod reduced;
pub mod rows;
pub mod spatial;
mod state;
mod step;
pub mod tracking;
mod workspace;

use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};

use crate::model::Model;
use crate::scene::{Coordinates, StepPlan};
use account::Account;
use contact::Against;
use maximal::Maximal;
use step::Division;
use workspace::Workspace;

pub use state::{Root, State};

/// What the joints are asked to do over one step.
#[derive(Debug, Clone, Copy)]
pub enum Command<'a> {
    /// Nothing.
    Passive,
    /// Given torques, N m or N, one a joint.
    Torque(&'a [f64]),
    /// Targets at the beginning and at the end of the step, rad or m, one a joint. Joints are passive
    /// if the plan has no drive.
    Track {
        /// At the beginning.
        now: &'a [f64],
        /// At the end.
        next: &'a [f64],
    },
}

/// A contact of the last step. Where the step was computed in parts, what follows is that of all parts in which it touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Index of the character's link.
    pub link: usize,
    /// What it touches.
    pub against: Against,
    /// Where, in the world frame, m: of several parts the mean, by how hard they pushed.
    pub position: Point3<f64>,
    /// From what is touched into the link, of unit length.
    pub normal: Vector3<f64>,
    /// On the link, world frame, N: the mean over the step.
    pub force: Vector3<f64>,
    /// Velocity of the link's material point there after the step (or the last part), against that of what it touches,
    /// world frame, m/s.
    pub velocity: Vector3<f64>,
    /// Greatest depth of penetration at the beginning of the step (or of a part), m; negative for a gap.
    pub depth: f64,
}

/// A simulation that cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{cause} at {time} s ({place})")]
pub struct Failure {
    /// End of the step that failed, s.
    pub time: f64,
    /// The body or joint.
    pub place: String,
    /// What happened.
    pub cause: String,
}

/// A character in a scene, stepped through time.
#[derive(Debug, Clone)]
pub struct Simulator {
    model: Arc<Model>,
    plan: Arc<StepPlan>,
    state: State,
    work: Workspace,
    /// What maximal coordinates need besides, where the plan has them.
    maximal: Option<Maximal>,
    division: Division,
}

impl Simulator {
    /// The model that `plan` was compiled for, in the plan's scene, starting from `state` (made for this model).
    pub fn new(plan: Arc<StepPlan>, state: State) -> Self {
        let model = plan.model.clone();
        let work = Workspace::new(&model, &plan);
        let division = Division::new(&model, &plan);
        let maximal =
            (plan.accuracy.coordinates == Coordinates::Maximal).then(|| Maximal::new(&model, &plan));
        Self { model, plan, state, work, maximal, division }
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

    /// Goes on from `state`, which is copied without allocating.
    pub fn set_state(&mut self, state: &State) {
        self.state.clone_from(state);
    }

    /// Torques of the actuators, N m or N, one a joint: the means over the last step.
    pub fn torques(&self) -> &[f64] {
        self.division.account.of_parts().map_or(&self.work.torque, Account::torques)
    }

    /// Residual of the last step's complementarity problem, m/s or rad/s (see [`lcp::residual`]); the greatest if the
    /// step was computed in parts.
    pub fn residual(&self) -> f64 {
        self.division.account.of_parts().map_or(self.work.residual, Account::residual)
    }

    /// How often new velocities have been computed since this simulator was made: once a step where the forces of
    /// velocity are guessed well, more often elsewhere and in steps in parts. A measure of work that no machine disturbs.
    pub fn evaluations(&self) -> u64 {
        self.work.evaluations
    }

    /// In how many parts steps have been computed since this simulator was made, those that were taken back included.
    pub fn parts(&self) -> u64 {
        self.division.parts
    }

    /// What each row of the last step's complementarity problem belonged to, in the order of the rows.
    pub fn rows(&self) -> &[rows::Owner] {
        &self.work.rows.owner
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

    /// Contacts of the last step that carried force or penetrate, in the order of the model's slots.
    pub fn contacts(&self) -> impl Iterator<Item = Contact> + '_ {
        let account = self.division.account.of_parts();
        let whole = account.is_none().then(|| self.work.contacts(&self.plan));
        account
            .into_iter()
            .flat_map(Account::contacts)
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

pub use diagnostics::{Energy, Momentum, center_of_mass, check_finite, energy, link_poses, momentum};
