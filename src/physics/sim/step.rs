//! One step of time: whole, in parts where a body turns too far, or in parts as short as an error
//! tolerance asks.

use super::account::Account;
use super::lcp::Status;
use super::reduced::root::RootFreedom;
use super::reduced::stages::Outcome;
use super::{Command, Failure, Simulator, State, maximal, reduced};
use crate::model::Model;
use crate::scene::{Integrator, StepPlan};

/// Greatest number of parts that a step is divided into.
const MOST_PARTS: f64 = 4096.0;

/// Part of the aim at which the next part's error is put, so that most parts are not computed twice.
const SAFETY: f64 = 0.9;

/// Bounds on how much longer the next part may be than the last.
const GROWTH: [f64; 2] = [0.2, 4.0];

/// How much longer a part may be than the one before it after a part would have made energy.
const RELAXATION: f64 = 1.1;

/// What dividing a step needs to keep in mind.
#[derive(Debug, Clone)]
pub(super) struct Division {
    /// The state before a part.
    before: State,
    /// The state before a probe.
    probed: State,
    /// Targets at the beginning and at the end of a part, rad or m.
    now: Vec<f64>,
    next: Vec<f64>,
    /// How many parts have been computed.
    pub parts: u64,
    /// Under error control: whether nothing but a smooth motion of second order has been seen
    /// since the beginning of a part.
    smooth: bool,
    /// Under error control: the state before a part, and that after the part taken as a whole.
    control: Option<[State; 2]>,
    /// What acted in the parts that were kept, and under error control in those before a part.
    pub account: Account,
    accounted: Account,
}

impl Division {
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let joints = model.joint_count();
        let state = || State::new(model);
        Self {
            before: state(),
            probed: state(),
            now: vec![0.0; joints],
            next: vec![0.0; joints],
            parts: 0,
            smooth: false,
            control: plan.accuracy.step_tolerance.map(|_| [state(), state()]),
            account: Account::default(),
            accounted: Account::default(),
        }
    }

    fn keep_account(&mut self) {
        self.accounted.clone_from(&self.account);
    }

    fn take_account_back(&mut self) {
        self.account.clone_from(&self.accounted);
    }
}

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

fn too_fast(model: &Model, state: &State, body: usize) -> Failure {
    let place = match body {
        0 => format!("root link {}", model.character.links[0].name),
        _ => format!("body of joint {}", model.joint_names[body - 1]),
    };
    Failure { time: state.time, place, cause: "turns or swings too fast to be followed".into() }
}
