//! Problems from the literature, and those without a solution.

use super::{assert_laws, greatest_difference, solvers};
use crate::common;
use gaitwright_physics::sim::lcp::{Bound, Lemke, Problem, Solution, SolveStatus};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// A file of `tests/reference/lcp`: w = M z + q, w ≥ 0, z ≥ 0, w · z = 0.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Textbook {
    /// Where the problem is from.
    source: String,
    #[serde(rename = "M")]
    matrix: Vec<Vec<f64>>,
    #[serde(rename = "q")]
    offset: Vec<f64>,
    /// Solutions given by the source or found by hand; none where there is none.
    #[serde(default)]
    solutions: Vec<Vec<f64>>,
    /// There is no other solution.
    #[serde(default)]
    unique: bool,
    /// y ≥ 0 with Mᵀ y ≤ 0 and q · y < 0, for which w · y < 0 whatever z ≥ 0 is: no z makes w ≥ 0.
    infeasible_because: Option<Vec<f64>>,
    /// Why no solution exists though some z ≥ 0 makes w ≥ 0.
    unsolvable_because: Option<String>,
}

/// Tries every solver on M (by rows) and q; Lemke's has to solve it, in at most `pivots`. Its solution.
fn solve(name: &str, matrix: &[f64], offset: &[f64], pivots: usize) -> Vec<f64> {
    let n = offset.len();
    let mut z = vec![0.0; n];
    let solution = Lemke::new(100).solve_standard(matrix, offset, &mut z);
    assert_eq!(solution.status, SolveStatus::Solved, "{name}");
    assert!(solution.residual <= 1e-10, "{name}: {solution:?}");
    assert!(solution.iterations as usize <= pivots, "{name} took {solution:?}");
    let bounds = vec![Bound::NonNegative; n];
    let problem = Problem { matrix, symmetric: false, offset, bounds: &bounds, cone: false, enough: 0.0 };
    assert_laws(&problem, &z, 1e-10);
    // The iterative ones are not made for every one of these, but state so.
    for (_, mut solver) in solvers() {
        let mut z = vec![0.0; n];
        if solver.solve(&problem, &mut z).status == SolveStatus::Solved {
            assert_laws(&problem, &z, 1e-9);
        }
    }
    z
}

/// Every solver states that it has found no solution; Lemke's, that it ended on a ray.
fn refuse(name: &str, matrix: &[f64], offset: &[f64]) {
    let n = offset.len();
    let Solution { status, .. } = Lemke::new(100).solve_standard(matrix, offset, &mut vec![0.0; n]);
    assert_eq!(status, SolveStatus::Ray, "{name}");
    let bounds = vec![Bound::NonNegative; n];
    let problem = Problem { matrix, symmetric: false, offset, bounds: &bounds, cone: false, enough: 0.0 };
    for (solver_name, mut solver) in solvers() {
        let status = solver.solve(&problem, &mut vec![0.0; n]).status;
        assert_ne!(status, SolveStatus::Solved, "{solver_name} on {name}");
    }
}

/// The files of a folder that end so, by name.
fn files(folder: &Path, extension: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|it| it == extension))
        .collect();
    paths.sort();
    paths
}

#[test]
fn textbook_problems_are_solved_or_have_no_solution() {
    let (mut solved, mut infeasible, mut singular) = (0, 0, 0);
    for path in files(&common::reference_path("lcp"), "json") {
        let problem: Textbook = serde_json::from_value(common::json(&path)).unwrap();
        let (name, n) = (path.file_stem().unwrap().to_string_lossy(), problem.offset.len());
        assert!(!problem.source.is_empty(), "{name} is from somewhere");
        assert!(problem.matrix.len() == n && problem.matrix.iter().all(|row| row.len() == n), "{name}");
        let matrix = problem.matrix.concat();
        if let Some(proof) = &problem.infeasible_because {
            assert!(proof.len() == n && proof.iter().all(|y| *y >= 0.0), "{name}");
            let along =
                |column: usize| (0..n).map(|row| problem.matrix[row][column] * proof[row]).sum::<f64>();
            assert!((0..n).all(|column| along(column) <= 0.0), "{name} is infeasible");
            assert!(proof.iter().zip(&problem.offset).map(|(y, q)| y * q).sum::<f64>() < 0.0, "{name}");
        }
        if problem.infeasible_because.is_some() || problem.unsolvable_because.is_some() {
            assert!(problem.solutions.is_empty(), "{name}");
            refuse(&name, &matrix, &problem.offset);
            infeasible += 1;
            continue;
        }
        let found = solve(&name, &matrix, &problem.offset, 4 * n);
        assert!(!problem.solutions.is_empty(), "{name}");
        let bounds = vec![Bound::NonNegative; n];
        let numbers = Problem {
            matrix: &matrix,
            symmetric: false,
            offset: &problem.offset,
            bounds: &bounds,
            cone: false,
            enough: 0.0,
        };
        for known in &problem.solutions {
            assert_laws(&numbers, known, 1e-12);
        }
        if problem.unique {
            assert!(greatest_difference(&found, &problem.solutions[0]) <= 1e-10, "{name}: {found:?}");
        }
        solved += 1;
        let determinant = nalgebra::DMatrix::from_row_slice(n, n, &matrix).determinant();
        singular += usize::from(determinant.abs() < 1e-12);
    }
    assert!(solved >= 7 && infeasible >= 4 && singular >= 2, "{solved}, {infeasible}, {singular}");
}

/// The lower triangular matrix with ones on its diagonal and twos below it.
fn twos_below(n: usize) -> Vec<f64> {
    let entry = |row: usize, column: usize| match row.cmp(&column) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => 2.0,
    };
    (0..n * n).map(|at| entry(at / n, at % n)).collect()
}

/// Murty 1988, chapter 6: methods that pivot on the first violated row take 2ⁿ − 1 pivots. Only z₁ = 1 is not zero.
#[test]
fn a_problem_that_costs_naive_pivoting_exponentially_many_steps_costs_few() {
    for n in 1..=16 {
        let z = solve(&format!("n = {n}"), &twos_below(n), &vec![-1.0; n], 4 * n);
        let mut wanted = vec![0.0; n];
        wanted[0] = 1.0;
        assert!(greatest_difference(&z, &wanted) <= 1e-10, "n = {n}: {z:?}");
    }
}

/// Fathi 1979: the positive definite L Lᵀ with L from above, on which Lemke's own method may take 2ⁿ pivots. Only
/// z₁ = 1 is not zero.
#[test]
fn a_problem_that_costs_lemke_s_method_exponentially_many_steps_is_solved() {
    for n in 1..=6 {
        let lower = twos_below(n);
        let product = |row: usize, column: usize| {
            (0..n).map(|k| lower[row * n + k] * lower[column * n + k]).sum::<f64>()
        };
        let matrix: Vec<f64> = (0..n * n).map(|at| product(at / n, at % n)).collect();
        let z = solve(&format!("n = {n}"), &matrix, &vec![-1.0; n], 1 << n);
        let mut wanted = vec![0.0; n];
        wanted[0] = 1.0;
        assert!(greatest_difference(&z, &wanted) <= 1e-10, "n = {n}: {z:?}");
    }
}

/// A string over a flat obstacle under an even load (Cottle, Pang & Stone 2009, section 1.2): where it hangs free its
/// shape is the parabola z_i = i (n + 1 − i) / 2.
#[test]
fn a_string_hangs_as_a_parabola() {
    for n in [1, 2, 5, 20] {
        let entry = |row: usize, column: usize| match row.abs_diff(column) {
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        };
        let matrix: Vec<f64> = (0..n * n).map(|at| entry(at / n, at % n)).collect();
        let z = solve(&format!("n = {n}"), &matrix, &vec![-1.0; n], 4 * n);
        let wanted: Vec<f64> = (1..=n).map(|i| (i * (n + 1 - i)) as f64 / 2.0).collect();
        assert!(greatest_difference(&z, &wanted) <= 1e-9 * n as f64, "n = {n}: {z:?}");
    }
}

#[test]
fn a_problem_without_solution_ends_on_a_ray() {
    for (matrix, offset) in [(vec![0.0], vec![-1.0]), (vec![1.0, -1.0, -1.0, 1.0], vec![-1.0, 0.0])] {
        let mut z = vec![0.0; offset.len()];
        assert_eq!(Lemke::new(100).solve_standard(&matrix, &offset, &mut z).status, SolveStatus::Ray);
    }
}

#[test]
fn ties_do_not_make_the_pivoting_go_in_circles() {
    // Murty 1988: principal pivoting cycles on this circulant P-matrix.
    let matrix = [1.0, 2.0, 0.0, 0.0, 1.0, 2.0, 2.0, 0.0, 1.0];
    let mut z = [0.0; 3];
    let solution = Lemke::new(20).solve_standard(&matrix, &[-1.0; 3], &mut z);
    assert_eq!(solution.status, SolveStatus::Solved);
    assert!(greatest_difference(&z, &[1.0 / 3.0; 3]) <= 1e-12);
}

/// Reads n, M and q of a file in the form of Siconos: the first number, then five more sizes, M by rows, and q.
fn read_siconos(text: &str) -> (usize, Vec<f64>, Vec<f64>) {
    let mut numbers = text.split_whitespace().map_while(|word| word.parse::<f64>().ok());
    let n = numbers.next().expect("a size") as usize;
    let mut numbers = numbers.skip(5);
    let matrix: Vec<f64> = numbers.by_ref().take(n * n).collect();
    let offset: Vec<f64> = numbers.take(n).collect();
    assert!(matrix.len() == n * n && offset.len() == n);
    (n, matrix, offset)
}

#[test]
#[ignore = "needs problems from elsewhere: set ROBOT_REFERENCE_DIR or ROBOT_URDF_DIR"]
fn problems_from_elsewhere_are_solved_or_have_no_solution() {
    let paths = files(&common::robot_reference().join("lcp"), "dat");
    assert!(paths.len() >= 8);
    let mut infeasible = 0;
    for path in paths {
        let name = path.display().to_string();
        let (n, matrix, offset) = read_siconos(&std::fs::read_to_string(&path).unwrap());
        // A row without a positive entry and with negative q: w < 0 there for every z ≥ 0.
        if (0..n).any(|row| offset[row] < 0.0 && matrix[row * n..(row + 1) * n].iter().all(|a| *a <= 0.0)) {
            refuse(&name, &matrix, &offset);
            infeasible += 1;
            continue;
        }
        solve(&name, &matrix, &offset, 4 * n);
    }
    assert!(infeasible <= 1);
}
