//! One step of time: whole, in parts where a body turns too far, or in parts as short as an error
//! tolerance asks.

use super::command::Command;
use super::coordinates::outcome::Outcome;
use super::coordinates::{maximal, reduced};
use super::failure::{Failure, too_fast};
use super::simulator::Simulator;
use super::step_control::{GROWTH, MOST_PARTS, RELAXATION, SAFETY};
use crate::scene::Integrator;

impl Simulator {
    /// One step of the plan's step length (Tokizaki & Hasegawa eqs. 8-9 with the mixed LCP of
    /// eqs. 25-27). Allocates nothing once it is warm.
    ///
    /// A step in which a body would turn by more than 0.3 rad, or swing under tension by more than one radian of
    /// its phase, is computed in parts, and so is one that would make energy or drive what touches into the ground; with
    /// a tolerance in the plan, in parts as short as it asks.
    ///
    /// # Errors
    /// [`Failure`] when nothing resists an acceleration, when the problem has no solution, when a body
    /// turns too fast to be followed, or when a number became non-finite. The state is then that of the failed
    /// step and must not be gone on from.
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
        if self.state.memory.swing.is_none() {
            self.probe(command)?;
        }
        let end = self.state.time + self.plan.step();
        self.division.account.clear();
        match self.plan.accuracy.step_tolerance {
            None => self.resolve(command, 0.0, self.plan.step())?,
            Some(tolerance) => self.control(command, tolerance)?,
        }
        self.state.time = end;
        Ok(())
    }

    /// Finds how fast the bodies swing under tension before anything is stepped: what pulls at them shows in
    /// two steps that are taken back.
    fn probe(&mut self, command: Command<'_>) -> Result<(), Failure> {
        self.division.probed.clone_from(&self.state);
        for _ in 0..2 {
            self.part(command, 0.0, self.plan.step())?;
        }
        let found = &mut self.state.memory;
        let kept = &mut self.division.probed.memory;
        kept.swing = found.swing;
        kept.pull.clone_from(&found.pull);
        self.state.clone_from(&self.division.probed);
        Ok(())
    }

    /// From `from` to `to` seconds after the beginning of the step, in one or, where that goes too far, in parts.
    fn resolve(&mut self, command: Command<'_>, from: f64, to: f64) -> Result<(), Failure> {
        let moves_first = self.plan.accuracy.integrator == Integrator::MoreauJean;
        let mut done = from;
        // The longest part that what turns and swings allows, and that to be tried next.
        let mut longest = to - from;
        let mut length = longest;
        while done < to {
            // Rounding must not make a part more.
            let parts = ((to - done) / length * (1.0 - 1e-12)).ceil();
            let until = if parts <= 1.0 { to } else { done + (to - done) / parts };
            if moves_first {
                self.division.before.clone_from(&self.state);
            }
            let outcome = self.part(command, done, until)?;
            if moves_first && outcome != Outcome::Done {
                self.state.clone_from(&self.division.before);
            }
            match outcome {
                Outcome::Done => {
                    self.enter(until - done);
                    done = until;
                    length = (RELAXATION * length).min(longest);
                }
                Outcome::TooFast { body, longest: followed } => {
                    longest = SAFETY * followed;
                    length = length.min(longest);
                    if longest.is_nan() || longest * MOST_PARTS < self.plan.step() {
                        return Err(too_fast(&self.model, &self.state, body));
                    }
                }
                Outcome::TooCoarse { longest } => length = longest,
            }
        }
        Ok(())
    }

    /// Takes a part of `length` seconds into account, if it is one.
    fn enter(&mut self, length: f64) {
        let whole = self.plan.step();
        if length < whole {
            self.division.account.add(&self.work, &self.plan, length / whole);
        }
    }

    /// From `from` to `until` seconds after the beginning of the step.
    fn part(&mut self, command: Command<'_>, from: f64, until: f64) -> Result<Outcome, Failure> {
        let Self { model, plan, state, work, maximal, division } = self;
        let whole = plan.step();
        let command = match command {
            Command::Track { now, next } if until - from < whole => {
                let targets = division.now.iter_mut().zip(&mut division.next).zip(now.iter().zip(next));
                for ((part_now, part_next), (now, next)) in targets {
                    *part_now = now + (next - now) * (from / whole);
                    *part_next = now + (next - now) * (until / whole);
                }
                Command::Track { now: &division.now, next: &division.next }
            }
            command => command,
        };
        let length = until - from;
        division.parts += 1;
        let outcome = match maximal {
            None => reduced::stages::step(model, plan, state, work, command, length),
            Some(own) => maximal::stages::step(model, plan, state, work, own, command, length),
        };
        division.smooth &= work.rows.is_empty();
        outcome
    }

    /// The whole step in parts, each as long as `tolerance` (rad or m) allows: every part is computed
    /// as a whole and in two halves, whose difference estimates the error of the first
    /// (Hairer, Nørsett & Wanner 1993, section II.4). The halves are kept; where no row acts on a step of Moreau and
    /// Jean's, the estimate also corrects them (local extrapolation). The motion is smooth there, and the error of
    /// that symmetric step has even powers of the step only: what is left is of fourth order.
    fn control(&mut self, command: Command<'_>, tolerance: f64) -> Result<(), Failure> {
        let order = match self.plan.accuracy.integrator {
            Integrator::SemiImplicitEuler => 1,
            Integrator::MoreauJean => 2,
        };
        let whole = self.plan.step();
        let shortest = whole / MOST_PARTS;
        let Some([mut before, mut coarse]) = self.division.control.take() else { return Ok(()) };
        let mut length = match self.state.memory.part {
            0.0 => whole,
            part => part.min(whole),
        };
        let mut done = 0.0;
        let mut outcome = Ok(());
        while done < whole && outcome.is_ok() {
            // What would be left by a hair is taken along.
            let until = if whole - done < 1.01 * length { whole } else { done + length };
            let part = until - done;
            before.clone_from(&self.state);
            self.division.keep_account();
            self.division.smooth = order == 2;
            let middle = done + 0.5 * part;
            let failed = self.resolve(command, done, until).is_err();
            coarse.clone_from(&self.state);
            self.state.clone_from(&before);
            self.division.take_account_back();
            outcome = self.resolve(command, done, middle).and_then(|()| self.resolve(command, middle, until));
            let error = if failed || outcome.is_err() { f64::INFINITY } else { coarse.distance(&self.state) };
            let growth = SAFETY * (tolerance / error).powf(1.0 / f64::from(order + 1));
            let next = (part * growth.clamp(GROWTH[0], GROWTH[1])).clamp(shortest, whole);
            // Rounding may make the part longer than the length that was meant, and never short enough.
            let least = part.min(length) <= shortest;
            if error <= tolerance && self.division.smooth {
                // To leading order the halves err by a third of what they are from the whole.
                self.state.extrapolate(&coarse, 1.0 / 3.0);
            }
            if error <= tolerance || (least && outcome.is_ok()) {
                // A part that the end of the step cut short says nothing against longer ones.
                length = if part < length { next.max(length) } else { next };
                done = until;
            } else if !least {
                outcome = Ok(());
                length = next;
                self.state.clone_from(&before);
                self.division.take_account_back();
            }
        }
        self.state.memory.part = length;
        self.division.control = Some([before, coarse]);
        outcome
    }
}
