//! Small dense systems of linear equations.

use multiversion::multiversion;

/// Lanes in which rows are processed.
const LANES: usize = 4;

/// Length of a row of the augmented matrix of `m` equations: m + 1, rounded up to whole lanes.
pub(super) fn width(m: usize) -> usize {
    (m + 1).next_multiple_of(LANES)
}

/// Solves K y = r of `m` equations by elimination with partial pivoting, in place.
///
/// `augmented` has m rows of [`width`] entries: those of K, that of r, and padding. Afterwards y stands
/// in place of r, and the rest is rubbish. `None` when a pivot is zero or no number.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn solve(augmented: &mut [f64], m: usize) -> Option<()> {
    // A width that is known to the compiler makes a row's loop a few instructions.
    match width(m) {
        4 => eliminate(augmented, m, 4),
        8 => eliminate(augmented, m, 8),
        12 => eliminate(augmented, m, 12),
        16 => eliminate(augmented, m, 16),
        width => eliminate(augmented, m, width),
    }?;
    substitute_back(augmented, m)
}

/// Brings the equations into a triangle; for all see [`solve`].
#[inline(always)] // part of the kernels
fn eliminate(augmented: &mut [f64], m: usize, width: usize) -> Option<()> {
    for pivot in 0..m {
        let (upper, lower) = augmented.split_at_mut((pivot + 1) * width);
        let leader = upper.get_mut(pivot * width..)?;
        let mut greatest = leader[pivot].abs();
        let mut best = None;
        for (row, entries) in lower.chunks_exact(width).enumerate() {
            if entries[pivot].abs() > greatest {
                greatest = entries[pivot].abs();
                best = Some(row);
            }
        }
        if let Some(row) = best {
            leader.swap_with_slice(&mut lower[row * width..(row + 1) * width]);
        }
        if greatest == 0.0 || greatest.is_nan() {
            return None;
        }
        let inverse = 1.0 / leader[pivot];
        // Whole lanes: what the first of them does left of the pivot is never read.
        let first = pivot - pivot % LANES;
        let (leader, _) = leader[first..].as_chunks::<LANES>();
        for entries in lower.chunks_exact_mut(width) {
            let factor = entries[pivot] * inverse;
            let (entries, _) = entries[first..].as_chunks_mut::<LANES>();
            subtract(entries, leader, factor);
        }
    }
    Some(())
}

/// Subtracts `factor` times `leader` from `entries`.
#[inline(always)] // part of the kernels
fn subtract(entries: &mut [[f64; LANES]], leader: &[[f64; LANES]], factor: f64) {
    for (entries, lead) in entries.iter_mut().zip(leader) {
        *entries = std::array::from_fn(|lane| entries[lane] - factor * lead[lane]);
    }
}

/// Solves the triangle that the elimination leaves on and above the diagonal.
#[inline(always)] // part of the kernels
fn substitute_back(augmented: &mut [f64], m: usize) -> Option<()> {
    let width = width(m);
    for row in (0..m).rev() {
        let (upper, lower) = augmented.split_at_mut((row + 1) * width);
        let entries = upper.get_mut(row * width..)?;
        let mut sum = entries[m];
        for (coefficient, known) in entries[row + 1..m].iter().zip(lower.chunks_exact(width)) {
            sum -= coefficient * known[m];
        }
        entries[m] = sum / entries[row];
    }
    Some(())
}
