//! Maximal coordinates: the system as Tokizaki & Hasegawa write it.
//!
//! Every body has six velocities of its own, the mass matrix is block-diagonal, and every joint is rows e
//! beside those of contacts, limits and drives (eqs. 5-27). A body's velocities v are those of its centre of
//! mass and its rotation, its forces f its weight and −ω × I ω.
//!
//! **What the rows read.** The paper's joint row asks J\[t\] v⁺ = 0. Joint coordinates ask that the
//! constraint's second derivative vanish, J v̇ = −J̇ v, so that J v⁺ = −h J̇ v. A row of a contact, in joint
//! coordinates, reads the velocity that the new joint rates give the body in its *old* place,
//! V_i = V_0 + Σ S_j q̇_j⁺. With spatial accelerations a_i = a_parent + S_i q̈_i + V_parent × S_i q̇_i (Featherstone
//! 2008, chapter 5) that velocity is
//!
//! V_i⁺ = V_i + h a_i + h (0; ω_0 × v_0) − h D_i,  D_i = D_parent + V_parent × S_i q̇_i,  D_0 = 0,
//!
//! v_0 being the velocity of the root's origin, while a step of the body by itself gives it
//! V_i + h a_i + h (0; ω_i × v_i) with the velocity v_i of its centre of mass. So with the *row correction*
//!
//! C_i = h (0; ω_0 × v_0 − ω_i × v_i) − h D_i
//!
//! added to the velocity that every row reads, Tᵀ (V_child − V_parent) = 0 is the joint's row with the bias
//! −h J̇ v, and contacts, limits, drives and the root read what they read in joint coordinates: the new joint rates
//! are the same to rounding. Without it (`joint_bias: paper`) the rows are the paper's.
//!
//! **Velocity-dependent forces.** The paper's f\[t\] is that of the old velocities. Joint coordinates take those forces,
//! and the row correction with them, at the mean of old and new velocities, because at the old ones alone they add
//! energy to every rotation (see `sim/step.rs`). To give the same motion, both coordinates need the same
//! means, and so the means are those of a step in joint coordinates, which a forecast computes
//! ahead on a copy of the state. The paper's own rows take the old velocities as the equations stand. In either case
//! the forecast decides whether a body rotates or a pendulum oscillates too fast for the step, and which limits are near.

mod advance;
mod forecast;
mod free_motion;
pub mod kinematics;
mod response;
mod rows;

use std::ops::Range;

use super::CoordinateSystem;
use super::outcome::StepOutcome;
use crate::model::Model;
use crate::model::wide::Lanes;
use crate::scene::{DrivePlan, StepPlan};
use crate::sim::bodies::Bodies;
use crate::sim::command::Command;
use crate::sim::convergence::{Convergence, FixedPoint};
use crate::sim::failure::Failure;
use crate::sim::per_body::Motions;
use crate::sim::rows::Rows;
use crate::sim::spatial::{SpatialForce, SpatialMotion};
use crate::sim::step_data::StepData;
use forecast::Forecast;
use response::BodyFactor;

/// Maximal coordinates, and what they compute in a step: one entry a body.
#[derive(Debug, Clone)]
pub struct MaximalCoordinates {
    /// Factors of the bodies' inertias. (new)
    factors: Vec<BodyFactor>,
    /// C / h of every body: the velocity that the rows read in addition to the body's own, by the length of the step. (predict_mean)
    row_correction: Vec<SpatialMotion>,
    /// The step in joint coordinates. (place)
    forecast: Forecast,
}

impl MaximalCoordinates {
    /// For `model` as `plan` steps it.
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let factor = |(index, body)| {
            if index == 0 && model.fixed_base { BodyFactor::FIXED } else { BodyFactor::new(body) }
        };
        Self {
            factors: model.bodies.iter().enumerate().map(factor).collect(),
            row_correction: vec![SpatialMotion::ZERO; model.bodies.len()],
            forecast: Forecast::new(model, plan),
        }
    }
}

impl CoordinateSystem for MaximalCoordinates {
    const JOINTS_BY_ROWS: bool = true;

    fn place(
        &mut self,
        data: &mut StepData<'_>,
        command: Command<'_>,
    ) -> Result<Option<StepOutcome>, Failure> {
        let ahead = self.forecast.run(data, command)?;
        if ahead != StepOutcome::Completed {
            return Ok(Some(ahead));
        }
        self.kinematics(data);
        Ok(None)
    }

    fn predict_mean(&mut self, data: &mut StepData<'_>) {
        self.take_mean_velocities(data);
        self.correct_rows(data);
    }

    fn correct_mean(&mut self, _: &mut StepData<'_>, _: &mut FixedPoint) -> Convergence {
        // The forecast's have converged.
        Convergence::Converged
    }

    fn factorise(&mut self, _: &mut StepData<'_>) -> Result<(), Failure> {
        // The bodies' factors never change, and loads have rows.
        Ok(())
    }

    fn free_motion(&mut self, data: &mut StepData<'_>) {
        self.free_velocities(data);
    }

    fn feedforward(&mut self, data: &mut StepData<'_>, _: &DrivePlan) -> Result<bool, Failure> {
        // Where loops or passive joints leave some velocities open, the velocity-dependent forces of the prescribed motion
        // have to be found along with it, which the forecast has done.
        let known = !data.model.joints_are_independent();
        if known {
            data.work.feedforward.torque.copy_from_slice(&self.forecast.work.feedforward.torque);
        }
        Ok(known)
    }

    fn foresee(&self, data: &mut StepData<'_>) {
        let ahead = &self.forecast.work;
        data.work.drives.actuators.copy_from_slice(&ahead.drives.actuators);
        data.work.problem.near_limit.copy_from_slice(&ahead.problem.near_limit);
    }

    fn of_bodies(
        &self,
        _: &Model,
        bodies: &Bodies,
        body: usize,
        other: Option<usize>,
        forces: &[SpatialForce],
        numbers: &mut Vec<Lanes>,
    ) -> Range<usize> {
        response::of_bodies(&self.factors, bodies, body, other, forces, numbers)
    }

    fn of_joint(
        &self,
        model: &Model,
        bodies: &Bodies,
        joint: usize,
        numbers: &mut Vec<Lanes>,
    ) -> Range<usize> {
        let wrench = response::along(&bodies.at(joint + 1));
        let parent = Some(model.bodies[joint + 1].parent);
        response::of_bodies(&self.factors, bodies, joint + 1, parent, &[wrench], numbers)
    }

    fn hold_together(&self, data: &StepData<'_>, rows: &mut Rows, mut along: impl FnMut(&mut Rows, usize)) {
        // From the leaves to the root, an order in which their factor fills in least.
        for joint in (0..data.model.joint_count()).rev() {
            self.joint(data, rows, joint);
            along(rows, joint);
        }
        self.lock(data, rows);
    }

    fn rows_elsewhere(&self) -> Option<&Rows> {
        Some(&self.forecast.work.problem.rows)
    }

    fn respond(
        &self,
        model: &Model,
        bodies: &Bodies,
        half: &[f64],
        rates: &mut [f64],
        changes: &mut Motions,
    ) {
        response::finish(&self.factors, bodies, half, changes);
        for (joint, rate) in rates.iter_mut().enumerate() {
            *rate += response::rate(model, bodies, joint, changes);
        }
    }

    fn sticking_torques(&mut self, _: &mut StepData<'_>) {
        // No joint sticks: dry friction has rows.
    }

    fn judge(&mut self, data: &mut StepData<'_>) -> Option<StepOutcome> {
        self.take_judgement(data);
        None
    }

    fn advance(&mut self, data: &mut StepData<'_>) {
        self.move_bodies(data);
    }
}
