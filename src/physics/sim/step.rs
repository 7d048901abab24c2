//! One step of time, in any coordinates: the stages by name, in order.
//!
//! The paper's step (semi-implicit Euler) takes everything but the new velocities at the beginning of the step, and
//! then moves the positions along the new velocities (Tokizaki & Hasegawa eqs. 8-9). Moreau and Jean's step with
//! θ = 1/2 moves the positions half-way along the old velocities, takes everything there, and moves them the other half
//! along the new ones. Over a sequence of steps that is the same staggered scheme, so that contacts and limits look a
//! whole step ahead in both; but position-dependent forces are taken at the midpoint, which is of second order.
//!
//! In both, velocity-dependent forces are those of the mean of old and new velocities, which neither adds energy to
//! a rotation nor takes any: the mean is predicted, and corrected where the prediction was wrong (see
//! `coordinates/reduced/velocity_forces.rs`).
//!
//! In free flight the root's velocities are set at the end so that momentum is kept to rounding (see
//! `sim/momentum.rs`). A step in which the ground or an obstacle pushes keeps the scheme's own momentum, because its
//! velocities are those that the contacts ask for at the pose at which they were solved. Every flight begins from the
//! momentum that the state has then, so that nothing jumps at touch-down or lift-off.

mod commit;
mod drives;
mod feedforward;
mod joint_friction;
mod rows;

use super::command::Command;
use super::convergence::{Convergence, FixedPoint};
use super::coordinates::CoordinateSystem;
use super::coordinates::outcome::StepOutcome;
use super::failure::{Failure, check_finite_with};
use super::state::State;
use super::step_data::StepData;
use super::workspace::Workspace;
use crate::model::Model;
use crate::scene::StepPlan;
use multiversion::multiversion;

/// One step of `step` seconds in the coordinates `system`, unless it has to be shorter (see [`StepOutcome`]).
///
/// # Errors
/// As [`crate::sim::Simulator::step`].
#[multiversion(targets("x86_64+avx2"))]
pub fn step<C: CoordinateSystem>(
    model: &Model,
    plan: &StepPlan,
    state: &mut State,
    work: &mut Workspace,
    system: &mut C,
    command: Command<'_>,
    step: f64,
) -> Result<StepOutcome, Failure> {
    let mut stages = Stages { data: StepData::new(model, plan, state, work, step), system };
    if let Some(outcome) = stages.system.place(&mut stages.data, command)? {
        return Ok(outcome);
    }
    stages.detection();
    if !stages.velocities(command)? {
        return Ok(StepOutcome::TooFast { body: stages.data.fastest, longest: 0.5 * step });
    }
    if let Some(outcome) = stages.system.judge(&mut stages.data) {
        return Ok(outcome);
    }
    stages.recovery()?;
    stages.commit();
    check_finite_with(model, state, || work.problem.rows.worst())?;
    Ok(StepOutcome::Completed)
}

/// The stages of a step over their common data.
struct Stages<'a, C> {
    data: StepData<'a>,
    system: &'a mut C,
}

impl<C: CoordinateSystem> Stages<'_, C> {
    /// Detects contact candidates.
    #[inline(always)] // compiled for the processor of `step`
    fn detection(&mut self) {
        let StepData { model, plan, state, work, step, .. } = &mut self.data;
        let Workspace { detection, placed, feedforward, .. } = &mut **work;
        let angles = (!C::JOINTS_BY_ROWS).then_some(&state.angles[..]);
        detection.detect(model, plan, placed, angles, feedforward.period, *step);
        detection.first = detection.candidates.len();
    }

    /// New velocities; whether the mean velocities converged.
    #[inline(always)] // compiled for the processor of `step`
    fn velocities(&mut self, command: Command<'_>) -> Result<bool, Failure> {
        self.system.predict_mean(&mut self.data);
        let mut iteration = FixedPoint::START;
        self.drives(command)?;
        self.first_friction();
        self.factorise()?;
        loop {
            self.velocities_at_mean()?;
            match self.system.correct_mean(&mut self.data, &mut iteration) {
                Convergence::Converged => return Ok(true),
                Convergence::Improving => {}
                // Contacts that open and close, or a problem that the solver leaves unsolved, can prevent convergence.
                // The paper's step is not that exact.
                Convergence::Stalled => {
                    return Ok(!self.data.midpoint && !self.data.work.problem.rows.is_empty());
                }
            }
            // Of the earlier stages, only feedforward depends on velocity-dependent forces.
            if self.data.feeds_forward() {
                self.drives(command)?;
                self.factorise()?;
            }
        }
    }

    /// The mass matrix under the loads of the joints.
    fn factorise(&mut self) -> Result<(), Failure> {
        self.loads();
        self.friction_loads();
        self.system.factorise(&mut self.data)
    }

    /// New velocities with the present velocity-dependent forces and mass matrix.
    #[inline(always)] // compiled for the processor of `step`
    fn velocities_at_mean(&mut self) -> Result<(), Failure> {
        self.data.work.evaluations += 1;
        loop {
            self.system.free_motion(&mut self.data);
            self.rows();
            if !self.solve()? && self.release_stuck() {
                self.factorise()?;
                continue;
            }
            self.respond();
            // Rows are added for an actuator that would exceed its greatest torque, a joint whose friction was not known, a
            // limit that would be crossed and a contact that an impact brings about. Each is added at most once, and
            // actuators leave their bounds only so often, so the loop ends.
            let saturated = self.switch_actuators();
            let gives_way = self.friction_gives_way();
            let crossing = self.crosses_limit();
            if !self.impact_contacts() && !crossing && !saturated && !gives_way {
                return Ok(());
            }
            if saturated || gives_way {
                self.factorise()?;
            }
        }
    }
}
