//! The rows of a step and the complementarity problem that they make.

use std::ops::Range;

use super::half_solved::{self, HalfSolved};
use super::owner::RowOwner;
use crate::model::wide::Lanes;
use crate::sim::lcp::{Bound, Problem};

/// Half-solved numbers of a row for which there is room from the beginning; hardly a row has more.
const WIDTH: usize = 64;

/// A row without its half-solved numbers.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// What it belongs to.
    pub owner: RowOwner,
    /// Bound of its force.
    pub bound: Bound,
    /// J v_free + bias, m/s or rad/s.
    pub offset: f64,
    /// Added to its diagonal entry of A, (m/s)/N or the like.
    pub softness: f64,
    /// Force that the solver starts from, N or N m.
    pub warm_start: f64,
    /// Speed at which it corrects its position, m/s or rad/s: added to w in the velocities along which positions move.
    pub recovery: f64,
}

impl Row {
    /// A row without softness, correction or warm start.
    pub fn new(owner: RowOwner, bound: Bound, offset: f64) -> Self {
        Self { owner, bound, offset, softness: 0.0, warm_start: 0.0, recovery: 0.0 }
    }
}

/// The rows of a step and the mixed complementarity problem that they make.
///
/// Row i asks for w_i = (J v⁺)_i + bias_i under its bound; A = h J M⁻¹ Jᵀ + softness and
/// b = J v_free + bias, where v_free is the velocity that no row acts on (Tokizaki & Hasegawa
/// eqs. 26-27).
#[derive(Debug, Clone, Default)]
pub struct Rows {
    half: HalfSolved,
    matrix: Vec<f64>,
    softness: Vec<f64>,
    /// Speed at which each row corrects its position, m/s or rad/s.
    recovery: Vec<f64>,
    /// Bound of every row's force.
    pub bounds: Vec<Bound>,
    /// J v_free + bias, m/s or rad/s.
    pub offset: Vec<f64>,
    /// Forces, N or N m: the warm start before the solve, the solution after it.
    pub force: Vec<f64>,
    /// What each row belongs to.
    pub owner: Vec<RowOwner>,
    /// The normal rows that ask for a rebound.
    rebounds: Vec<Rebound>,
}

/// A normal row that asks for a rebound.
#[derive(Debug, Clone, Copy)]
struct Rebound {
    row: usize,
    /// J v_free, m/s.
    free: f64,
    /// Speed of separation by Newton's law, m/s.
    speed: f64,
}

impl Rows {
    /// Room for `capacity` rows of up to `width` numbers each.
    pub fn new(capacity: usize, width: usize) -> Self {
        Self {
            half: HalfSolved::new(capacity, width.min(WIDTH)),
            matrix: Vec::with_capacity(capacity * capacity),
            softness: Vec::with_capacity(capacity),
            recovery: Vec::with_capacity(capacity),
            bounds: Vec::with_capacity(capacity),
            offset: Vec::with_capacity(capacity),
            force: Vec::with_capacity(capacity),
            owner: Vec::with_capacity(capacity),
            rebounds: Vec::new(),
        }
    }

    /// Makes room for `capacity` rows that ask for a rebound.
    pub fn reserve_rebounds(&mut self, capacity: usize) {
        self.rebounds.reserve(capacity);
    }

    /// Removes all rows.
    pub fn clear(&mut self) {
        self.half.clear();
        self.softness.clear();
        self.recovery.clear();
        self.bounds.clear();
        self.offset.clear();
        self.force.clear();
        self.owner.clear();
        self.rebounds.clear();
    }

    /// Lets the row added next, a contact's normal one with J v_free = `free`, ask for a rebound at `speed`, m/s.
    pub fn rebound_next(&mut self, free: f64, speed: f64) {
        self.rebounds.push(Rebound { row: self.len(), free, speed });
    }

    /// Whether a row asks for a rebound.
    pub fn has_rebounds(&self) -> bool {
        !self.rebounds.is_empty()
    }

    /// Makes the problem that of rebounds at `share` of their speeds.
    pub fn ask_for_rebounds(&mut self, share: f64) {
        for Rebound { row, free, speed } in &self.rebounds {
            self.offset[*row] = free - share * speed;
        }
    }

    /// Entry of the matrix.
    pub(super) fn entry(&self, row: usize, other: usize) -> f64 {
        self.matrix[row * self.len() + other]
    }

    /// Mean power of the forces of impact over the step, W (times the step it is their work, J), where rebounds have `share` of their
    /// speeds: λᵀ (w⁻ + w⁺) / 2 over their rows, with w⁻ as it is with the forces `without` impact, one a row (see `sim/restitution.rs`).
    pub fn work_of_impact(&self, share: f64, without: &[f64]) -> f64 {
        let count = self.len();
        let mut work = 0.0;
        for (row, entries) in self.matrix.chunks_exact(count.max(1)).enumerate() {
            let force = self.force[row];
            if force == 0.0 || !self.owner[row].is_impact() {
                continue;
            }
            let mut velocity = self.offset[row];
            for ((entry, with), without) in entries.iter().zip(&self.force).zip(without) {
                velocity += 0.5 * entry * (with + without);
            }
            work += force * velocity;
        }
        for Rebound { row, speed, .. } in &self.rebounds {
            work += self.force[*row] * share * speed;
        }
        work
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.bounds.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// Adds `rows`, no more than [`LANES`](crate::model::wide::LANES). `half_solve` appends their half-solved numbers side by side: those of the
    /// root and one for each place of the range that it returns.
    pub fn push<const COUNT: usize>(
        &mut self,
        rows: [Row; COUNT],
        half_solve: impl FnOnce(&mut Vec<Lanes>) -> Range<usize>,
    ) {
        self.half.push(self.len(), COUNT, half_solve);
        self.owner.extend(rows.iter().map(|row| row.owner));
        self.bounds.extend(rows.iter().map(|row| row.bound));
        self.offset.extend(rows.iter().map(|row| row.offset));
        self.softness.extend(rows.iter().map(|row| row.softness));
        self.recovery.extend(rows.iter().map(|row| row.recovery));
        self.force.extend(rows.iter().map(|row| row.warm_start));
    }

    /// Removes the effect of row `row`: its condition is fulfilled whatever the velocities, and its force has no effect.
    pub fn disable(&mut self, row: usize) {
        self.half.disable(row);
        self.offset[row] = 0.0;
    }

    /// Whether row `row` has no effect.
    pub fn is_disabled(&self, row: usize) -> bool {
        self.half.is_disabled(row)
    }

    /// Mobility of row `row`, J M⁻¹ Jᵀ: its acceleration by a unit of its force.
    pub fn mobility(&self, row: usize) -> f64 {
        self.half.square(row)
    }

    /// Whether a row corrects its position.
    pub fn needs_recovery(&self) -> bool {
        self.recovery.iter().any(|speed| *speed != 0.0)
    }

    /// Makes the problem that of the velocities along which positions move, or again that of the step.
    pub fn ask_for_recovery(&mut self, asked: bool) {
        let sign = if asked { -1.0 } else { 1.0 };
        for (offset, speed) in self.offset.iter_mut().zip(&self.recovery) {
            *offset += sign * speed;
        }
    }

    /// Computes the matrix for a step of `step` seconds.
    pub fn assemble(&mut self, step: f64) {
        let count = self.len();
        self.matrix.resize(count * count, 0.0);
        half_solved::products(&self.half, step, &mut self.matrix);
        for (diagonal, softness) in self.matrix.iter_mut().step_by(count + 1).zip(&self.softness) {
            *diagonal += softness;
        }
    }

    /// The problem, and the forces to be found.
    pub fn problem(&mut self, cone: bool) -> (Problem<'_>, &mut [f64]) {
        let problem = Problem {
            matrix: &self.matrix,
            symmetric: true,
            offset: &self.offset,
            bounds: &self.bounds,
            cone,
            enough: 0.0,
        };
        (problem, &mut self.force)
    }

    /// The half-solved impulse of all forces over `step` seconds, into `half`.
    pub fn impulse(&self, step: f64, half: &mut [f64]) {
        half_solved::combine(&self.half, &self.force, step, half);
    }

    /// What the first row belongs to of which a number is not finite, or else its velocity at the forces so far; where all are, the row
    /// whose velocity strays farthest from what its bound asks at its force. `None` without rows.
    pub fn worst(&self) -> Option<RowOwner> {
        let count = self.len();
        let stray = |row: usize| {
            let entries = &self.matrix[row * count..(row + 1) * count];
            if !(self.offset[row].is_finite() && entries.iter().all(|entry| entry.is_finite())) {
                return f64::INFINITY;
            }
            let moved: f64 = entries.iter().zip(&self.force).map(|(entry, force)| entry * force).sum();
            let velocity = self.offset[row] + moved;
            if !velocity.is_finite() {
                return f64::MAX;
            }
            let (lower, upper) = self.bounds[row].interval(&self.force);
            match self.force[row] {
                force if force <= lower => (-velocity).max(0.0),
                force if force >= upper => velocity.max(0.0),
                _ => velocity.abs(),
            }
        };
        (0..count).rev().max_by(|a, b| stray(*a).total_cmp(&stray(*b))).map(|row| self.owner[row])
    }
}
