//! One step of time in joint coordinates: the stages by name, in order.
//!
//! The paper's step (semi-implicit Euler) takes everything but the new velocities at the beginning of the step, and
//! then moves the positions along the new velocities (Tokizaki & Hasegawa eqs. 8-9). Moreau and Jean's step with
//! θ = 1/2 moves the positions half-way along the old velocities, takes everything there, and moves them the other half
//! along the new ones. Over a sequence of steps that is the same staggered scheme, so that contacts and limits look a
//! whole step ahead in both; but position-dependent forces are taken at the midpoint, which is of second order.
//!
//! In both, velocity-dependent forces are those of the mean of old and new velocities, which neither adds energy to
//! a rotation nor takes any: the mean is predicted, and corrected where the prediction was wrong (see
//! `velocity_forces`).
//!
//! In free flight the root's velocities are set at the end so that momentum is kept to rounding (see
//! `sim/momentum.rs`). A step in which the ground or an obstacle pushes keeps the scheme's own momentum, because its
//! velocities are those that the contacts ask for at the pose at which they were solved. Every flight begins from the
//! momentum that the state has then, so that nothing jumps at touch-down or lift-off.

mod balance;
mod commit;
mod convergence;
mod drives;
mod feedforward_rows;
mod free_motion;
mod joint_friction;
mod rows;
mod tension;
mod velocity_forces;

use crate::model::Model;
use crate::scene::{Feedforward, Integrator, StepPlan};
use crate::sim::bodies::BodyMotion;
use crate::sim::command::Command;
use crate::sim::coordinates::outcome::StepOutcome;
use crate::sim::coordinates::reduced::kinematics::place;
use crate::sim::failure::{Failure, check_finite_with};
use crate::sim::integrate::advance;
use crate::sim::memory::Pendulum;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::SpatialMotion;
use crate::sim::state::State;
use crate::sim::step_control::{MAX_PENDULUM_PHASE, MAX_ROTATION_ANGLE};
use crate::sim::workspace::Workspace;
use convergence::{Convergence, FixedPoint};
use multiversion::multiversion;

/// One step of `step` seconds, unless it has to be shorter (see [`StepOutcome`]).
///
/// # Errors
/// As [`crate::sim::Simulator::step`].
#[multiversion(targets("x86_64+avx2"))]
pub fn step(
    model: &Model,
    plan: &StepPlan,
    state: &mut State,
    work: &mut Workspace,
    command: Command<'_>,
    step: f64,
) -> Result<StepOutcome, Failure> {
    let root_freedom = RootFreedom::new(model, plan);
    let midpoint = plan.accuracy.integrator == Integrator::MoreauJean;
    let time = state.time;
    let mut stages =
        Stages { model, plan, state, work, root_freedom, step, time, midpoint, rotation_angle: 0.0 };
    if RootFreedom::keeps_momentum(model, plan) {
        stages.work.flight.begin(stages.state);
    }
    if midpoint {
        stages.first_half();
    }
    stages.kinematics();
    let (body, rate) = stages.fastest_rotation();
    if rate * step > MAX_ROTATION_ANGLE {
        return Ok(StepOutcome::TooFast { body, longest: MAX_ROTATION_ANGLE / rate });
    }
    if let Some(Pendulum { body, frequency }) = stages.state.memory.pendulum
        && frequency * step > MAX_PENDULUM_PHASE
    {
        return Ok(StepOutcome::TooFast { body, longest: MAX_PENDULUM_PHASE / frequency });
    }
    stages.rotation_angle = rate * step;
    stages.detection();
    if !stages.velocities(command)? {
        return Ok(StepOutcome::TooFast { body, longest: 0.5 * step });
    }
    let (body, rate) = stages.fastest_new_rotation();
    if rate * step > MAX_ROTATION_ANGLE {
        return Ok(StepOutcome::TooFast { body, longest: MAX_ROTATION_ANGLE / rate });
    }
    if let Some(longest) = stages.shorter_step(rate) {
        return Ok(StepOutcome::TooCoarse { longest });
    }
    stages.joint_tensions();
    stages.recovery()?;
    stages.commit();
    check_finite_with(model, state, || work.rows.worst())?;
    Ok(StepOutcome::Completed)
}

/// The stages of a step over their common data.
struct Stages<'a> {
    model: &'a Model,
    plan: &'a StepPlan,
    state: &'a mut State,
    work: &'a mut Workspace,
    root_freedom: RootFreedom,
    /// Length of the step, s.
    step: f64,
    /// Greatest rotation angle of a body in the step, rad.
    rotation_angle: f64,
    /// Time at its beginning, s.
    time: f64,
    /// Whether positions are those of the step's midpoint while it is computed (Moreau and Jean).
    midpoint: bool,
}

impl Stages<'_> {
    /// Places the bodies and gives them the old velocities.
    fn kinematics(&mut self) {
        let Self { model, state, work, midpoint, .. } = self;
        if *midpoint || !work.flight.take_bodies(&mut work.bodies) {
            place(model, state, &mut work.bodies);
        }
        for (old, body) in work.old.iter_mut().zip(&work.bodies) {
            *old = body.velocity;
        }
        work.common_point = state.root.position;
        work.mean_rates.copy_from_slice(&state.velocities);
    }

    /// Moves the positions to the step's midpoint, along the old velocities.
    fn first_half(&mut self) {
        self.work.joint_rates.copy_from_slice(&self.state.velocities);
        advance(self.state, self.state.root.motion(), &self.work.joint_rates, 0.5 * self.step);
    }

    /// The body that rotates fastest at the old velocities, and its angular rate, rad/s.
    fn fastest_rotation(&self) -> (usize, f64) {
        fastest(self.model, &self.work.bodies, self.work.bodies.iter().map(|body| body.velocity))
    }

    /// The same at the new velocities.
    fn fastest_new_rotation(&self) -> (usize, f64) {
        fastest(self.model, &self.work.bodies, self.work.new.iter().copied())
    }

    /// New velocities; whether the mean velocities converged.
    fn velocities(&mut self, command: Command<'_>) -> Result<bool, Failure> {
        self.predict_mean();
        let mut iteration = FixedPoint::START;
        self.drives(command)?;
        self.first_friction();
        self.factorise()?;
        loop {
            self.velocities_at_mean()?;
            match self.correct_mean(&mut iteration) {
                Convergence::Converged => return Ok(true),
                Convergence::Improving => {}
                // Contacts that open and close, or a problem that the solver leaves unsolved, can prevent convergence.
                // The paper's step is not that exact.
                Convergence::Stalled => return Ok(!self.midpoint && !self.work.rows.is_empty()),
            }
            // Of the earlier stages, only feedforward depends on velocity-dependent forces.
            if self.feeds_forward() {
                self.drives(command)?;
                self.factorise()?;
            }
        }
    }

    /// New velocities with the present velocity-dependent forces and mass matrix.
    fn velocities_at_mean(&mut self) -> Result<(), Failure> {
        self.work.evaluations += 1;
        loop {
            self.free_velocities();
            self.rows();
            if !self.solve()? && self.release_stuck() {
                self.factorise()?;
                continue;
            }
            self.response();
            // Rows are added for an actuator that would exceed its greatest torque, a joint whose friction was not known, a
            // limit that would be crossed and a contact that an impact brings about. Each is added at most once, and
            // actuators leave their bounds only so often, so the loop ends.
            let saturated = self.work.switch_actuators(self.plan);
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

    /// Whether the plan's drive has feedforward torques.
    fn feeds_forward(&self) -> bool {
        self.plan.drive.as_ref().is_some_and(|drive| drive.feedforward != Feedforward::None)
    }

    /// Detects contact candidates.
    fn detection(&mut self) {
        self.work.detect(self.model, self.plan, Some(&self.state.angles), self.step);
        self.work.detected = self.work.candidates.len();
    }
}

/// Index and magnitude of the greatest angular velocity, rad/s, less spin that changes nothing.
fn fastest(
    model: &Model,
    bodies: &[BodyMotion],
    velocities: impl Iterator<Item = SpatialMotion>,
) -> (usize, f64) {
    let mut fastest = (0, 0.0);
    for (index, ((velocity, body), spin)) in velocities.zip(bodies).zip(&model.spins).enumerate() {
        let square = spin.visible_squared(&body.rotation, velocity.angular);
        if square > fastest.1 {
            fastest = (index, square);
        }
    }
    (fastest.0, fastest.1.sqrt())
}
