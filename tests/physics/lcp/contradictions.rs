//! Random problems of which it is known exactly whether they have a solution.
//!
//! With A = J M⁻¹ Jᵀ and multipliers y with yᵀ J = 0, yᵀ w = yᵀ b whatever the forces. Where y ≥ 0 in unilateral rows and
//! yᵀ b < 0, no forces give velocities that satisfy all rows (Farkas): w ≥ 0 and w = 0 would make yᵀ w ≥ 0. With b = J v the
//! rows can be satisfied, by stopping, and a solution exists although the rows depend on each other. Entries of J are eighths, those
//! of y integers, and those of M powers of two, so that none of this is lost in rounding.

use super::contacts::Numbers;
use super::{assert_laws, rng};
use gaitwright_physics::sim::lcp::{Bound, Equality, Newton, Pgs, Problem, SolveStatus, Solver};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Unilateral,
    /// Some rows are equalities.
    Mixed,
    /// Every row is that of a contact's normal, with two of friction.
    Contacts {
        cone: bool,
    },
}

const KINDS: [Kind; 4] =
    [Kind::Unilateral, Kind::Mixed, Kind::Contacts { cone: true }, Kind::Contacts { cone: false }];

fn eighths(rng: &mut ChaCha8Rng) -> f64 {
    f64::from(rng.random_range(-8..=8_i32)) / 8.0
}

/// Rows that depend on each other. They contradict each other by `gap` m/s; with 0 they do not.
fn dependent(rng: &mut ChaCha8Rng, kind: Kind, decades: i32, gap: f64) -> Numbers {
    let (freedoms, linked) = (rng.random_range(2..=6), rng.random_range(2..=5));
    let normals = linked + rng.random_range(0..=4);
    let each = if matches!(kind, Kind::Contacts { .. }) { 3 } else { 1 };
    let powers = (f64::from(decades) * 10_f64.log2() / 2.0) as i32;
    let inverse: Vec<f64> = (0..freedoms).map(|_| 2_f64.powi(rng.random_range(-powers..=powers))).collect();
    let mut rows: Vec<Vec<f64>> =
        (0..normals * each).map(|_| (0..freedoms).map(|_| eighths(rng)).collect()).collect();
    let free: Vec<bool> = (0..normals).map(|_| kind == Kind::Mixed && rng.random()).collect();
    let last = (linked - 1) * each;
    let mut sum = vec![0.0; freedoms];
    for row in 0..linked - 1 {
        let sign = if free[row] && rng.random() { -1.0 } else { 1.0 };
        let multiplier = sign * f64::from(rng.random_range(1..=4_i32));
        sum.iter_mut().zip(&rows[row * each]).for_each(|(sum, entry)| *sum -= multiplier * entry);
    }
    rows[last] = sum;
    let velocity: Vec<f64> = (0..freedoms).map(|_| eighths(rng)).collect();
    let product = |left: &[f64], right: &[f64]| -> f64 { left.iter().zip(right).map(|(a, b)| a * b).sum() };
    let mut offset: Vec<f64> = rows.iter().map(|row| product(row, &velocity)).collect();
    offset[last] -= gap;
    let weighed = |row: &[f64]| -> Vec<f64> { row.iter().zip(&inverse).map(|(a, b)| a * b).collect() };
    let matrix = rows.iter().flat_map(|row| rows.iter().map(move |other| product(&weighed(row), other)));
    let bounds = (0..normals).flat_map(|normal| {
        let own = if free[normal] { Bound::Free } else { Bound::NonNegative };
        let friction = Bound::Friction { normal: normal * each, coefficient: 0.5 };
        [own, friction, friction].into_iter().take(each)
    });
    Numbers { matrix: matrix.collect(), offset, bounds: bounds.collect() }
}

fn greatest(problem: &Problem<'_>, lambda: &[f64]) -> [f64; 2] {
    let n = lambda.len();
    let made_of =
        |row: usize| -> f64 { (0..n).map(|k| (problem.matrix[row * n + k] * lambda[k]).abs()).sum() };
    let asked = problem.offset.iter().fold(0.0_f64, |asked, b| asked.max(b.abs()));
    [(0..n).map(made_of).fold(0.0, f64::max), asked]
}

fn warm(rng: &mut ChaCha8Rng, rows: usize) -> Vec<f64> {
    let size = [0.0, 100.0, 1e6, 1e12][rng.random_range(0..4)];
    (0..rows).map(|_| size * rng.random_range(0.0..1.0)).collect()
}

/// Whatever the masses, the start and the size of the contradiction, down to two thousand times the tolerance, and for
/// equalities, which are eliminated, thirty thousand times.
#[test]
fn what_has_no_solution_is_never_called_solved_and_its_forces_are_bounded() {
    let mut rng = rng(41);
    for kind in KINDS {
        for case in 0..1000 {
            let gap = 2_f64.powi(rng.random_range(if kind == Kind::Mixed { -15..=1 } else { -19..=1 }));
            let numbers = dependent(&mut rng, kind, case % 7, gap);
            let problem = numbers.problem(kind == Kind::Contacts { cone: true });
            let mut lambda = warm(&mut rng, problem.rows());
            let solution = Equality::new(Newton::new(50, 1e-9), 1e-9).solve(&problem, &mut lambda);
            assert!(
                matches!(solution.status, SolveStatus::Singular | SolveStatus::IterationLimit),
                "{kind:?}, {case}: {solution:?}"
            );
            // The multipliers are at most 4 and at most 5: |yᵀ w| ≥ gap in one of the rows.
            assert!(solution.residual >= gap / 20.0, "{kind:?}, {case}, {gap}: {solution:?}");
            let [made_of, asked] = greatest(&problem, &lambda);
            let share = if kind == Kind::Mixed { 1e-8 } else { 1e-9 };
            assert!(f64::EPSILON * made_of <= share * asked.max(1.0), "{kind:?}, {case}: {made_of:e}");
            let mut lambda = vec![0.0; problem.rows()];
            let swept = Equality::new(Pgs::new(200, 1e-9), 1e-9).solve(&problem, &mut lambda);
            assert_ne!(swept.status, SolveStatus::Solved, "{kind:?}, {case}");
        }
    }
}

/// Redundant rows leave many forces to choose from, but their velocities are those that any solution has.
#[test]
fn what_has_a_solution_is_solved_although_its_rows_depend_on_each_other() {
    let mut rng = rng(42);
    for kind in KINDS {
        let mut unsolved = 0;
        for case in 0..1000 {
            let numbers = dependent(&mut rng, kind, case % 3, 0.0);
            let problem = numbers.problem(kind == Kind::Contacts { cone: true });
            let mut lambda = vec![0.0; problem.rows()];
            let solution = Equality::new(Newton::new(50, 1e-9), 1e-9).solve(&problem, &mut lambda);
            if solution.status == SolveStatus::Solved {
                assert_laws(&problem, &lambda, 1e-7);
            } else {
                unsolved += 1;
            }
        }
        // Friction on few freedoms is not always solved (see `few_freedoms`).
        let most = if matches!(kind, Kind::Contacts { .. }) { 20 } else { 0 };
        assert!(unsolved <= most, "{kind:?}: {unsolved} unsolved");
    }
}
