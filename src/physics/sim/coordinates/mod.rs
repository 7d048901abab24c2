//! The two coordinate systems, a tree of joint coordinates and bodies by themselves, and what differs between them.
//!
//! They differ in where bodies are placed and how they move freely, in how a row is half-solved, in the response to the rows'
//! forces, and in how positions advance. Rows, contacts, drives, friction, the complementarity problem and the order of the stages
//! are the same in both (see `sim/step.rs`).

pub mod maximal;
pub(super) mod outcome;
pub mod reduced;

use std::ops::Range;

use super::bodies::Bodies;
use super::command::Command;
use super::convergence::{Convergence, FixedPoint};
use super::failure::Failure;
use super::per_body::Motions;
use super::rows::Rows;
use super::spatial::SpatialForce;
use super::step_data::StepData;
use crate::model::Model;
use crate::model::wide::Lanes;
use crate::scene::DrivePlan;
use outcome::StepOutcome;

/// What differs between coordinate systems. A system keeps what it computes in a step, and what it finds for the stages that are
/// the same in all it puts into the workspace.
pub trait CoordinateSystem {
    /// Whether joints are held together by rows, as is everything that is linear in a joint's velocity. Otherwise it is in
    /// the mass matrix, and poses follow from joint angles.
    const JOINTS_BY_ROWS: bool;

    // Free motion.

    /// Places the bodies and gives them the old velocities. Where the step cannot be as long as it is, the outcome.
    fn place(
        &mut self,
        data: &mut StepData<'_>,
        command: Command<'_>,
    ) -> Result<Option<StepOutcome>, Failure>;

    /// Predicts the mean velocities, at which velocity-dependent forces are taken.
    fn predict_mean(&mut self, data: &mut StepData<'_>);

    /// Compares them with the new velocities, and sets them anew if another iteration is needed.
    fn correct_mean(&mut self, data: &mut StepData<'_>, iteration: &mut FixedPoint) -> Convergence;

    /// The mass matrix under the loads of the joints.
    fn factorise(&mut self, data: &mut StepData<'_>) -> Result<(), Failure>;

    /// Velocities after the step if no row acted.
    fn free_motion(&mut self, data: &mut StepData<'_>);

    /// Offset torques f₀ of `drive`, where the system has a way to them without the rows of
    /// `sim/step/feedforward.rs`; whether it has.
    fn feedforward(&mut self, data: &mut StepData<'_>, drive: &DrivePlan) -> Result<bool, Failure>;

    /// Marks the actuators and the limits that will have rows, as far as the system knows them before it has solved for them.
    fn foresee(&self, data: &mut StepData<'_>);

    // Rows, half-solved.

    /// Half-solves rows of `forces` on body `body`, and the opposite on body `other` if there is one (see [`Rows::push`]).
    fn of_bodies(
        &self,
        model: &Model,
        bodies: &Bodies,
        body: usize,
        other: Option<usize>,
        forces: &[SpatialForce],
        numbers: &mut Vec<Lanes>,
    ) -> Range<usize>;

    /// Half-solves the row of a force along joint `joint`.
    fn of_joint(
        &self,
        model: &Model,
        bodies: &Bodies,
        joint: usize,
        numbers: &mut Vec<Lanes>,
    ) -> Range<usize>;

    /// Adds the rows that hold the character together, if it takes any; `along` adds what a joint has of its own, once for each.
    fn hold_together(&self, data: &StepData<'_>, rows: &mut Rows, along: impl FnMut(&mut Rows, usize));

    /// The rows of this step in other coordinates, where those decide which rows of loops are left out.
    fn rows_elsewhere(&self) -> Option<&Rows>;

    // Response.

    /// The changes of the velocities of `bodies` that belong to the half-solved impulse `half`, into `changes`; those of the joints are
    /// added to `rates`.
    fn respond(&self, model: &Model, bodies: &Bodies, half: &[f64], rates: &mut [f64], changes: &mut Motions);

    /// Torques of dry friction in the joints that stick, at the new velocities.
    fn sticking_torques(&mut self, data: &mut StepData<'_>);

    // Advance.

    /// Whether the new velocities are those of a step that may be kept; where it may not, the outcome.
    fn judge(&mut self, data: &mut StepData<'_>) -> Option<StepOutcome>;

    /// Moves the positions along the velocities of recovery, and gives the state its velocities.
    fn advance(&mut self, data: &mut StepData<'_>);
}
