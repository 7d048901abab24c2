//! One step of time.

use super::lcp::Status;
use super::reduced::root::RootFreedom;
use super::{Command, Failure, Simulator, reduced};
use crate::model::Model;
use crate::scene::StepPlan;
use crate::sim::State;

impl Simulator {
    /// One step of the plan's step length (Tokizaki & Hasegawa eqs. 8-9 with the mixed LCP of
    /// eqs. 25-27). Allocates nothing once it is warm.
    ///
    /// # Errors
    /// [`Failure`] when nothing resists an acceleration, when the problem has no solution, or when a
    /// number became non-finite. The state is then that of the failed step and must not be gone on from.
    ///
    /// # Panics
    /// If a slice of `command` does not have one number for each joint.
    pub fn step(&mut self, command: Command<'_>) -> Result<(), Failure> {
        let joints = self.model.joint_count();
        match command {
            Command::Passive => {}
            Command::Torque(torque) => assert_eq!(torque.len(), joints, "one torque a joint"),
            Command::Track { now, next } => {
                assert_eq!((now.len(), next.len()), (joints, joints), "one target a joint");
            }
        }
        let step = self.plan.step();
        reduced::stages::step(&self.model, &self.plan, &mut self.state, &mut self.work, command, step)
    }
}

/// In which directions the plan leaves the root of `model` free.
pub(super) fn root_freedom(model: &Model, plan: &StepPlan) -> RootFreedom {
    match (model.fixed_base, plan.trunk_rotation_lock) {
        (true, _) => RootFreedom::Bolted,
        (false, true) => RootFreedom::Translating,
        (false, false) => RootFreedom::Free,
    }
}

/// The failure that goes with a solver's `status`, if its forces cannot be used.
pub(super) fn fail_unless_usable(status: Status, model: &Model, state: &State) -> Result<(), Failure> {
    let cause = match status {
        Status::Solved | Status::IterationLimit | Status::Singular => return Ok(()),
        Status::Ray => "the complementarity problem has no solution that pivoting could find",
        Status::Malformed => "the complementarity problem is malformed",
        Status::NotFinite => "a number of the complementarity problem is not finite",
        Status::Unsupported => "the solver does not handle this problem",
    };
    Err(Failure {
        time: state.time,
        place: format!("character {}", model.character.name),
        cause: cause.into(),
    })
}
