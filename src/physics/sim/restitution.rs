//! How far contacts may rebound: an impact returns no more energy than its restitution.
//!
//! A contact that closes asks for Newton's rebound, w_n⁺ ≥ −e w_n⁻. With Coulomb friction, or at several points at once,
//! forces that achieve it can do positive work (Kane's double pendulum; Stronge 1990, "Rigid body collisions with
//! friction"). So all rebounds of a step are scaled by the greatest share s ≤ 1 for which the work of the forces satisfies
//!
//! W(s) ≤ (1 − e²) W(0),
//!
//! Stronge's energetic restitution for the impact as a whole: of what a plastic impact (s = 0) takes, no more than the
//! share e² is given back.
//!
//! **Work.** The impulses h λ of contacts, limits and dry friction change their velocities from w⁻, those without them, to w⁺, and
//! do the work W = h λᵀ (w⁻ + w⁺) / 2. In w⁻ all other rows have the forces that they would have without the impact
//! ([`WithoutImpact`]): those of motors hold the dampers, the springs and, in maximal coordinates, the rotors of their joints as well, and
//! what these give in answer to the impact is no work of a motor's. With rows that are linear this is to eliminate them: w⁺ = w⁻ + Ã λ,
//! Ã being the Schur complement in A = h J M⁻¹ Jᵀ. So both systems of coordinates give the same work, though the reduced one has
//! joints, springs, dampers and rotors in its M.
//!
//! **W(0) ≤ 0.** In a plastic impact λ_i w_i⁺ ≤ 0 in every row of it: a contact's normal velocity vanishes or closes
//! what is left of the gap, as does that of a limit; friction opposes sliding or there is none. And λᵀ (w⁺ − w⁻) ≥ 0: A is positive
//! semidefinite, and the laws of the other rows are monotone, an equation or an interval in which a motor does what it
//! can to bring its velocity to 0, so that the velocities of the impact are a monotone function of its forces (Cottle, Pang & Stone
//! 1992, section 3.5). So W(0) = h (λᵀ w⁺ − λᵀ (w⁺ − w⁻) / 2) ≤ 0. For 0 ≤ e ≤ 1 therefore W(s) ≤ 0: whatever the
//! friction, the number of points and the solver's choice among several solutions, impacts make no energy.
//!
//! **What remains Newton's.** Without friction, where all contacts that push rebound, λ grows by 1 + e and
//! W(1) = (1 − e²) W(0): nothing is scaled. Friction that goes on sliding the same way takes more than that.
//!
//! A row's velocity counts with its bias. Of a contact that does not rebound, w⁺ ≥ −gap / h, that is too much by
//! λ gap / h ≥ 0, which the bound then has to spare.

use super::lcp::{Solution, Solver};
use super::rows::Rows;
use super::rows::without_impact::WithoutImpact;

/// Share of the plastic impact's loss that rounding and the solver's residual may amount to.
const ROUNDING: f64 = 1e-10;

/// The share has been found when the work is within this part of the plastic impact's loss, or the share within
/// [`NEGLIGIBLE_SHARE`], of the bound.
const NEGLIGIBLE_WORK: f64 = 1e-9;
const NEGLIGIBLE_SHARE: f64 = 1e-10;

/// Greatest number of shares tried.
const TRIALS: usize = 60;

/// Scales the rebounds of `rows` down to what `restitution` (0 to 1) allows. `newton` is the solution with whole rebounds,
/// whose forces the rows hold; `kept` and `without` are scratch memory. Gives the solution with the scaled ones, whose forces the rows
/// then hold.
pub fn bound(
    rows: &mut Rows,
    solver: &mut impl Solver,
    cone: bool,
    restitution: f64,
    newton: Solution,
    (kept, without): (&mut Vec<f64>, &mut WithoutImpact),
) -> Solution {
    without.solve(rows, solver);
    let whole = rows.work_of_impact(1.0, &without.forces);
    kept.clone_from(&rows.force);
    let mut work_at = |rows: &mut Rows, share: f64| {
        rows.ask_for_rebounds(share);
        let (problem, force) = rows.problem(cone);
        let solution = solver.solve(&problem, force);
        (solution, rows.work_of_impact(share, &without.forces))
    };
    let (mut best, plastic) = work_at(rows, 0.0);
    let loss = (-plastic).max(0.0);
    let allowed = -(1.0 - restitution * restitution) * loss;
    if whole <= allowed + ROUNDING * loss {
        std::mem::swap(&mut rows.force, kept);
        rows.ask_for_rebounds(1.0);
        return newton;
    }
    kept.clone_from(&rows.force);
    // The root of the excess between both shares, by the Illinois form of regula falsi with a bisection at times.
    let (mut within, mut beyond) = ([0.0, plastic - allowed], [1.0, whole - allowed]);
    let mut last_within = None;
    for trial in 0..TRIALS {
        let width = beyond[0] - within[0];
        let part = if trial % 4 == 3 { 0.5 } else { within[1] / (within[1] - beyond[1]) };
        let share = within[0] + part.clamp(0.0, 1.0) * width;
        let (solution, work) = work_at(rows, share);
        let excess = work - allowed;
        let is_within = excess <= 0.0;
        if is_within {
            within = [share, excess];
            best = solution;
            kept.clone_from(&rows.force);
        } else {
            beyond = [share, excess];
        }
        let found = is_within && excess >= -NEGLIGIBLE_WORK * loss;
        if found || beyond[0] - within[0] <= NEGLIGIBLE_SHARE {
            break;
        }
        if last_within == Some(is_within) {
            let other = if is_within { &mut beyond } else { &mut within };
            other[1] *= 0.5;
        }
        last_within = Some(is_within);
    }
    rows.ask_for_rebounds(within[0]);
    std::mem::swap(&mut rows.force, kept);
    best
}
