//! The half-solved numbers of rows, stored so that a problem's matrix consists of small products of fixed length.
//!
//! With M⁻¹ = Xᵀ X a row of the Jacobian becomes x = X Jᵀ: [`ROOT`] numbers of the root, and one for every joint or other
//! place that the row reaches. Rows that reach the same places stand side by side in [`LANES`].

use multiversion::multiversion;
use std::ops::Range;

use crate::model::wide::{LANES, Lanes};
use crate::sim::lcp::dot;

/// Numbers of a half-solved row that belong to the root.
pub const ROOT: usize = 6;

/// Rows that follow each other and reach the same places.
#[derive(Debug, Clone)]
struct Group {
    /// The first row.
    first: usize,
    /// How many there are, at most [`LANES`].
    count: usize,
    /// Places beyond the root's, with all between the first and the last.
    places: Range<usize>,
    /// Where its numbers begin: the root's, and one for each place.
    start: usize,
}

/// The half-solved numbers of all rows.
#[derive(Debug, Clone, Default)]
pub struct HalfSolved {
    /// All rows, in order.
    groups: Vec<Group>,
    numbers: Vec<Lanes>,
}

impl HalfSolved {
    /// Room for `capacity` rows of `width` numbers each, even if no two of them stand side by side.
    pub fn new(capacity: usize, width: usize) -> Self {
        Self { groups: Vec::with_capacity(capacity), numbers: Vec::with_capacity(capacity * width) }
    }

    /// Removes all rows.
    pub fn clear(&mut self) {
        self.groups.clear();
        self.numbers.clear();
    }

    /// Adds `count` rows, the first of which is row `first`. `half_solve` appends their numbers side by side, those of the
    /// root and those of the places that they reach, which it returns.
    pub fn push(
        &mut self,
        first: usize,
        count: usize,
        half_solve: impl FnOnce(&mut Vec<Lanes>) -> Range<usize>,
    ) {
        let start = self.numbers.len();
        let places = half_solve(&mut self.numbers);
        debug_assert_eq!(self.numbers.len() - start, ROOT + places.len(), "a number for each place");
        match self.groups.last_mut() {
            Some(last) if last.places == places && last.count + count <= LANES => {
                let (before, added) = self.numbers.split_at_mut(start);
                for (lanes, added) in before[last.start..].iter_mut().zip(added) {
                    lanes[last.count..last.count + count].copy_from_slice(&added[..count]);
                }
                last.count += count;
                self.numbers.truncate(start);
            }
            _ => self.groups.push(Group { first, count, places, start }),
        }
    }

    /// The group of row `row`, and its lane.
    fn find(&self, row: usize) -> (&Group, usize) {
        let group = &self.groups[self.groups.partition_point(|group| group.first <= row) - 1];
        debug_assert!(row < group.first + group.count, "row {row} is there");
        (group, row - group.first)
    }

    /// The numbers of row `row`.
    fn of(&self, row: usize) -> impl Iterator<Item = f64> {
        let (group, lane) = self.find(row);
        let numbers = &self.numbers[group.start..group.start + ROOT + group.places.len()];
        numbers.iter().map(move |lanes| lanes[lane])
    }

    /// Sets the numbers of row `row` to zero.
    pub fn disable(&mut self, row: usize) {
        let (group, lane) = self.find(row);
        let range = group.start..group.start + ROOT + group.places.len();
        self.numbers[range].iter_mut().for_each(|lanes| lanes[lane] = 0.0);
    }

    /// Whether all numbers of row `row` are zero.
    pub fn is_disabled(&self, row: usize) -> bool {
        self.of(row).all(|number| number == 0.0)
    }

    /// The sum of the squares of row `row`: J M⁻¹ Jᵀ.
    pub fn square(&self, row: usize) -> f64 {
        self.of(row).map(|number| number * number).sum()
    }

    /// The dot products of the rows of one group, each a row, with those of another.
    #[inline(always)] // part of the kernels
    fn meet(&self, own: &Group, other: &Group) -> [Lanes; LANES] {
        // The three rows of a contact hardly ever have others beside them.
        if own.count < LANES {
            self.meet_rows::<{ LANES - 1 }>(own, other)
        } else {
            self.meet_rows::<LANES>(own, other)
        }
    }

    /// The same of a group of no more than `ROWS` rows.
    #[inline(always)] // part of the kernels
    fn meet_rows<const ROWS: usize>(&self, own: &Group, other: &Group) -> [Lanes; LANES] {
        let (left, right) = (&self.numbers[own.start..], &self.numbers[other.start..]);
        let mut block = [[0.0; LANES]; LANES];
        if let (Some(left), Some(right)) = (left.first_chunk::<ROOT>(), right.first_chunk::<ROOT>()) {
            for (left, right) in left.iter().zip(right) {
                add_product(&mut block[..ROWS], left, right);
            }
        }
        let begin = own.places.start.max(other.places.start);
        let count = own.places.end.min(other.places.end).saturating_sub(begin);
        if count > 0 {
            let left = &left[ROOT + begin - own.places.start..][..count];
            let right = &right[ROOT + begin - other.places.start..][..count];
            for (left, right) in left.iter().zip(right) {
                add_product(&mut block[..ROWS], left, right);
            }
        }
        block
    }
}

/// Puts `block` where the rows of group `own` cross the columns of group `other`, which is not after it, in a matrix of `width` columns.
#[inline(always)] // part of the kernels
fn store(matrix: &mut [f64], width: usize, own: &Group, other: &Group, block: &[Lanes; LANES]) {
    for (row, lanes) in (own.first..own.first + own.count).zip(block) {
        match &mut matrix[row * width + other.first..(row + 1) * width] {
            // What is written beyond the group is written again with the next one.
            [a, b, c, d, ..] => [*a, *b, *c, *d] = *lanes,
            // Written out: a call of memcpy takes longer than three numbers.
            [a, b, c] => [*a, *b, *c] = [lanes[0], lanes[1], lanes[2]],
            [a, b] => [*a, *b] = [lanes[0], lanes[1]],
            [a] => *a = lanes[0],
            _ => {}
        }
    }
}

/// Puts `block` also where the rows of group `other` cross the columns of group `own`.
#[inline(always)] // part of the kernels
fn store_transposed(matrix: &mut [f64], width: usize, own: &Group, other: &Group, block: &[Lanes; LANES]) {
    for column in 0..other.count.min(LANES) {
        let start = (other.first + column) * width + own.first;
        for (entry, lanes) in matrix[start..start + own.count].iter_mut().zip(block) {
            *entry = lanes[column];
        }
    }
}

/// Adds the products of every number of `left`, each to a row of its own, with every one of `right`.
#[inline(always)] // eight instructions a row
fn add_product(block: &mut [Lanes], left: &Lanes, right: &Lanes) {
    for (lanes, left) in block.iter_mut().zip(left) {
        *lanes = std::array::from_fn(|lane| lanes[lane] + left * right[lane]);
    }
}

/// Fills `matrix` (row-major), which has a row and a column for each row, with the dot products of every two rows
/// times `scale`.
///
/// Every two rows meet in the root; those that reach the same places meet there too.
#[multiversion(targets("x86_64+avx2"))]
pub fn products(half: &HalfSolved, scale: f64, matrix: &mut [f64]) {
    let width = half.groups.last().map_or(0, |last| last.first + last.count);
    for (index, own) in half.groups.iter().enumerate() {
        for other in &half.groups[..=index] {
            let block = half.meet(own, other).map(|lanes| lanes.map(|product| scale * product));
            store(matrix, width, own, other, &block);
            if other.first != own.first {
                store_transposed(matrix, width, own, other, &block);
            }
        }
    }
}

/// The sum of all rows times `forces` and `scale`, into `sum`, which has a number for the root's and for all places.
#[multiversion(targets("x86_64+avx2"))]
pub fn combine(half: &HalfSolved, forces: &[f64], scale: f64, sum: &mut [f64]) {
    sum.fill(0.0);
    for group in &half.groups {
        let mut scales = [0.0; LANES];
        for (lane, force) in scales.iter_mut().zip(&forces[group.first..group.first + group.count]) {
            *lane = scale * force;
        }
        let (root, places) = half.numbers[group.start..].split_at(ROOT);
        let (sum_of_root, sum) = sum.split_at_mut(ROOT);
        let sum = &mut sum[group.places.start - ROOT..group.places.end - ROOT];
        // Two loops: one over both would ask at every number which of them it is in.
        for (sum, lanes) in sum_of_root.iter_mut().zip(root) {
            *sum += dot(&scales, lanes);
        }
        for (sum, lanes) in sum.iter_mut().zip(places) {
            *sum += dot(&scales, lanes);
        }
    }
}
