//! The rows of a step: what each asks of the new velocity, half-solved and gathered into one problem.

pub mod contact;
pub mod drive;
pub mod dry_friction;
pub mod joint;
pub mod limit;
pub mod lock;
pub mod loops;
pub mod torque;

use std::ops::Range;

use super::lcp::{Bound, Problem, dot};
use super::reduced::response::ROOT;

/// Rows whose shares of the root are computed side by side.
const LANES: usize = 4;

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
    /// The actuator of a joint, within its greatest torque.
    Torque(usize),
    /// What drives a joint without bounds, and its damping and rotor, where they have a row.
    Drive(usize),
    /// What holds the two bodies of a joint together.
    Joint(usize),
    /// What closes a loop.
    Loop(usize),
    /// The lock of the root's rotation.
    TrunkLock,
}

/// A row but for its half-solved numbers.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// What it belongs to.
    pub owner: Owner,
    /// Bound of its force.
    pub bound: Bound,
    /// J v_free + bias, m/s or rad/s.
    pub offset: f64,
    /// Added to its diagonal entry of A, (m/s)/N or the like.
    pub softness: f64,
    /// Where to start to look for its force, N or N m.
    pub guess: f64,
    /// Speed at which it corrects its position, m/s or rad/s: positions move along velocities for which w is
    /// greater by it.
    pub recovery: f64,
}

impl Row {
    /// A row that nothing softens or corrects, and of whose force nothing is known.
    pub fn new(owner: Owner, bound: Bound, offset: f64) -> Self {
        Self { owner, bound, offset, softness: 0.0, guess: 0.0, recovery: 0.0 }
    }
}

/// Rows that follow each other and reach the same joints.
#[derive(Debug, Clone)]
struct Limb {
    rows: Range<usize>,
    /// Of their half-solved numbers, those between the first joint's and the last one's that are not zero.
    joints: Range<usize>,
}

/// The rows of a step and the mixed complementarity problem that they make.
///
/// Row i asks for w_i = (J v⁺)_i + bias_i under its bound; A = h J M⁻¹ Jᵀ + softness and
/// b = J v_free + bias, where v_free is the velocity that no row acts on (Tokizaki & Hasegawa
/// eqs. 26-27).
#[derive(Debug, Clone, Default)]
pub struct Rows {
    width: usize,
    half: Vec<f64>,
    /// The root's numbers of [`LANES`] rows at a time, each of the six for all of them; 0 beyond the last row.
    root: Vec<[[f64; LANES]; ROOT]>,
    /// All rows, in order.
    limbs: Vec<Limb>,
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
            root: Vec::with_capacity(capacity.div_ceil(LANES)),
            limbs: Vec::with_capacity(capacity),
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
        self.limbs.clear();
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

    /// Adds `row`, whose half-solved numbers `half_solve` fills in. They are zero before, and stay zero but for the
    /// root's and for the range that it returns.
    pub fn push(&mut self, row: Row, half_solve: impl FnOnce(&mut [f64]) -> Range<usize>) {
        let index = self.len();
        let start = self.half.len();
        self.half.resize(start + self.width, 0.0);
        let joints = half_solve(&mut self.half[start..]);
        match self.limbs.last_mut() {
            Some(limb) if limb.joints == joints => limb.rows.end = index + 1,
            _ => self.limbs.push(Limb { rows: index..index + 1, joints }),
        }
        self.owner.push(row.owner);
        self.bounds.push(row.bound);
        self.offset.push(row.offset);
        self.softness.push(row.softness);
        self.recovery.push(row.recovery);
        self.force.push(row.guess);
    }

    /// Row `row` asks for nothing and does nothing from here on.
    pub fn silence(&mut self, row: usize) {
        self.half[row * self.width..(row + 1) * self.width].fill(0.0);
        self.offset[row] = 0.0;
    }

    /// Whether nothing moves row `row`.
    pub fn is_silent(&self, row: usize) -> bool {
        self.half[row * self.width..(row + 1) * self.width].iter().all(|entry| *entry == 0.0)
    }

    /// How much a unit of the force of row `row` moves it: J M⁻¹ Jᵀ.
    pub fn mobility(&self, row: usize) -> f64 {
        let half = &self.half[row * self.width..(row + 1) * self.width];
        dot(half, half)
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
    /// Every two rows meet in the root. Rows of different limbs meet there alone; others add the joints that
    /// they have in common.
    pub fn assemble(&mut self, step: f64) {
        let count = self.len();
        self.matrix.resize(count * count, 0.0);
        self.meet_in_root(step);
        self.meet_in_joints(step);
        self.mirror();
        for (diagonal, softness) in self.matrix.iter_mut().step_by(count + 1).zip(&self.softness) {
            *diagonal += softness;
        }
    }

    /// Sets the entries on and below the diagonal to the root's share, [`LANES`] columns at a time.
    fn meet_in_root(&mut self, step: f64) {
        let count = self.len();
        let rows = || self.half.chunks_exact(self.width).filter_map(|half| half.first_chunk::<ROOT>());
        self.root.clear();
        self.root.resize(count.div_ceil(LANES), [[0.0; LANES]; ROOT]);
        for (row, half) in rows().enumerate() {
            for (lanes, entry) in self.root[row / LANES].iter_mut().zip(half) {
                lanes[row % LANES] = *entry;
            }
        }
        for (row, (left, entries)) in rows().zip(self.matrix.chunks_exact_mut(count.max(1))).enumerate() {
            for (right, entries) in self.root.iter().zip(entries.chunks_mut(LANES)).take(row / LANES + 1) {
                let products = dot_lanes(left, right).map(|product| step * product);
                match entries.first_chunk_mut::<LANES>() {
                    Some(entries) => *entries = products,
                    None => entries.copy_from_slice(&products[..entries.len()]),
                }
            }
        }
    }

    /// Adds to the entries on and below the diagonal the share of the joints that both rows reach.
    fn meet_in_joints(&mut self, step: f64) {
        let count = self.len();
        let Self { width, half, limbs, matrix, .. } = self;
        for (index, own) in limbs.iter().enumerate() {
            for other in &limbs[..=index] {
                let start = own.joints.start.max(other.joints.start);
                let end = own.joints.end.min(other.joints.end);
                if start >= end {
                    continue;
                }
                for row in own.rows.clone() {
                    let left = &half[row * *width + start..row * *width + end];
                    for column in other.rows.start..other.rows.end.min(row + 1) {
                        let right = &half[column * *width + start..column * *width + end];
                        matrix[row * count + column] += step * dot(left, right);
                    }
                }
            }
        }
    }

    /// Copies what stands below the diagonal to its place above.
    fn mirror(&mut self) {
        let count = self.len();
        for row in 1..count {
            let (above, below) = self.matrix.split_at_mut(row * count);
            for (mirrored, entry) in above.iter_mut().skip(row).step_by(count).zip(below) {
                *mirrored = *entry;
            }
        }
    }

    /// The problem, and the forces to be found.
    pub fn problem(&mut self, cone: bool) -> (Problem<'_>, &mut [f64]) {
        let problem = Problem { matrix: &self.matrix, offset: &self.offset, bounds: &self.bounds, cone };
        (problem, &mut self.force)
    }

    /// The half-solved impulse of all forces over `step` seconds, into `half`; once the matrix is computed.
    pub fn impulse(&self, step: f64, half: &mut [f64]) {
        half.fill(0.0);
        for limb in &self.limbs {
            for row in limb.rows.clone() {
                let scale = self.force[row] * step;
                let start = row * self.width;
                for range in [0..ROOT, limb.joints.clone()] {
                    let entries = &self.half[start + range.start..start + range.end];
                    for (sum, entry) in half[range].iter_mut().zip(entries) {
                        *sum += scale * entry;
                    }
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

/// The dot products of the root's share of one row with those of [`LANES`] others.
#[inline]
fn dot_lanes(left: &[f64; ROOT], right: &[[f64; LANES]; ROOT]) -> [f64; LANES] {
    let mut sums = [0.0; LANES];
    for (a, lanes) in left.iter().zip(right) {
        sums = std::array::from_fn(|lane| sums[lane] + a * lanes[lane]);
    }
    sums
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
