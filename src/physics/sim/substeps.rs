//! The simulator's step of time: whole, in substeps where a body rotates too far or energy would be created, or in substeps as
//! short as an error tolerance requires.

use super::command::Command;
use super::coordinates::outcome::StepOutcome;
use super::failure::{Failure, check_command, check_start, too_fast};
use super::root_freedom::RootFreedom;
use super::simulator::{ChosenCoordinates, Simulator};
use super::state::State;
use super::step::step;
use super::step_control::{GROWTH, MAX_SUBSTEPS, RELAXATION, SAFETY};
use super::tracking::Reference;
use crate::scene::{Feedforward, Integrator};

impl Simulator {
    /// One step of the plan's step length (Tokizaki & Hasegawa eqs. 8-9 with the mixed LCP of
    /// eqs. 25-27). Allocates nothing once it is warm.
    ///
    /// The step is computed in substeps where a body would rotate by more than 0.3 rad (but for spin about an axis of
    /// symmetry), where a pendulum under joint tension would pass through more than half a radian of its phase, or where the
    /// step would create energy or drive a contact into the ground; with a tolerance in the plan, in substeps as short as the
    /// tolerance requires. [`record`](Self::record) says what was done.
    ///
    /// # Errors
    /// [`Failure`] when nothing resists an acceleration, when the problem has no solution, when a body
    /// rotates too fast for the finest substep, or when a number became non-finite, or was in the state or the command given. The state is then that of the
    /// failed step; do not continue from it.
    ///
    /// # Panics
    /// If a slice of `command` does not have one number for each joint.
    pub fn step(&mut self, command: Command<'_>) -> Result<(), Failure> {
        let joints = self.model.joint_count();
        match command {
            Command::Passive => {}
            Command::Torque(torque) => assert_eq!(torque.len(), joints, "one torque a joint"),
            Command::Velocity(wanted) => assert_eq!(wanted.len(), joints, "one velocity a joint"),
            Command::Track { now, next } => {
                assert_eq!((now.len(), next.len()), (joints, joints), "one target a joint");
            }
        }
        if self.unchecked {
            check_start(&self.model, &self.state)?;
            self.unchecked = false;
        }
        check_command(&self.model, command, self.state.time)?;
        if self.state.memory.pendulum.is_none() {
            self.measure_pendulum(command)?;
        }
        let end = self.state.time + self.plan.step();
        self.step_control.totals.clear();
        match self.plan.accuracy.step_tolerance {
            None => self.advance_in_substeps(command, 0.0, self.plan.step())?,
            Some(tolerance) => self.step_within(command, tolerance)?,
        }
        self.state.time = end;
        let control = &mut self.step_control;
        control.record.add(&control.totals);
        self.remember_targets(command);
        Ok(())
    }

    /// Whether the plan's drives have feedforward.
    fn feeds_forward(&self) -> bool {
        self.plan.feedforward() != Feedforward::None
    }

    /// Keeps the velocities of the targets, which feedforward compares with those of the next step.
    fn remember_targets(&mut self, command: Command<'_>) {
        self.state.memory.has_target_rates = false;
        if !self.feeds_forward() {
            return;
        }
        let whole = self.plan.step();
        let memory = &mut self.state.memory;
        if let Command::Track { now, next } = command {
            for (rate, (now, next)) in memory.target_rates.iter_mut().zip(now.iter().zip(next)) {
                *rate = (next - now) / whole;
            }
            memory.has_target_rates = true;
        }
    }

    /// The motions of the targets `from` seconds after the beginning of the step, for the feedforward pass.
    fn refer_to_targets(&mut self, command: Command<'_>, from: f64) {
        let Command::Track { now, next } = command else { return };
        let whole = self.plan.step();
        let memory = &self.state.memory;
        for (joint, reference) in self.work.feedforward.reference.iter_mut().enumerate() {
            let this = (next[joint] - now[joint]) / whole;
            let last = if memory.has_target_rates { memory.target_rates[joint] } else { this };
            *reference = Reference::new(last, this, from, whole);
        }
    }

    /// Finds the fastest pendulum under joint tension before the first step. Tensions that last show in two steps,
    /// which are taken back; shorter ones where such are refused.
    fn measure_pendulum(&mut self, command: Command<'_>) -> Result<(), Failure> {
        self.step_control.before_measurement.clone_from(&self.state);
        let whole = self.plan.step();
        let (mut length, mut done) = (whole, 0);
        while done < 2 && length * MAX_SUBSTEPS >= whole {
            if self.substep(command, 0.0, length)? == StepOutcome::Completed {
                done += 1;
            } else {
                self.state.clone_from(&self.step_control.before_measurement);
                (length, done) = (0.5 * length, 0);
            }
        }
        let found = &mut self.state.memory;
        let kept = &mut self.step_control.before_measurement.memory;
        kept.pendulum = found.pendulum;
        kept.tension_squared.clone_from(&found.tension_squared);
        self.state.clone_from(&self.step_control.before_measurement);
        Ok(())
    }

    /// Advances from `from` to `to` seconds after the beginning of the step, in one substep or, where that is
    /// refused, in several.
    fn advance_in_substeps(&mut self, command: Command<'_>, from: f64, to: f64) -> Result<(), Failure> {
        let moves_first = self.plan.accuracy.integrator == Integrator::MoreauJean;
        let mut done = from;
        // The longest substep that rotations and pendulums allow, and the length to be tried next.
        let mut longest = to - from;
        let mut length = longest;
        while done < to {
            // Rounding must not add a substep.
            let count = ((to - done) / length * (1.0 - 1e-12)).ceil();
            let until = if count <= 1.0 { to } else { done + (to - done) / count };
            if moves_first {
                self.step_control.before_substep.clone_from(&self.state);
            }
            let outcome = self.substep(command, done, until)?;
            if moves_first && outcome != StepOutcome::Completed {
                self.state.clone_from(&self.step_control.before_substep);
            }
            match outcome {
                StepOutcome::Completed => {
                    self.add_to_totals(until - done);
                    done = until;
                    length = (RELAXATION * length).min(longest);
                }
                StepOutcome::TooFast { body, longest: allowed } => {
                    longest = SAFETY * allowed;
                    length = length.min(longest);
                    if longest.is_nan() || longest * MAX_SUBSTEPS < self.plan.step() {
                        return Err(too_fast(&self.model, &self.state, body));
                    }
                }
                StepOutcome::TooCoarse { longest } => length = longest,
            }
        }
        Ok(())
    }

    /// Adds a substep of `length` seconds to the step's totals.
    fn add_to_totals(&mut self, length: f64) {
        let Self { plan, work, step_control, .. } = self;
        let (whole, totals) = (plan.step(), &mut step_control.totals);
        totals.count(work.counts());
        if length < whole {
            let slots = work.detection.candidates.iter().map(|candidate| candidate.slot);
            totals.add_forces(&work.drives.torque, slots.zip(work.contacts(plan)), length / whole);
        }
    }

    /// One substep, from `from` to `until` seconds after the beginning of the step.
    fn substep(&mut self, command: Command<'_>, from: f64, until: f64) -> Result<StepOutcome, Failure> {
        if self.feeds_forward() {
            self.refer_to_targets(command, from);
        }
        let Self { model, plan, state, work, system, step_control, .. } = self;
        let whole = plan.step();
        let command = match command {
            Command::Track { now, next } if until - from < whole => {
                let own = step_control.now.iter_mut().zip(&mut step_control.next);
                for ((own_now, own_next), (now, next)) in own.zip(now.iter().zip(next)) {
                    *own_now = now + (next - now) * (from / whole);
                    *own_next = now + (next - now) * (until / whole);
                }
                Command::Track { now: &step_control.now, next: &step_control.next }
            }
            command => command,
        };
        let length = until - from;
        step_control.substeps += 1;
        let outcome = match system {
            ChosenCoordinates::Reduced(system) => {
                step(model, plan, state, work, &mut **system, command, length)
            }
            ChosenCoordinates::Maximal(system) => {
                step(model, plan, state, work, &mut **system, command, length)
            }
        };
        step_control.smooth &= work.problem.rows.is_empty();
        step_control.in_flight &= work.is_in_flight(plan);
        outcome
    }

    /// The whole step in trials, each as long as `tolerance` (rad or m) allows. A trial is computed
    /// as a whole and in two halves, and their difference estimates the error of the first
    /// (Hairer, Nørsett & Wanner 1993, section II.4). The halves are kept. Where no row acts on a step of Moreau and
    /// Jean's, the estimate also corrects them (local extrapolation): the motion is smooth there, the error of that
    /// symmetric step has even powers of the step only, and the remaining error is of fourth order.
    fn step_within(&mut self, command: Command<'_>, tolerance: f64) -> Result<(), Failure> {
        let order = match self.plan.accuracy.integrator {
            Integrator::SemiImplicitEuler => 1,
            Integrator::MoreauJean => 2,
        };
        let whole = self.plan.step();
        let shortest = whole / MAX_SUBSTEPS;
        let Some([mut before, mut coarse]) = self.step_control.trial.take() else { return Ok(()) };
        let mut length = match self.state.memory.next_substep {
            0.0 => whole,
            length => length.min(whole),
        };
        let mut done = 0.0;
        let mut outcome = Ok(());
        while done < whole && outcome.is_ok() {
            // A remainder of less than a hundredth of a trial is included in it.
            let until = if whole - done < 1.01 * length { whole } else { done + length };
            let trial = until - done;
            before.clone_from(&self.state);
            self.step_control.keep_totals();
            (self.step_control.smooth, self.step_control.in_flight) = (order == 2, order == 2);
            let middle = done + 0.5 * trial;
            let failed = self.advance_in_substeps(command, done, until).is_err();
            coarse.clone_from(&self.state);
            self.state.clone_from(&before);
            self.step_control.restore_totals();
            outcome = self
                .advance_in_substeps(command, done, middle)
                .and_then(|()| self.advance_in_substeps(command, middle, until));
            let error = if failed || outcome.is_err() { f64::INFINITY } else { coarse.distance(&self.state) };
            let growth = SAFETY * (tolerance / error).powf(1.0 / f64::from(order + 1));
            let next = (trial * growth.clamp(GROWTH[0], GROWTH[1])).clamp(shortest, whole);
            // Rounding may make the trial longer than the length that was meant, so that it never is the shortest.
            let least = trial.min(length) <= shortest;
            if error <= tolerance && self.step_control.smooth {
                // To leading order the error of the halves is a third of their distance from the whole.
                self.state.extrapolate(&coarse, 1.0 / 3.0);
            }
            if error <= tolerance || (least && outcome.is_ok()) {
                // Each step of the first order keeps it by itself.
                if self.step_control.in_flight {
                    self.keep_momentum_since(&before, trial);
                }
                // A trial that was cut short by the end of the step gives no reason for shorter ones.
                length = if trial < length { next.max(length) } else { next };
                done = until;
                if error > tolerance {
                    self.step_control.totals.accept_coarse();
                }
            } else if !least {
                outcome = Ok(());
                length = next;
                self.state.clone_from(&before);
                self.step_control.restore_totals();
            }
        }
        self.state.memory.next_substep = length;
        self.step_control.trial = Some([before, coarse]);
        outcome
    }

    /// Gives the state the momentum that it has `time` seconds of free flight after `before`, if momentum is kept.
    fn keep_momentum_since(&mut self, before: &State, time: f64) {
        let Self { model, plan, state, system, .. } = self;
        if let ChosenCoordinates::Reduced(system) = system
            && RootFreedom::keeps_momentum(model, plan)
        {
            let flight = &mut system.flight;
            flight.begin(before);
            let momentum = flight.momentum(model).after_flight(model.mass, plan.gravity, time);
            flight.end(model, state, momentum, None, false);
        }
    }
}
