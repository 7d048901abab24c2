//! What is checked of a case.

use std::fmt;
use std::sync::Arc;

use gaitwright_physics::scene::{DrivePlan, Feedforward, StepPlan};
use gaitwright_physics::sim::{Command, Simulator, State};

use super::draw::Drawing;

/// Steps of a case.
const STEPS: usize = 120;

/// Share of the greatest kinetic energy seen that a simulation may gain by its own errors.
const GAIN: f64 = 0.05;

/// What a limit or the ground may be passed by: a millimetre or milliradian, and a tenth of the way that
/// the fastest part goes in a step.
const OVERRUN: f64 = 1e-3;
const OVERRUN_SHARE: f64 = 0.1;

/// What does not hold.
#[derive(Debug)]
pub enum Broken {
    /// A bound on what a step adds of its own: energy, or a limit or the ground passed.
    Accuracy(String),
    /// Something that holds at any step.
    Anything(String),
}

impl fmt::Display for Broken {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::Accuracy(reason) | Self::Anything(reason)) = self;
        formatter.write_str(reason)
    }
}

/// One step of a case.
fn step(drawing: &Drawing, plan: &StepPlan, simulator: &mut Simulator, index: usize) -> Result<(), String> {
    let at = |index: usize| drawing.targets.at(index as f64 * plan.step());
    let (now, next) = (at(index), at(index + 1));
    let command =
        if plan.drive.is_some() { Command::Track { now: &now, next: &next } } else { Command::Passive };
    simulator.step(command).map_err(|failure| failure.to_string())
}

/// The state in which a case ends.
pub fn end(drawing: &Drawing, plan: &Arc<StepPlan>) -> Result<State, String> {
    let mut simulator = Simulator::new(plan.clone(), drawing.start.clone());
    (0..STEPS).try_for_each(|index| step(drawing, plan, &mut simulator, index))?;
    Ok(simulator.state().clone())
}

/// Runs a case and checks every step; gives the state in which it ends.
pub fn run(drawing: &Drawing, plan: &Arc<StepPlan>) -> Result<State, Broken> {
    let mut simulator = Simulator::new(plan.clone(), drawing.start.clone());
    let conserved = plan.velocity_forces && (plan.drive.is_none() || still(drawing, plan));
    let start = stored(drawing, plan, &simulator);
    let mut liveliest = simulator.energy().kinetic + spring_energy(drawing, plan, simulator.state());
    let mut fastest = pace(simulator.state());
    let mut left: f64 = 0.0;
    for index in 0..STEPS {
        let before = simulator.substeps();
        step(drawing, plan, &mut simulator, index).map_err(Broken::Anything)?;
        let whole = simulator.substeps() == before + 1;
        let state = simulator.state();
        let at = state.time;
        let energy = stored(drawing, plan, &simulator);
        liveliest = liveliest.max(simulator.energy().kinetic);
        fastest = fastest.max(pace(state));
        if !(energy.is_finite() && simulator.residual().is_finite()) {
            let residual = simulator.residual();
            return Err(Broken::Anything(format!("energy {energy} and residual {residual} at {at} s")));
        }
        if conserved && energy - start > GAIN * liveliest + 1e-12 * start.abs() {
            let gained = energy - start;
            return Err(Broken::Accuracy(format!("gained {gained:e} J of {liveliest:e} J at {at} s")));
        }
        // A solver with a budget leaves velocities, which move what it should have stopped.
        left += plan.step() * simulator.residual();
        let overrun = OVERRUN + plan.step() * OVERRUN_SHARE * fastest + left;
        let beyond = simulator.limit_violation();
        if plan.limits.is_some() && beyond > overrun {
            let residual = simulator.residual();
            return Err(Broken::Accuracy(format!(
                "{beyond:e} beyond a limit at {at} s, speed {fastest:e}, residual {residual:e}"
            )));
        }
        let depth = simulator.contacts().map(|contact| contact.depth).fold(0.0, f64::max);
        if depth > overrun {
            return Err(Broken::Accuracy(format!("{depth:e} m in the ground at {at} s, speed {fastest:e}")));
        }
        if let Some(most) = plan.drive.as_ref().and_then(|drive| drive.max_torque.as_ref()) {
            for (torque, most) in simulator.torques().iter().zip(most) {
                if torque.abs() > most * (1.0 + 1e-12) {
                    return Err(Broken::Anything(format!(
                        "a torque of {torque} N m of {most} N m at {at} s"
                    )));
                }
            }
        }
        // The torques of a divided step are means, its velocity is that of its end.
        if whole && plan.drive.as_ref().is_some_and(|drive| drive.max_speed.is_some()) {
            motors(plan, &simulator).map_err(|reason| Broken::Anything(format!("{reason} at {at} s")))?;
        }
    }
    Ok(simulator.state().clone())
}

/// No actuator gives more than it has at its new velocity, but for what the solver leaves of that.
fn motors(plan: &StepPlan, simulator: &Simulator) -> Result<(), String> {
    for (joint, (&torque, &rate)) in simulator.torques().iter().zip(&simulator.state().velocities).enumerate()
    {
        let limits = plan.actuator_limits(joint);
        if !limits.falls_with_speed() {
            continue;
        }
        let [least, most] = limits.available(rate);
        let slack = limits.torque * (1e-6 + simulator.residual() / limits.speed);
        if torque < least - slack || torque > most + slack {
            return Err(format!("{torque} N m of [{least}, {most}] N m at {rate} of {} rad/s", limits.speed));
        }
    }
    Ok(())
}

/// Whether the drive is made of springs to fixed points, which store what they take.
fn still(drawing: &Drawing, plan: &StepPlan) -> bool {
    let without = |drive: &DrivePlan| drive.feedforward == Feedforward::None;
    plan.drive.as_ref().is_some_and(without) && drawing.targets.swing == 0.0
}

/// How fast anything may be, m/s: all speeds at levers of a metre.
fn pace(state: &State) -> f64 {
    let joints = state.velocities.iter().map(|speed| speed.abs()).fold(0.0, f64::max);
    state.root.linear_velocity.norm() + state.root.angular_velocity.norm() + joints
}

/// Kinetic, potential and spring energy, J.
fn stored(drawing: &Drawing, plan: &StepPlan, simulator: &Simulator) -> f64 {
    let energy = simulator.energy();
    energy.kinetic + energy.potential + spring_energy(drawing, plan, simulator.state())
}

/// Energy of the drive's springs, J; beyond its greatest torque a spring pulls with that torque.
fn spring_energy(drawing: &Drawing, plan: &StepPlan, state: &State) -> f64 {
    let Some(drive) = &plan.drive else { return 0.0 };
    let joints = state.angles.iter().zip(&drawing.targets.middle).enumerate();
    joints
        .map(|(joint, (angle, target))| {
            let (stiffness, displacement) = (drive.stiffness[joint], (angle - target).abs());
            let most = drive.max_torque.as_ref().map_or(f64::INFINITY, |most| most[joint]);
            if stiffness * displacement <= most {
                0.5 * stiffness * displacement * displacement
            } else {
                most * (displacement - 0.5 * most / stiffness)
            }
        })
        .sum()
}
