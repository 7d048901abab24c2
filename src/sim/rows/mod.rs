//! The rows of a step: what each asks of the new velocity, half-solved and gathered into one problem.

pub mod contact;
pub mod dry_friction;
pub mod limit;
pub mod torque;

use std::ops::Range;

use super::lcp::{Bound, Problem};
use super::reduced::response::ROOT;

/// What a row belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Owner {
    /// A contact of a link: its normal row, or a tangential one.
    Contact {
        /// Index of the character's link.
        link: usize,
    },
    /// The lower end of a joint's range.
    LowerLimit(usize),
    /// The upper end of a joint's range.
    UpperLimit(usize),
    /// The dry friction of a joint.
    DryFriction(usize),
    /// The saturated actuator of a joint.
    Torque(usize),
}

/// The rows of a step and the mixed complementarity problem that they make.
///
/// Row i asks for w_i = (J v⁺)_i + bias_i under its bound; A = h J M⁻¹ Jᵀ + softness and
/// b = J v_free + bias, where v_free is the velocity that no row acts on (Tokizaki & Hasegawa
/// eqs. 26-27).
#[derive(Debug, Clone)]
pub struct Rows {
    width: usize,
    half: Vec<f64>,
    /// Of every row, the range of its half-solved numbers beyond the root's that are not zero.
    reach: Vec<Range<usize>>,
    matrix: Vec<f64>,
    softness: Vec<f64>,
    /// What each row's velocity is to be greater by while positions move, to correct them.
    recovery: Vec<f64>,
    /// Bound of every row's force.
    pub bounds: Vec<Bound>,
    /// J v_free + bias, m/s or rad/s.
    pub offset: Vec<f64>,
    /// Forces: the guess before the solve, the solution after it; N or N m.
    pub force: Vec<f64>,
    /// What each row belongs to.
    pub owner: Vec<Owner>,
}

impl Rows {
    /// Room for `capacity` rows of `width` numbers each.
    pub fn new(capacity: usize, width: usize) -> Self {
        Self {
            width,
            half: Vec::with_capacity(capacity * width),
            reach: Vec::with_capacity(capacity),
            matrix: Vec::with_capacity(capacity * capacity),
            softness: Vec::with_capacity(capacity),
            recovery: Vec::with_capacity(capacity),
            bounds: Vec::with_capacity(capacity),
            offset: Vec::with_capacity(capacity),
            force: Vec::with_capacity(capacity),
            owner: Vec::with_capacity(capacity),
        }
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
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.bounds.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// Adds a row and gives its half-solved numbers to be filled in.
    pub fn push(&mut self, owner: Owner, bound: Bound, offset: f64, softness: f64, guess: f64) -> &mut [f64] {
        let start = self.half.len();
        self.half.resize(start + self.width, 0.0);
        self.owner.push(owner);
        self.bounds.push(bound);
        self.offset.push(offset);
        self.softness.push(softness);
        self.recovery.push(0.0);
        self.force.push(guess);
        &mut self.half[start..]
    }

    /// Lets the last row correct its position at `speed` (m/s or rad/s): positions move along velocities
    /// for which w is greater by it.
    pub fn recover(&mut self, speed: f64) {
        if let Some(recovery) = self.recovery.last_mut() {
            *recovery = speed;
        }
    }

    /// Whether a row corrects its position.
    pub fn recovering(&self) -> bool {
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
    ///
    /// Rows of different limbs meet in the root alone, so that most entries are short sums.
    pub fn assemble(&mut self, step: f64) {
        let count = self.len();
        self.matrix.resize(count * count, 0.0);
        self.reach.clear();
        self.reach.extend(self.half.chunks_exact(self.width).map(reach));
        let rows = || self.half.chunks_exact(self.width).zip(&self.reach);
        for (row, (left, left_reach)) in rows().enumerate() {
            let (above, from_row) = self.matrix.split_at_mut(row * count);
            let columns = rows().take(row + 1).zip(&mut from_row[..=row]);
            for (column, ((right, right_reach), entry)) in columns.enumerate() {
                let start = left_reach.start.max(right_reach.start);
                let end = left_reach.end.min(right_reach.end).max(start);
                let joints: f64 = left[start..end].iter().zip(&right[start..end]).map(|(a, b)| a * b).sum();
                *entry = step * (root_dot(left, right) + joints);
                if column < row {
                    above[column * count + row] = *entry;
                }
            }
            from_row[row] += self.softness[row];
        }
    }

    /// The problem, and the forces to be found.
    pub fn problem(&mut self, cone: bool) -> (Problem<'_>, &mut [f64]) {
        let problem = Problem { matrix: &self.matrix, offset: &self.offset, bounds: &self.bounds, cone };
        (problem, &mut self.force)
    }

    /// The half-solved impulse of all forces over `step` seconds, into `half`.
    pub fn impulse(&self, step: f64, half: &mut [f64]) {
        half.fill(0.0);
        for (force, row) in self.force.iter().zip(self.half.chunks_exact(self.width)) {
            if *force != 0.0 {
                let scale = force * step;
                for (sum, entry) in half.iter_mut().zip(row) {
                    *sum += scale * entry;
                }
            }
        }
    }

    /// The row whose velocity at the solution is not finite or else strays farthest from what its
    /// bound asks, judged by its own natural-map residual; `None` without rows.
    pub fn worst(&self) -> Option<Owner> {
        let count = self.len();
        let stray = |row: usize| {
            let w: f64 = self.offset[row]
                + self.matrix[row * count..(row + 1) * count]
                    .iter()
                    .zip(&self.force)
                    .map(|(entry, force)| entry * force)
                    .sum::<f64>();
            let violation = match self.bounds[row] {
                Bound::NonNegative => (-w).max(0.0),
                _ => w.abs(),
            };
            if violation.is_nan() { f64::INFINITY } else { violation }
        };
        (0..count).max_by(|a, b| stray(*a).total_cmp(&stray(*b))).map(|row| self.owner[row])
    }
}

/// The range of a half-solved row's numbers beyond the root's that are not zero.
fn reach(half: &[f64]) -> Range<usize> {
    let joints = &half[ROOT..];
    let start = joints.iter().position(|entry| *entry != 0.0).unwrap_or(0);
    let end = joints.iter().rposition(|entry| *entry != 0.0).map_or(start, |last| last + 1);
    ROOT + start..ROOT + end
}

/// The root's share of the dot product of two half-solved rows.
#[inline]
fn root_dot(left: &[f64], right: &[f64]) -> f64 {
    let (Some(a), Some(b)) = (left.first_chunk::<ROOT>(), right.first_chunk::<ROOT>()) else { return 0.0 };
    (a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]) + (a[4] * b[4] + a[5] * b[5])
}

/// How much of a violation is corrected in a step.
const SHARE_PER_STEP: f64 = 0.2;

/// What keeps a gap from becoming negative: w + bias ≥ 0 for the new velocities, which may close a gap `gap` ≥ 0
/// within the step but not overdraw it.
fn gap_bias(gap: f64, step: f64) -> f64 {
    gap.max(0.0) / step
}

/// Speed at which a violated gap opens while positions move: a fifth of the violation each step, but never
/// faster than `fastest`, so that a character that starts deep in the ground rises instead of jumping.
fn gap_recovery(gap: f64, step: f64, fastest: f64) -> f64 {
    (SHARE_PER_STEP * (-gap).max(0.0) / step).min(fastest)
}
