//! How far forces are from solving a problem, in one number, and the projection behind it.

use super::problem::{Bound, Problem};
use multiversion::multiversion;

/// Rounding error of a sum as a share of the magnitudes that it is made of. Errors of single operations, of half this each,
/// mostly cancel.
const ROUNDING: f64 = f64::EPSILON;

/// Share of the greatest velocity in b that rounding errors may be.
pub(super) const NEGLIGIBLE: f64 = 1e-9;

/// The natural-map residual of `lambda`, m/s or rad/s: how far the velocities are from what the
/// bounds ask for, the greatest over the rows.
///
/// For a row with bounds lo ≤ λ ≤ hi (Cottle, Pang & Stone 1992, section 1.4, with the diagonal of A
/// the factor from a force to the velocity that it causes) it is
///
/// a |λ − clamp(λ − w/a, lo, hi)| = |min(a (λ − lo), max(w, a (λ − hi)))|,
///
/// where a = A_ii, or 1 where A_ii ≤ 0. In words: the velocity error of a row strictly inside its
/// bounds is w itself; a row at a bound errs only by a velocity in the forbidden direction; and a
/// force outside its bound counts by the velocity that it makes. Friction rows have lo = −μ max(λ_n, 0)
/// and hi = μ max(λ_n, 0); for the cone both rows count together with the projection onto the disc of
/// that radius in place of the clamp, and a is the larger of their two diagonals. A λ with residual 0
/// solves the problem.
///
/// Velocities are differences of what forces do, and forces can be so great that these numbers no longer show whether they
/// cancel: between two walls that approach each other, forces of 10¹⁶ N would seem to hold them up. Where the rounding errors
/// of w may be more than a billionth of the velocities in b, the residual is at least as great as these errors.
///
/// NaN when `lambda` or the problem holds a number that is not finite, or when their lengths disagree.
pub fn residual(problem: &Problem<'_>, lambda: &[f64]) -> f64 {
    if problem.refusal(lambda).is_some() {
        return f64::NAN;
    }
    evaluate(problem, lambda, &mut vec![0.0; lambda.len()])
}

/// The residual of `lambda`, whose velocities w = A λ + b are left in `velocity` (n).
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn evaluate(problem: &Problem<'_>, lambda: &[f64], velocity: &mut [f64]) -> f64 {
    velocities(problem, lambda, velocity);
    let poison = poison(velocity);
    let (mut worst, mut square, mut greatest) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut row = 0;
    while row < problem.rows() {
        let block = error_of_block(problem, row, lambda, velocity);
        worst = worst.max(block.error);
        square = square.max(block.square);
        greatest = greater(greatest, block.scale);
        row += block.rows;
    }
    // One root for all of them.
    worst = worst.max(square.sqrt());
    let (reach, asked) = reach_and_asked(problem, lambda, greatest);
    if ROUNDING * reach > NEGLIGIBLE * asked {
        let uncertain = uncertainty(problem, lambda);
        if uncertain > NEGLIGIBLE * asked {
            worst = worst.max(uncertain);
        }
    }
    worst + poison
}

/// Zero as long as every number is finite, and NaN where one is not: `max` would pass over a NaN.
#[inline(always)] // part of the kernels
fn poison(numbers: &[f64]) -> f64 {
    in_lanes(numbers, |sum, number| sum + 0.0 * number, |one, other| one + other)
}

/// Folds `numbers` from 0 by `add` in four lanes, so that it becomes vector instructions, and those by `join`.
#[inline(always)] // part of the kernels
fn in_lanes(numbers: &[f64], add: impl Fn(f64, f64) -> f64, join: impl Fn(f64, f64) -> f64) -> f64 {
    let (whole, rest) = numbers.as_chunks::<4>();
    let mut lanes = [0.0; 4];
    for numbers in whole {
        lanes = std::array::from_fn(|lane| add(lanes[lane], numbers[lane]));
    }
    for (lane, number) in lanes.iter_mut().zip(rest) {
        *lane = add(*lane, *number);
    }
    join(join(lanes[0], lanes[2]), join(lanes[1], lanes[3]))
}

/// A bound of the sums of magnitudes that make up the velocities, but for b, that costs no product with A: no entry of a
/// semidefinite matrix is greater than its greatest diagonal entry, `diagonal`. And the greatest velocity in b.
#[inline(always)] // part of the kernels
fn reach_and_asked(problem: &Problem<'_>, lambda: &[f64], diagonal: f64) -> (f64, f64) {
    let forces = in_lanes(lambda, |sum, force| sum + force.abs(), |one, other| one + other);
    let asked = in_lanes(problem.offset, |asked, b| greater(asked, b.abs()), greater);
    (if problem.symmetric { diagonal * forces } else { f64::INFINITY }, asked)
}

/// The greater of two numbers. Not `max`, which looks for NaN as well.
#[inline(always)] // part of the kernels
fn greater(one: f64, other: f64) -> f64 {
    if other > one { other } else { one }
}

/// How far the computed velocities of `lambda` may be from those that it causes, m/s or rad/s.
fn uncertainty(problem: &Problem<'_>, lambda: &[f64]) -> f64 {
    ROUNDING * greatest_velocity(problem, lambda)
}

/// Whether rounding errors of the velocities of `lambda` are more than `tolerance` and more than `share` of the velocities in b.
pub(super) fn is_beyond_numbers(problem: &Problem<'_>, lambda: &[f64], tolerance: f64, share: f64) -> bool {
    let diagonal = (0..problem.rows()).map(|row| row_scale(problem, row)).fold(0.0, greater);
    let (reach, asked) = reach_and_asked(problem, lambda, diagonal);
    let most = tolerance.max(share * asked);
    // The bound costs no product with A, and in most problems it is far below.
    ROUNDING * (reach + asked) > most && uncertainty(problem, lambda) > most
}

/// Puts A λ + b into `velocity`.
#[inline(always)] // part of the kernels
pub(super) fn velocities(problem: &Problem<'_>, lambda: &[f64], velocity: &mut [f64]) {
    let n = lambda.len();
    let mut done = 0;
    if problem.symmetric {
        // As many at once as there are registers for, which saves loading every force again. Four contacts have twelve rows, and
        // a number of rows that the compiler knows makes the loop a few instructions.
        done = match n {
            12 => by_columns::<3>(problem, 12, lambda, velocity, done),
            n => by_columns::<3>(problem, n, lambda, velocity, done),
        };
        done = by_columns::<1>(problem, n, lambda, velocity, done);
    }
    let rows = problem.matrix.chunks_exact(n.max(1)).zip(problem.offset);
    for (w, (row, b)) in velocity.iter_mut().zip(rows).skip(done) {
        *w = dot(row, lambda) + b;
    }
}

/// Puts velocities of a symmetric problem of `n` rows into `velocity` from row `done` on, four times `BLOCKS` side by side from what stands in their
/// columns, for as long as so many rows are left. Returns how many are done then.
#[inline(always)] // part of the kernels
fn by_columns<const BLOCKS: usize>(
    problem: &Problem<'_>,
    n: usize,
    lambda: &[f64],
    velocity: &mut [f64],
    mut done: usize,
) -> usize {
    while done + 4 * BLOCKS <= n {
        let columns = done..done + 4 * BLOCKS;
        let mut sums = [[0.0; 4]; BLOCKS];
        sums.as_flattened_mut().copy_from_slice(&problem.offset[columns.clone()]);
        for (row, force) in problem.matrix.chunks_exact(n).zip(lambda) {
            let (entries, _) = row[columns.clone()].as_chunks::<4>();
            for (sums, entries) in sums.iter_mut().zip(entries) {
                *sums = std::array::from_fn(|lane| sums[lane] + entries[lane] * force);
            }
        }
        velocity[columns].copy_from_slice(sums.as_flattened());
        done += 4 * BLOCKS;
    }
    done
}

/// The greatest sum of the magnitudes that make up a row's velocity, m/s or rad/s.
pub(super) fn greatest_velocity(problem: &Problem<'_>, lambda: &[f64]) -> f64 {
    let rows = problem.matrix.chunks_exact(lambda.len().max(1)).zip(problem.offset);
    rows.map(|(row, b)| row.iter().zip(lambda).map(|(a, force)| (a * force).abs()).sum::<f64>() + b.abs())
        .fold(0.0, f64::max)
}

/// The natural map of the block of rows that begins at `row` (see [`Problem::block`]).
pub(super) fn error(problem: &Problem<'_>, row: usize, lambda: &[f64], velocity: &[f64]) -> f64 {
    let BlockError { error, square, .. } = error_of_block(problem, row, lambda, velocity);
    error.max(square.sqrt())
}

/// The natural map of a block of rows that are bounded together.
struct BlockError {
    /// m/s or rad/s; 0 of the rows of a circular cone.
    error: f64,
    /// Of the rows of a circular cone its square, 0 of others.
    square: f64,
    /// The factor from a force to its velocity, the greatest of the block's.
    scale: f64,
    /// How many they are.
    rows: usize,
}

/// [`error`], and what else is found with it.
#[inline(always)] // part of the kernels
fn error_of_block(problem: &Problem<'_>, row: usize, lambda: &[f64], velocity: &[f64]) -> BlockError {
    let (force, w) = (lambda[row], velocity[row]);
    if let Bound::Friction { normal, coefficient } = problem.bounds[row]
        && problem.cone
    {
        let radius = coefficient * lambda[normal].max(0.0);
        let scale = tangent_scale(problem, row);
        let square = disc_error(scale, radius, [force, lambda[row + 1]], [w, velocity[row + 1]]);
        return BlockError { error: 0.0, square, scale, rows: 2 };
    }
    let scale = row_scale(problem, row);
    let error = match problem.bounds[row] {
        Bound::Free => w.abs(),
        Bound::NonNegative => (scale * force).min(w).abs(),
        bound => {
            let (lower, upper) = bound.interval(lambda);
            (scale * (force - lower)).min(w.max(scale * (force - upper))).abs()
        }
    };
    BlockError { error, square: 0.0, scale, rows: 1 }
}

/// The square of the natural map of both tangential rows of a contact with a circular cone.
#[inline(always)] // part of the kernels
fn disc_error(scale: f64, radius: f64, force: [f64; 2], w: [f64; 2]) -> f64 {
    let aim = [scale * force[0] - w[0], scale * force[1] - w[1]];
    if !reaches_beyond(aim, scale * radius) {
        square(w)
    } else {
        let shrink = scale * radius / norm(aim);
        square([scale * force[0] - shrink * aim[0], scale * force[1] - shrink * aim[1]])
    }
}

/// Moves every force of `lambda` to the nearest that its bound allows: the normals and boxes first,
/// then friction within what the normals leave. A force that is not finite stays as it is.
pub fn project(problem: &Problem<'_>, lambda: &mut [f64]) {
    let rows = problem.rows().min(lambda.len());
    let mut row = 0;
    while row < rows {
        match problem.bounds[row] {
            Bound::Friction { normal, coefficient } if row + 1 < rows => {
                // Its normal force may come later.
                let pressing = match (problem.bounds.get(normal), lambda.get(normal)) {
                    (Some(bound), Some(force)) => within_own_bound(*bound, *force),
                    _ => 0.0,
                };
                let tangent = [lambda[row], lambda[row + 1]];
                let radius = coefficient * pressing.max(0.0);
                [lambda[row], lambda[row + 1]] = within_friction(problem.cone, tangent, radius);
                row += 2;
            }
            bound => {
                lambda[row] = within_own_bound(bound, lambda[row]);
                row += 1;
            }
        }
    }
}

/// The nearest force that `bound` allows whatever the other forces are.
#[inline(always)] // part of the kernels
fn within_own_bound(bound: Bound, force: f64) -> f64 {
    match bound {
        Bound::NonNegative => at_least_zero(force),
        Bound::Box { lower, upper } => between(force, lower, upper),
        Bound::Free | Bound::Friction { .. } => force,
    }
}

/// The nearest force that friction of `radius` = μ λ_n allows.
pub(super) fn within_friction(cone: bool, force: [f64; 2], radius: f64) -> [f64; 2] {
    if cone { within_disc(force, radius) } else { force.map(|each| between(each, -radius, radius)) }
}

/// The nearest point of the disc of `radius` about the origin.
pub(super) fn within_disc(point: [f64; 2], radius: f64) -> [f64; 2] {
    if reaches_beyond(point, radius) { onto_rim(point, norm(point), radius) } else { point }
}

/// The point of the rim of the disc in the direction of `point`, whose norm is `reach`.
pub(super) fn onto_rim(point: [f64; 2], reach: f64, radius: f64) -> [f64; 2] {
    /// Keeps the point inside whatever way its norm is then rounded.
    const INSIDE: f64 = 1.0 - 4.0 * f64::EPSILON;
    let shrink = INSIDE * (radius / reach);
    point.map(|each| shrink * each)
}

/// Clamps without the panic of `f64::clamp`, and keeps NaN.
pub(super) fn between(value: f64, lower: f64, upper: f64) -> f64 {
    if value < lower {
        lower
    } else if value > upper {
        upper
    } else {
        value
    }
}

fn at_least_zero(value: f64) -> f64 {
    if value < 0.0 { 0.0 } else { value }
}

/// The end of the bound of a row that no force moves for which its velocity `w` asks, if there is one, as in the limit of a vanishing
/// diagonal.
#[inline(always)] // part of the kernels
pub(super) fn asked_end(w: f64, lower: f64, upper: f64) -> Option<f64> {
    if w > 0.0 && lower.is_finite() {
        Some(lower)
    } else if w < 0.0 && upper.is_finite() {
        Some(upper)
    } else {
        None
    }
}

/// The factor from a force of `row` to its velocity: its diagonal, or 1 where that is not positive.
pub(super) fn row_scale(problem: &Problem<'_>, row: usize) -> f64 {
    let diagonal = problem.matrix[row * (problem.rows() + 1)];
    if diagonal > 0.0 { diagonal } else { 1.0 }
}

/// The same for the two tangential rows from `row` on: the larger diagonal.
pub(super) fn tangent_scale(problem: &Problem<'_>, row: usize) -> f64 {
    let stride = problem.rows() + 1;
    let diagonal = problem.matrix[row * stride].max(problem.matrix[(row + 1) * stride]);
    if diagonal > 0.0 { diagonal } else { 1.0 }
}

pub(super) fn norm(vector: [f64; 2]) -> f64 {
    square(vector).sqrt()
}

/// Whether `vector` is longer than `radius`, by squares as long as these are finite.
#[inline(always)] // part of the kernels
pub(super) fn reaches_beyond(vector: [f64; 2], radius: f64) -> bool {
    let limit = radius * radius;
    if limit.is_finite() { square(vector) > limit } else { norm(vector) > radius }
}

fn square(vector: [f64; 2]) -> f64 {
    vector[0] * vector[0] + vector[1] * vector[1]
}

/// The scalar product, summed in four lanes so that it becomes vector instructions.
#[inline(always)] // part of the kernels
pub(in crate::sim) fn dot(left: &[f64], right: &[f64]) -> f64 {
    let (left, left_rest) = left.as_chunks::<4>();
    let (right, right_rest) = right.as_chunks::<4>();
    let mut lanes = [0.0; 4];
    for (a, b) in left.iter().zip(right) {
        for (lane, (a, b)) in lanes.iter_mut().zip(a.iter().zip(b)) {
            *lane += a * b;
        }
    }
    let rest: f64 = left_rest.iter().zip(right_rest).map(|(a, b)| a * b).sum();
    (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]) + rest
}
