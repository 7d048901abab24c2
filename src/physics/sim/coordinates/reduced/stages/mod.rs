//! One step of time in joint coordinates: the stages by name, in order.
//!
//! The paper's step takes everything at the beginning of the step but the new velocities, and then moves the
//! positions along them (Tokizaki & Hasegawa eqs. 8-9). Moreau and Jean's with θ = 1/2 moves the positions
//! half-way along the old velocities, takes everything there, and moves them the other half along the new
//! ones: over a sequence of steps that is the same staggered scheme, so that contacts and limits look a
//! whole step ahead in both, but forces of position are taken in the middle. That is of second order.
//!
//! In both, forces of velocity are those of the mean of old and new velocities, which neither feeds nor drains a rotation:
//! the mean is guessed, and where the guess was off the new velocities are found again (see `velocity_forces`).

mod balance;
mod commit;
mod convergence;
mod drives;
mod free_motion;
mod held;
mod rows;
mod swing;
mod velocity_forces;

use crate::model::Model;
use crate::scene::{Feedforward, Integrator, StepPlan};
use crate::sim::command::Command;
use crate::sim::coordinates::outcome::Outcome;
use crate::sim::coordinates::reduced::kinematics::place;
use crate::sim::failure::{Failure, check_finite_with};
use crate::sim::integrate::advance;
use crate::sim::memory::Swing;
use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::Motion;
use crate::sim::state::State;
use crate::sim::step_control::{FARTHEST_SWING, FARTHEST_TURN};
use crate::sim::workspace::Workspace;
use convergence::{Left, Passes};
use multiversion::multiversion;

/// One step of `step` seconds, unless a body would turn too far in it.
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
) -> Result<Outcome, Failure> {
    let freedom = RootFreedom::new(model, plan);
    let middle = plan.accuracy.integrator == Integrator::MoreauJean;
    let time = state.time;
    let mut stages = Stages { model, plan, state, work, freedom, step, time, middle, turn: 0.0 };
    if middle {
        stages.first_half();
    }
    stages.kinematics();
    let (body, turn) = stages.fastest_turn();
    if turn * step > FARTHEST_TURN {
        return Ok(Outcome::TooFast { body, longest: FARTHEST_TURN / turn });
    }
    if let Some(Swing { body, rate }) = stages.state.memory.swing
        && rate * step > FARTHEST_SWING
    {
        return Ok(Outcome::TooFast { body, longest: FARTHEST_SWING / rate });
    }
    stages.turn = turn * step;
    stages.detection();
    if !stages.velocities(command)? {
        return Ok(Outcome::TooFast { body, longest: 0.5 * step });
    }
    let (body, turn) = stages.fastest_new_turn();
    if turn * step > FARTHEST_TURN {
        return Ok(Outcome::TooFast { body, longest: FARTHEST_TURN / turn });
    }
    if let Some(longest) = stages.flaw(turn) {
        return Ok(Outcome::TooCoarse { longest });
    }
    stages.pulls();
    stages.recovery()?;
    stages.commit();
    check_finite_with(model, state, || work.rows.worst())?;
    Ok(Outcome::Done)
}

/// The stages of a step over their common data.
struct Stages<'a> {
    model: &'a Model,
    plan: &'a StepPlan,
    state: &'a mut State,
    work: &'a mut Workspace,
    freedom: RootFreedom,
    /// Length of the step, s.
    step: f64,
    /// Farthest that a body turns in it, rad.
    turn: f64,
    /// Time at its beginning, s.
    time: f64,
    /// Whether positions are those of the middle of the step while it is computed.
    middle: bool,
}

impl Stages<'_> {
    /// Where the bodies are and how they move.
    fn kinematics(&mut self) {
        let Self { model, state, work, .. } = self;
        place(model, state, &mut work.bodies);
        for (old, body) in work.old.iter_mut().zip(&work.bodies) {
            *old = body.velocity;
        }
        work.common_point = state.root.position;
        work.mean_rates.copy_from_slice(&state.velocities);
    }

    /// Moves the positions to the middle of the step, along the old velocities.
    fn first_half(&mut self) {
        self.work.joint_rates.copy_from_slice(&self.state.velocities);
        advance(self.state, self.state.root.motion(), &self.work.joint_rates, 0.5 * self.step);
    }

    /// The body that turns fastest at the velocities of the beginning, and its turn, rad/s.
    fn fastest_turn(&self) -> (usize, f64) {
        fastest(self.work.bodies.iter().map(|body| body.velocity))
    }

    /// The same at the new velocities.
    fn fastest_new_turn(&self) -> (usize, f64) {
        fastest(self.work.new.iter().copied())
    }

    /// New velocities; whether their forces of velocity settled.
    fn velocities(&mut self, command: Command<'_>) -> Result<bool, Failure> {
        self.expect_mean();
        let mut passes = Passes::NONE;
        self.drives(command)?;
        self.factorise()?;
        loop {
            self.velocities_at_mean()?;
            match self.correct_mean(&mut passes) {
                Left::Nothing => return Ok(true),
                Left::Something => {}
                // Contacts that come and go, or that a solver leaves unsolved, may keep it from settling; the paper's
                // step is not that exact.
                Left::Everything => return Ok(!self.middle && !self.work.rows.is_empty()),
            }
            // Of what comes before, only feedforward knows the forces of velocity.
            if self.feeds_forward() {
                self.drives(command)?;
                self.factorise()?;
            }
        }
    }

    /// New velocities with the present forces of velocity and mass matrix.
    fn velocities_at_mean(&mut self) -> Result<(), Failure> {
        self.work.evaluations += 1;
        loop {
            self.free_velocities();
            self.rows();
            self.solve()?;
            self.response();
            // An actuator that would exceed its greatest torque gets a row of its own, and so do a limit
            // that would be passed and a touch that a blow brings about. Each can be added only once, so
            // this ends.
            let saturated = self.saturation();
            let passing = self.passing();
            if !self.struck() && !passing && !saturated {
                return Ok(());
            }
            if saturated {
                self.factorise()?;
            }
        }
    }

    /// Whether the plan's drive has a first pass.
    fn feeds_forward(&self) -> bool {
        self.plan.drive.as_ref().is_some_and(|drive| drive.feedforward != Feedforward::None)
    }

    /// What the character touches.
    fn detection(&mut self) {
        self.work.detect(self.model, self.plan, Some(&self.state.angles), self.step);
        self.work.foreseen = self.work.touches.len();
    }
}

/// Index and magnitude of the greatest angular velocity, rad/s.
fn fastest(velocities: impl Iterator<Item = Motion>) -> (usize, f64) {
    let mut fastest = (0, 0.0);
    for (index, velocity) in velocities.enumerate() {
        let square = velocity.angular.norm_squared();
        if square > fastest.1 {
            fastest = (index, square);
        }
    }
    (fastest.0, fastest.1.sqrt())
}
