//! Cholesky's factor of a symmetric positive semidefinite matrix, by rows that begin at their first entry.
//!
//! Below the first entry of a row the factor fills in, before it there is nothing to store or compute
//! (Jennings 1966). Rows in the order of a tree from its leaves to its root make a factor of a few entries
//! each: the cost of a chain grows with its length.
//!
//! A row that depends on those before it leaves a pivot that is rounding alone. It gets the force 0 and
//! is passed over; if the rows do not contradict each other, the others satisfy it with theirs. What is
//! rounding shows only beside pivots that are not: a weak row that came first (a planar loop's, nearly across its
//! plane) would leave weak pivots to the strong ones that it depends on, and forces without bound. So weak
//! rows are delayed to the end (Duff & Reid 1983 do so in indefinite systems).

use super::residual::dot;

/// A pivot below this share of its row's diagonal is rounding. Mass ratios of 10⁶ between the bodies
/// of a chain leave 10⁻⁶.
pub(super) const DEPENDENT: f64 = 1e-12;

/// A row whose pivot is below this share of its own diagonal or of the greatest waits for the others.
const WEAK: f64 = 1e-6;

/// A diagonal entry below this share of the greatest is rounding: nothing moves the row, as one across the
/// plane of a planar loop.
const IMMOBILE: f64 = 1e-16;

/// The factor L of L Lᵀ = A.
#[derive(Debug, Clone, Default)]
pub(super) struct Skyline {
    /// n, the first column of each row.
    first: Vec<usize>,
    /// n + 1, where each row begins in `entries`.
    start: Vec<usize>,
    /// The rows from their first column up to the diagonal, without it.
    entries: Vec<f64>,
    /// n, 1 / L_ii, or 0 for a row that depends on those before it.
    inverse: Vec<f64>,
}

impl Skyline {
    /// Factorises the part of the `stride` × `stride` matrix `matrix` (row-major) in the rows and columns
    /// `chosen`, whose weak rows are moved to its end.
    pub(super) fn factorise(&mut self, matrix: &[f64], stride: usize, chosen: &mut [usize]) {
        self.first.clear();
        self.start.clear();
        self.entries.clear();
        self.inverse.clear();
        self.start.push(0);
        let greatest = chosen.iter().map(|row| matrix[row * (stride + 1)]).fold(0.0, f64::max);
        let mut in_order = chosen.len();
        let mut row = 0;
        while row < chosen.len() {
            let begin = self.entries.len();
            let (first, pivot) = self.eliminate(matrix, stride, &chosen[..=row]);
            let diagonal = matrix[chosen[row] * (stride + 1)];
            if row < in_order && pivot <= WEAK * greatest.max(diagonal) {
                self.entries.truncate(begin);
                chosen[row..].rotate_left(1);
                in_order -= 1;
                continue;
            }
            self.first.push(first);
            self.start.push(self.entries.len());
            self.inverse.push(if pivot > DEPENDENT * diagonal && diagonal > IMMOBILE * greatest {
                1.0 / pivot.sqrt()
            } else {
                0.0
            });
            row += 1;
        }
    }

    /// Appends the entries of the last row of `chosen`, whose other rows have theirs. Returns its first column and
    /// its pivot.
    fn eliminate(&mut self, matrix: &[f64], stride: usize, chosen: &[usize]) -> (usize, f64) {
        let row = chosen.len() - 1;
        let source = &matrix[chosen[row] * stride..(chosen[row] + 1) * stride];
        let first = chosen[..row].iter().position(|column| source[*column] != 0.0).unwrap_or(row);
        let begin = self.entries.len();
        self.entries.extend(chosen[first..row].iter().map(|column| source[*column]));
        let (before, entries) = self.entries.split_at_mut(begin);
        for column in first..row {
            let common = first.max(self.first[column]);
            let other = &before[self.start[column]..self.start[column + 1]];
            let known = dot(&entries[common - first..column - first], &other[common - self.first[column]..]);
            entries[column - first] = (entries[column - first] - known) * self.inverse[column];
        }
        (first, source[chosen[row]] - dot(entries, entries))
    }

    /// Whether row `row` depends on those before it.
    pub(super) fn is_dependent(&self, row: usize) -> bool {
        self.inverse[row] == 0.0
    }

    /// L⁻¹ x in place of `x`.
    pub(super) fn half_solve(&self, x: &mut [f64]) {
        let zeros = x.iter().position(|entry| *entry != 0.0).unwrap_or(x.len());
        for row in zeros..x.len() {
            let begin = zeros.max(self.first[row]).min(row);
            let entries = &self.entries[self.start[row]..self.start[row + 1]];
            let known = dot(&entries[begin - self.first[row]..], &x[begin..row]);
            x[row] = (x[row] - known) * self.inverse[row];
        }
    }

    /// L⁻ᵀ x in place of `x`.
    pub(super) fn finish(&self, x: &mut [f64]) {
        for row in (0..x.len()).rev() {
            let (before, rest) = x.split_at_mut(row);
            rest[0] *= self.inverse[row];
            let entries = &self.entries[self.start[row]..self.start[row + 1]];
            for (entry, known) in before[self.first[row]..].iter_mut().zip(entries) {
                *entry -= known * rest[0];
            }
        }
    }
}
