//! Joint coordinates on the kinematic tree: kinematics, articulated dynamics, response to forces.

// Indices run over several arrays at once here: bodies, their parents, triangular factors.
#![allow(clippy::needless_range_loop)]

mod advance;
pub mod articulated;
mod balance;
pub mod displaced;
pub mod flight;
mod free_motion;
pub mod kinematics;
mod place;
pub mod response;
mod rigid;
pub mod root;
mod sticking;
mod tension;
pub mod trigonometry;
mod velocity_control;
mod velocity_forces;

use std::ops::Range;

use nalgebra::Vector3;

use super::CoordinateSystem;
use super::outcome::StepOutcome;
use crate::model::wide::Lanes;
use crate::model::{Body, DofKind, Model};
use crate::scene::{DrivePlan, Feedforward, StepPlan};
use crate::sim::bodies::Bodies;
use crate::sim::command::Command;
use crate::sim::convergence::{Convergence, FixedPoint};
use crate::sim::failure::Failure;
use crate::sim::per_body::{Forces, Motions, PerBody};
use crate::sim::rows::Rows;
use crate::sim::spatial::SpatialForce;
use crate::sim::step_data::StepData;
use articulated::Articulated;
use displaced::Displaced;
use flight::Flight;
use kinematics::moment_arms;
use rigid::RigidCharacter;

/// Joint coordinates, and what they compute in a step.
///
/// B is the number of bodies, J of joints and L of loops. Each field names, in parentheses, the method that fills it. Spatial
/// quantities are along the world axes about the common point.
#[derive(Debug, Clone)]
pub struct ReducedCoordinates {
    /// The factorised mass matrix. (factorise)
    articulated: Articulated,
    /// J joint accelerations without rows, rad/s² or m/s². (free_motion)
    acceleration: Vec<f64>,
    /// Greatest rotation angle of a body in the step, rad. (place)
    rotation_angle: f64,
    /// Whether a body rotates so fast that energy in flight has to be looked after. (refuse)
    whirls: bool,
    /// The kinetic energy against the centre of mass that a whirl in flight ends the step with, J. (advance)
    pub(in crate::sim) energy: Option<f64>,
    /// The bodies of the state that a step in flight began from or ended in. (place, advance)
    pub(in crate::sim) flight: Flight,
    /// The character half a step away. (shorter_step)
    displaced: Displaced,
    /// J: what a joint's displacement counts, 1 for a rotation and 1/ℓ for a translation, 1/m. (new)
    per_unit: Vec<f64>,
    /// J moment arms, m: the distance from the joint to the farthest of its body's centre of mass and of the next
    /// joints; 0 for a prismatic joint. (new)
    moment_arms: Vec<f64>,
    /// B forces that bodies transmit to their parents, N. (joint_tensions)
    transmitted_force: PerBody<Vector3<f64>, 3>,
    /// L wrenches that the loops' joints transmit from their first to their second body. (joint_tensions)
    loops: Vec<SpatialForce>,
    /// B wrenches that bodies transmit to their parents. (sticking_torques)
    wrenches: Forces,
    /// The rigid character of the feedforward pass, if the plan asks for it and the joints are independent. (feedforward)
    control: Option<RigidCharacter>,
}

impl ReducedCoordinates {
    /// For `model` as `plan` steps it.
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let bodies = model.bodies.len();
        let feedforward = plan.feedforward();
        let rigid = feedforward != Feedforward::None && model.joints_are_independent();
        Self {
            articulated: Articulated::new(model),
            acceleration: vec![0.0; model.joint_count()],
            rotation_angle: 0.0,
            whirls: false,
            energy: None,
            flight: Flight::new(model),
            displaced: Displaced::new(model),
            per_unit: per_unit(model, plan),
            moment_arms: moment_arms(model),
            transmitted_force: PerBody::new(model, Vector3::zeros()),
            loops: vec![SpatialForce::ZERO; model.loops.len()],
            wrenches: PerBody::new(model, SpatialForce::ZERO),
            control: rigid.then(|| RigidCharacter::new(bodies)),
        }
    }
}

impl CoordinateSystem for ReducedCoordinates {
    const JOINTS_BY_ROWS: bool = false;

    #[inline(always)] // compiled for the processor of `step`
    fn place(&mut self, data: &mut StepData<'_>, _: Command<'_>) -> Result<Option<StepOutcome>, Failure> {
        Ok(self.begin(data))
    }

    fn predict_mean(&mut self, data: &mut StepData<'_>) {
        self.predict(data);
    }

    #[inline(always)] // compiled for the processor of `step`
    fn correct_mean(&mut self, data: &mut StepData<'_>, iteration: &mut FixedPoint) -> Convergence {
        self.correct(data, iteration)
    }

    fn factorise(&mut self, data: &mut StepData<'_>) -> Result<(), Failure> {
        self.factorise_under_loads(data)
    }

    fn free_motion(&mut self, data: &mut StepData<'_>) {
        self.free_velocities(data);
    }

    fn feedforward(&mut self, data: &mut StepData<'_>, drive: &DrivePlan) -> Result<bool, Failure> {
        self.velocity_control(data, drive)
    }

    fn foresee(&self, _: &mut StepData<'_>) {
        // The free motion shows them.
    }

    fn of_bodies(
        &self,
        model: &Model,
        bodies: &Bodies,
        body: usize,
        other: Option<usize>,
        forces: &[SpatialForce],
        numbers: &mut Vec<Lanes>,
    ) -> Range<usize> {
        response::of_bodies(model, bodies, &self.articulated, body, other, forces, numbers)
    }

    fn of_joint(
        &self,
        model: &Model,
        bodies: &Bodies,
        joint: usize,
        numbers: &mut Vec<Lanes>,
    ) -> Range<usize> {
        response::of_joint(model, bodies, &self.articulated, joint, numbers)
    }

    fn hold_together(&self, data: &StepData<'_>, rows: &mut Rows, mut along: impl FnMut(&mut Rows, usize)) {
        // Nothing can come apart.
        (0..data.model.joint_count()).for_each(|joint| along(rows, joint));
    }

    fn rows_elsewhere(&self) -> Option<&Rows> {
        None
    }

    fn respond(
        &self,
        model: &Model,
        bodies: &Bodies,
        half: &[f64],
        rates: &mut [f64],
        changes: &mut Motions,
    ) {
        response::finish(model, bodies, &self.articulated, half, rates, changes);
    }

    fn sticking_torques(&mut self, data: &mut StepData<'_>) {
        self.stick(data);
    }

    #[inline(always)] // compiled for the processor of `step`
    fn judge(&mut self, data: &mut StepData<'_>) -> Option<StepOutcome> {
        let refused = self.refuse(data);
        if refused.is_none() {
            self.joint_tensions(data);
        }
        refused
    }

    fn advance(&mut self, data: &mut StepData<'_>) {
        self.move_positions(data);
    }
}

/// What a displacement of each joint counts in units of the character.
fn per_unit(model: &Model, plan: &StepPlan) -> Vec<f64> {
    let of = |body: &Body| match body.dof {
        DofKind::Revolute => 1.0,
        DofKind::Prismatic => 1.0 / plan.units.length,
    };
    model.bodies.iter().skip(1).map(of).collect()
}
