//! Rows of contacts.
//!
//! For a contact candidate at point p with unit normal n, where v_p is the velocity of the body there relative to
//! the other side: w_n = n · v_p⁺ + bias ≥ 0, λ_n ≥ 0, w_n λ_n = 0 (Tokizaki & Hasegawa eq. 16). The bias is
//! that of the gap. A contact that would close within the step and has a speed of rebound u instead asks for
//! n · v_p⁺ ≥ u, Newton's law of restitution (Moreau 1988 for its place in time stepping), as far as the impact then
//! returns no more energy than its restitution (see `sim/restitution.rs`). Coulomb
//! friction adds two rows along tangents t: w_t = t · v_p⁺ and |λ_t| ≤ μ λ_n, the force opposing the sliding (Anitescu & Potra
//! 1997 for the pyramid; the circular cone projects both tangents together).
//!
//! A soft contact is a critically damped spring of its gap g that pushes with whatever force its motion takes,
//! g̈ = −2 ġ / T − g / T² with the time constant T, so that it sinks in as deep under a light foot as under a heavy one; its
//! friction brakes the sliding at the same rate, ẍ = −2 ẋ / T, within the cone. Both are those of MuJoCo (Todorov 2014,
//! "Convex and analytically-invertible dynamics with contacts and constraints", section IV; its documentation's chapter
//! "Solver parameters"). By implicit Euler over a step h, stable for every h and dissipative, n · v_p⁺ ≥ (n · v_p − h g / T²) / (1 + h / T)² and w_t = t · v_p⁺ − (t · v_p) / (1 + 2 h / T). A
//! contact that closes within the step is a spring for what is left of it after the touch-down.

use std::ops::Range;

use nalgebra::Vector3;

use super::assembly::{Row, Rows};
use super::owner::RowOwner;
use super::stabilization::{Recovery, gap_bias, gap_recovery};
use crate::model::wide::Lanes;
use crate::scene::StepPlan;
use crate::sim::contact::ContactCandidate;
use crate::sim::lcp::Bound;
use crate::sim::memory::ContactForces;
use crate::sim::per_body::Motions;
use crate::sim::spatial::SpatialForce;

/// Compliance of contacts in the feedforward pass, as a share of the whole character's mobility.
///
/// A rigid character on four feet has twelve contact forces for six degrees of freedom: many distributions solve its
/// equations, and a solver would find one that depends on its warm start. With compliance the distribution is unique,
/// and the sum of the forces is less by no more than a hundredth.
const COMPLIANCE: f64 = 1e-2;

/// How contacts give way in the feedforward pass of `plan`, for a character of `mass` kg and a step of `step` seconds.
pub fn of_feedforward(plan: &StepPlan, mass: f64, step: f64) -> ContactLaw<'static> {
    ContactLaw::Rigid {
        recovery: Recovery::of_unilateral(plan).translation,
        compliance: COMPLIANCE * step / mass,
    }
}

/// Where the forces of `candidate` begin in the feedforward pass.
///
/// Coulomb's law leaves several answers where joints whose motion is prescribed wedge feet against the ground. The solver starts
/// without forces, so that which of them it finds depends on the state alone: begun from the forces of the step before, walks of a
/// quadruped that were driven with this pass ended 5 mm apart after 64 ms, from the same state, at any two steps. Forces
/// between bodies of a character that the pass takes as one rigid whole are not solved for: they are those `last` seen.
pub fn feedforward_guess(candidate: &ContactCandidate, last: &ContactForces) -> [f64; 3] {
    if candidate.against.body().is_some() { last.at(candidate.slot) } else { [0.0; 3] }
}

/// How a contact gives way.
#[derive(Debug, Clone, Copy)]
pub enum ContactLaw<'a> {
    /// Not at all.
    Rigid {
        /// Greatest speed at which a penetration is corrected, m/s.
        recovery: f64,
        /// Compliance of ground and obstacles, (m/s)/N.
        compliance: f64,
    },
    /// As a spring.
    Soft {
        /// Its time constant T, s.
        time_constant: f64,
        /// Velocities of the bodies before the step.
        old: &'a Motions,
    },
}

impl ContactLaw<'_> {
    /// What is taken from the free velocities along the normal and the tangents of `candidate`, m/s: the velocities that it asks for.
    /// `free` is the free velocity of its point.
    fn asked(self, candidate: &ContactCandidate, free: &Vector3<f64>, step: f64) -> [f64; 3] {
        let gap = -candidate.depth;
        let [normal, tangents @ ..] = candidate.frame;
        let Self::Soft { time_constant, old } = self else { return [-gap_bias(gap, step), 0.0, 0.0] };
        let free = normal.dot(free);
        let old = candidate.slip(|body| old.at(body));
        if gap > 0.0 && gap + step * free >= 0.0 {
            return [-gap / step, 0.0, 0.0];
        }
        // The part of the step before the gap closes.
        let apart = gap.max(0.0) / (step * free.abs()).max(f64::MIN_POSITIVE);
        let phase = (1.0 - apart) * step / time_constant;
        let closing = normal.dot(&old) * (1.0 - apart) + free * apart;
        let pushed = closing - phase / time_constant * gap.min(0.0);
        let [first, second] = tangents.map(|tangent| tangent.dot(&old) / (1.0 + 2.0 * phase));
        [pushed / ((1.0 + phase) * (1.0 + phase)), first, second]
    }

    /// Speed at which positions leave a penetration, m/s: that of a soft contact belongs to it.
    fn recovery(self, gap: f64, step: f64) -> f64 {
        match self {
            Self::Rigid { recovery, .. } => gap_recovery(gap, step, recovery),
            Self::Soft { .. } => 0.0,
        }
    }

    /// Compliance of `candidate`, (m/s)/N.
    fn compliance(self, candidate: &ContactCandidate) -> f64 {
        match self {
            Self::Rigid { compliance, .. } if candidate.against.body().is_none() => compliance,
            Self::Rigid { .. } | Self::Soft { .. } => 0.0,
        }
    }
}

/// Adds the rows of all `candidates`.
///
/// `free` is each body's velocity if no row acted; `warm_start` gives the forces to start from; `half_solve` half-solves the rows of
/// forces on a candidate's body (see [`Rows::push`]).
#[allow(clippy::too_many_arguments)] // the ingredients of eq. 27, each from another stage
#[inline(always)] // compiled for the processor of `step`
pub fn add(
    rows: &mut Rows,
    candidates: &[ContactCandidate],
    free: &Motions,
    friction: Option<f64>,
    step: f64,
    law: ContactLaw<'_>,
    warm_start: impl Fn(&ContactCandidate) -> [f64; 3],
    mut half_solve: impl FnMut(&ContactCandidate, &[SpatialForce], &mut Vec<Lanes>) -> Range<usize>,
) {
    for candidate in candidates {
        let owner = RowOwner::Contact { link: candidate.link };
        let velocity = candidate.slip(|body| free.at(body));
        let softness = law.compliance(candidate);
        let asked = law.asked(candidate, &velocity, step);
        let guess = warm_start(candidate);
        let normal = rows.len();
        let [up, tangents @ ..] = candidate.frame;
        let free = up.dot(&velocity);
        let gap = -candidate.depth;
        let mut bias = -asked[0];
        if gap + step * free < 0.0 && candidate.rebound > 0.0 {
            bias = bias.min(-candidate.rebound);
            rows.rebound_next(free, candidate.rebound);
        }
        let recovery = law.recovery(gap, step);
        let above = Row {
            warm_start: guess[0],
            recovery,
            softness,
            ..Row::new(owner, Bound::NonNegative, free + bias)
        };
        let push = SpatialForce::at(candidate.at, up);
        if friction.is_none() {
            rows.push([above], |numbers| half_solve(candidate, &[push], numbers));
            continue;
        }
        let bound = Bound::Friction { normal, coefficient: candidate.material.friction };
        let [first, second] = std::array::from_fn(|index| Row {
            warm_start: guess[index + 1],
            softness,
            ..Row::new(owner, bound, tangents[index].dot(&velocity) - asked[index + 1])
        });
        let [along, across] = tangents.map(|tangent| SpatialForce::at(candidate.at, tangent));
        rows.push([above, first, second], |numbers| half_solve(candidate, &[push, along, across], numbers));
    }
}

/// Number of rows of a contact.
pub fn rows_per_contact(friction: Option<f64>) -> usize {
    if friction.is_some() { 3 } else { 1 }
}
