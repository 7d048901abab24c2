//! Problems from the literature, and those without a solution.

use super::{assert_laws, greatest_difference, solvers};
use gaitwright_physics::sim::lcp::{Bound, Lemke, Problem, SolveStatus};
use std::path::PathBuf;

/// Reads n, M and q of a file: the first number, then five more sizes, M by rows, and q.
fn read_reference(text: &str) -> (usize, Vec<f64>, Vec<f64>) {
    let mut numbers = text.split_whitespace().map_while(|word| word.parse::<f64>().ok());
    let n = numbers.next().expect("a size") as usize;
    let mut numbers = numbers.skip(5);
    let matrix: Vec<f64> = numbers.by_ref().take(n * n).collect();
    let offset: Vec<f64> = numbers.take(n).collect();
    assert!(matrix.len() == n * n && offset.len() == n);
    (n, matrix, offset)
}

fn reference_folder() -> Option<PathBuf> {
    let robots = std::env::var_os("ROBOT_URDF_DIR")
        .map_or_else(|| crate::common::repository().join("../shared/robots"), PathBuf::from);
    let folder = robots.parent()?.join("reference/lcp");
    folder.is_dir().then_some(folder)
}

#[test]
fn textbook_problems_are_solved_or_have_no_solution() {
    let Some(folder) = reference_folder() else {
        println!("no reference problems found");
        return;
    };
    let mut names: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    assert!(names.len() >= 8);
    let mut infeasible = 0;
    for path in names {
        let (n, matrix, offset) = read_reference(&std::fs::read_to_string(&path).unwrap());
        let mut z = vec![0.0; n];
        let solution = Lemke::new(100).solve_standard(&matrix, &offset, &mut z);
        println!("{}: {solution:?}", path.display());
        // A row without a positive entry and with negative q: w < 0 there for every z ≥ 0.
        if (0..n).any(|row| offset[row] < 0.0 && matrix[row * n..(row + 1) * n].iter().all(|a| *a <= 0.0)) {
            assert_eq!(solution.status, SolveStatus::Ray, "{}", path.display());
            infeasible += 1;
            continue;
        }
        assert_eq!(solution.status, SolveStatus::Solved, "{}", path.display());
        assert!(solution.residual <= 1e-10);
        assert!(solution.iterations as usize <= 4 * n, "{} took {solution:?}", path.display());
        let bounds = vec![Bound::NonNegative; n];
        let problem =
            Problem { matrix: &matrix, symmetric: false, offset: &offset, bounds: &bounds, cone: false };
        assert_laws(&problem, &z, 1e-10);
        // The iterative ones are not made for every one of these, but say so.
        for (name, mut solver) in solvers() {
            let mut z = vec![0.0; n];
            let solution = solver.solve(&problem, &mut z);
            println!("    {name}: {solution:?}");
            if solution.status == SolveStatus::Solved {
                assert_laws(&problem, &z, 1e-9);
            }
        }
    }
    assert!(infeasible <= 1);
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
