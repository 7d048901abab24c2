//! When a step is divided into substeps or refused: every threshold, and what dividing a step has to keep.
//!
//! Thresholds are angles, shares, or numbers of the character's own units of length ℓ and time τ
//! ([`CharacterUnits`](crate::scene::CharacterUnits)), and speak of relative motion: a character of any size, seen from any
//! frame that moves uniformly, has the same steps divided.

use super::rows::SHARE_PER_STEP;
use super::state::State;
use super::step_record::StepRecord;
use super::step_totals::StepTotals;
use crate::model::Model;
use crate::scene::StepPlan;

/// Greatest number of substeps of a step.
pub const MAX_SUBSTEPS: f64 = 4096.0;

/// Share of the tolerance (under error control) or of the greatest rotation angle that the next substep aims at, so
/// that most substeps are not computed twice.
pub const SAFETY: f64 = 0.9;

/// Least and greatest ratio of the next substep's length to the last one's, under error control.
pub const GROWTH: [f64; 2] = [0.2, 4.0];

/// Greatest ratio of a substep's length to that of the one before, after a substep was refused because it would
/// have created energy.
pub const RELAXATION: f64 = 1.1;

/// Greatest rotation angle of a body in a substep, rad, at its old and at its new velocity. A faster rotation needs
/// shorter substeps, unless it is spin about an axis of symmetry ([`Spin`](crate::model::Spin)).
pub const MAX_ROTATION_ANGLE: f64 = 0.3;

/// Greatest phase, rad, that a pendulum under joint tension may pass through in a substep. The scheme is explicit in
/// the pendulum's position, and unstable from 2 rad on. Neighbours in a chain swing against each other at up to twice the
/// frequency of each alone (a string of beads: ω² = 4 F / (m l)), which leaves a factor of two.
pub const MAX_PENDULUM_PHASE: f64 = 0.5;

/// A step in which no body would rotate by more than this, rad, and the solver leaves no velocity that matters, is
/// accepted without an energy balance: its paths are straight enough.
pub const NEGLIGIBLE_ROTATION: f64 = 0.02;

/// Greatest rotation of a body in a time τ, rad, at which energy in flight is left to the scheme: it errs by the square of rotation angles.
pub const SLOW_ROTATION: f64 = 1.0;

/// Share of the kinetic energy of relative motion that the scheme may create in a time τ, for each τ of the whole step,
/// and less at finer steps.
pub const ENERGY_GROWTH: f64 = 0.04;

/// Share of the kinetic energy of relative motion that a substep with a rebound may create: a hundredth is reached after five
/// rebounds at least.
pub const ENERGY_OF_REBOUND: f64 = 2e-3;

/// Greatest depth by which a contact may penetrate farther in a substep, ℓ.
pub const MAX_PENETRATION_GAIN: f64 = 1.5e-3;

/// Greatest distance by which the solver may leave a correction of positions wrong in a substep, ℓ, before the step counts as
/// unsolved. What is left of it is corrected in later steps, by [`SHARE_PER_STEP`] each, so that errors e of every step add up to
/// e / share at most (a geometric series): here to a thousandth of what a contact may sink in within a substep.
pub const MAX_RECOVERY_ERROR: f64 = 1e-3 * SHARE_PER_STEP * MAX_PENETRATION_GAIN;

/// A substep as short as the whole step divided by this is accepted as it is, and counted as coarse where it creates energy
/// or drives a contact in. With a rebound, which happens once, it may be [`MAX_SUBSTEPS`] times shorter than the step.
pub const FINEST_DIVISION: f64 = 32.0;

/// Least and greatest ratio of the next trial's length to that of the substep that was refused.
pub const SHORTENING: [f64; 2] = [0.2, 0.7];

/// Share of the allowed energy or penetration that the next trial aims at.
pub const BALANCE_SAFETY: f64 = 0.9;

/// What dividing a step has to keep, and how often it was done.
#[derive(Debug, Clone)]
pub(super) struct StepControl {
    /// The state before a substep, to go back to. (advance_in_substeps)
    pub before_substep: State,
    /// The state before the pendulum frequency is measured. (measure_pendulum)
    pub before_measurement: State,
    /// Targets at the beginning of a substep, one a joint, rad or m. (substep)
    pub now: Vec<f64>,
    /// Targets at the end of a substep, one a joint, rad or m. (substep)
    pub next: Vec<f64>,
    /// Number of substeps computed since the simulator was made, refused ones included. (substep)
    pub substeps: u64,
    /// Under error control: whether every substep since the beginning of a trial was of second order and had no
    /// rows. (step_within, substep)
    pub smooth: bool,
    /// Under error control: whether every substep since then was of second order and in flight. (step_within, substep)
    pub in_flight: bool,
    /// Under error control: the state before a trial, and the state after it was computed in one. (step_within)
    pub trial: Option<[State; 2]>,
    /// Sums over the substeps that were kept. (add_to_totals)
    pub totals: StepTotals,
    /// Under error control: those sums before a trial. (keep_totals)
    pub totals_before: StepTotals,
    /// Of all steps since the simulator was made. (step)
    pub record: StepRecord,
}

impl StepControl {
    pub fn new(model: &Model, plan: &StepPlan) -> Self {
        let joints = model.joint_count();
        let state = || State::new(model);
        Self {
            before_substep: state(),
            before_measurement: state(),
            now: vec![0.0; joints],
            next: vec![0.0; joints],
            substeps: 0,
            smooth: false,
            in_flight: false,
            trial: plan.accuracy.step_tolerance.map(|_| [state(), state()]),
            totals: StepTotals::default(),
            totals_before: StepTotals::default(),
            record: StepRecord::default(),
        }
    }

    pub fn keep_totals(&mut self) {
        self.totals_before.clone_from(&self.totals);
    }

    pub fn restore_totals(&mut self) {
        self.totals.clone_from(&self.totals_before);
    }
}
