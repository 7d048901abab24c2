//! Boxed convex problems: against enumeration of the active sets, and among the solvers.

use super::contacts::Numbers;
use super::{any_interval, assert_laws, greatest_difference, solved, solvers};
use gaitwright_physics::sim::lcp::{Bound, Lemke, Problem};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// The solution of a boxed problem by trying every set of active bounds (3ⁿ linear systems).
fn by_enumeration(problem: &Problem<'_>) -> Option<Vec<f64>> {
    let n = problem.rows();
    let matrix = DMatrix::from_row_slice(n, n, problem.matrix);
    let ends = |row: usize| match problem.bounds[row] {
        Bound::Free => [f64::NEG_INFINITY, f64::INFINITY],
        Bound::NonNegative => [0.0, f64::INFINITY],
        Bound::Box { lower, upper } => [lower, upper],
        Bound::Friction { .. } => panic!("no interval"),
    };
    'sets: for set in 0..3_usize.pow(n as u32) {
        let mut lambda = DVector::zeros(n);
        let mut free = Vec::new();
        for row in 0..n {
            match set / 3_usize.pow(row as u32) % 3 {
                2 => free.push(row),
                end if ends(row)[end].is_finite() => lambda[row] = ends(row)[end],
                _ => continue 'sets,
            }
        }
        let still = &matrix * &lambda + DVector::from_column_slice(problem.offset);
        let block = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
        let wanted = DVector::from_fn(free.len(), |i, _| -still[free[i]]);
        if !free.is_empty() {
            let Some(values) = block.lu().solve(&wanted) else { continue };
            for (row, value) in free.iter().zip(values.iter()) {
                lambda[*row] = *value;
            }
        }
        let w = &matrix * &lambda + DVector::from_column_slice(problem.offset);
        let fits = (0..n).all(|row| {
            let [lower, upper] = ends(row);
            let inside = lambda[row] >= lower - 1e-12 && lambda[row] <= upper + 1e-12;
            inside
                && match set / 3_usize.pow(row as u32) % 3 {
                    0 => w[row] >= -1e-12,
                    1 => w[row] <= 1e-12,
                    _ => true,
                }
        });
        if fits {
            return Some(lambda.as_slice().to_vec());
        }
    }
    None
}

/// A = G Gᵀ + ¼ I, so that the solution is unique.
fn convex_problem(rows: std::ops::RangeInclusive<usize>) -> impl Strategy<Value = Numbers> {
    rows.prop_flat_map(|n| {
        (
            prop::collection::vec(-1.0..1.0_f64, n * n),
            prop::collection::vec(-2.0..2.0_f64, n),
            prop::collection::vec(any_interval(), n),
        )
            .prop_map(move |(entries, offset, bounds)| {
                let g = DMatrix::from_vec(n, n, entries);
                let matrix = &g * g.transpose() + 0.25 * DMatrix::<f64>::identity(n, n);
                Numbers { matrix: matrix.as_slice().to_vec(), offset, bounds }
            })
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

    #[test]
    fn small_convex_problems_agree_with_enumeration(numbers in convex_problem(1..=5)) {
        let problem = numbers.problem(false);
        let expected = by_enumeration(&problem).expect("a convex problem has a solution");
        for (name, mut solver) in solvers() {
            let lambda = solved(name, solver.as_mut(), &problem);
            prop_assert!(greatest_difference(&lambda, &expected) <= 1e-8, "{}: {:?}", name, lambda);
        }
    }

    #[test]
    fn larger_convex_problems_agree_among_the_solvers(numbers in convex_problem(6..=24)) {
        let problem = numbers.problem(false);
        let exact = solved("lemke", &mut Lemke::new(2_000), &problem);
        assert_laws(&problem, &exact, 1e-9);
        for (name, mut solver) in solvers() {
            let lambda = solved(name, solver.as_mut(), &problem);
            prop_assert!(greatest_difference(&lambda, &exact) <= 1e-8, "{}", name);
        }
    }
}
