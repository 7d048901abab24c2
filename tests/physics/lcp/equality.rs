//! Free rows eliminated before any solver: against dense exact solves, singular and repeated rows.

use super::contacts::{Numbers, contact_bounds};
use super::{assert_laws, greatest_difference, random_contacts, repeated, rng, velocity};
use gaitwright_physics::sim::lcp::{
    Bound, Equality, Lemke, Newton, Pgs, Problem, Solution, SolveStatus, Solver,
};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

const TOLERANCE: f64 = 1e-11;

/// Every solver behind the elimination.
fn behind() -> Vec<(&'static str, Box<dyn Solver>)> {
    vec![
        ("pgs", Box::new(Equality::new(Pgs::new(200_000, TOLERANCE), TOLERANCE))),
        ("newton", Box::new(Equality::new(Newton::new(2_000, TOLERANCE), TOLERANCE))),
        ("lemke", Box::new(Equality::new(Lemke::new(2_000), TOLERANCE))),
    ]
}

fn solve(solver: &mut dyn Solver, problem: &Problem<'_>) -> (Solution, Vec<f64>) {
    let mut lambda = vec![0.0; problem.rows()];
    let solution = solver.solve(problem, &mut lambda);
    (solution, lambda)
}

/// A chain of `links` point masses along a line, joined by distance rows, the first to a wall: A is
/// tridiagonal. `mass` gives each its mass; all move at 1 m/s and the wall's row stops them.
fn chain(links: usize, mass: impl Fn(usize) -> f64) -> Numbers {
    let jacobian = DMatrix::from_fn(links, links, |row, column| match row as isize - column as isize {
        0 => 1.0,
        1 => -1.0,
        _ => 0.0,
    });
    let velocity = DVector::from_element(links, 1.0);
    let inverse = DMatrix::from_diagonal(&DVector::from_fn(links, |link, _| 1.0 / mass(link)));
    let matrix = &jacobian * inverse * jacobian.transpose();
    Numbers {
        matrix: matrix.as_slice().to_vec(),
        offset: (&jacobian * velocity).as_slice().to_vec(),
        bounds: vec![Bound::Free; links],
    }
}

#[test]
fn a_chain_of_any_mass_ratio_is_exact() {
    for links in [1, 2, 10, 100] {
        for decades in [0.0, 6.0, -6.0] {
            let mass = |link: usize| 10_f64.powf(decades * link as f64 / links as f64);
            let numbers = chain(links, mass);
            let problem = numbers.problem(true);
            for (name, mut solver) in behind() {
                let (solution, lambda) = solve(solver.as_mut(), &problem);
                assert_eq!(solution.status, SolveStatus::Solved, "{name}: {solution:?}");
                // The impulse at each joint stops all that hangs on it.
                for (row, impulse) in lambda.iter().enumerate() {
                    let carried: f64 = (row..links).map(mass).sum();
                    assert!((impulse + carried).abs() <= 1e-9 * carried, "{name}: {impulse} for {carried}");
                }
            }
        }
    }
}

/// Contacts of a random body with `equalities` random rows that are to stand still beside them.
fn mixed(rng: &mut ChaCha8Rng, contacts: usize, equalities: usize, coefficient: f64) -> Numbers {
    let rows = 3 * contacts + equalities;
    let speeds = rows + 4;
    let g = DMatrix::from_fn(speeds, speeds, |_, _| rng.random_range(-1.0..1.0));
    let mass = &g * g.transpose() + 0.5 * DMatrix::<f64>::identity(speeds, speeds);
    let jacobian = DMatrix::from_fn(rows, speeds, |_, _| rng.random_range(-1.0..1.0));
    let velocity = DVector::from_fn(speeds, |_, _| rng.random_range(-1.0..1.0));
    let mut bounds = contact_bounds(contacts, coefficient);
    bounds.extend((0..equalities).map(|_| Bound::Free));
    Numbers::of_motion(&jacobian, &mass, &velocity, bounds)
}

#[test]
fn free_rows_alone_are_a_linear_system() {
    let mut rng = rng(41);
    for count in 1..20 {
        let numbers = mixed(&mut rng, 0, count, 0.0);
        let problem = numbers.problem(true);
        let matrix = DMatrix::from_row_slice(count, count, problem.matrix);
        let exact = matrix.lu().solve(&-DVector::from_row_slice(problem.offset)).unwrap();
        let (solution, lambda) = solve(&mut Equality::new(Pgs::new(1, TOLERANCE), TOLERANCE), &problem);
        assert_eq!(solution.status, SolveStatus::Solved);
        assert!(greatest_difference(&lambda, exact.as_slice()) <= 1e-8 * exact.amax().max(1.0));
    }
}

#[test]
fn every_solver_obeys_the_laws_behind_the_elimination() {
    let mut rng = rng(42);
    for case in 0..60 {
        let (contacts, equalities) = (1 + case % 4, 1 + case % 7);
        for coefficient in [0.0, 0.5] {
            let numbers = mixed(&mut rng, contacts, equalities, coefficient);
            for (name, mut solver) in behind() {
                let problem = numbers.problem(name != "lemke");
                let (solution, lambda) = solve(solver.as_mut(), &problem);
                assert_eq!(solution.status, SolveStatus::Solved, "{name}, case {case}: {solution:?}");
                assert_laws(&problem, &lambda, 1e-8);
                // The same motion as without the elimination, where the free rows are iterated on.
                if coefficient == 0.0 {
                    let (_, plain) = solve(&mut Newton::new(2_000, TOLERANCE), &problem);
                    let (ours, theirs) = (velocity(&problem, &lambda), velocity(&problem, &plain));
                    assert!(greatest_difference(&ours, &theirs) <= 1e-8, "{name}, case {case}");
                }
            }
        }
    }
}

#[test]
fn repeated_rows_change_no_motion() {
    let mut rng = rng(43);
    for case in 0..30 {
        let numbers = mixed(&mut rng, 1 + case % 2, 1 + case % 5, 0.0);
        let twice = repeated(&numbers);
        for (name, mut solver) in behind() {
            let once = {
                let problem = numbers.problem(false);
                velocity(&problem, &solve(solver.as_mut(), &problem).1)
            };
            let problem = twice.problem(false);
            let (solution, lambda) = solve(solver.as_mut(), &problem);
            assert_eq!(solution.status, SolveStatus::Solved, "{name}, case {case}: {solution:?}");
            let w = velocity(&problem, &lambda);
            assert!(greatest_difference(&w[..once.len()], &once) <= 1e-8, "{name}, case {case}");
        }
    }
}

#[test]
fn a_contradiction_is_singular_and_leaves_finite_forces() {
    // The same row is to stand still and to move at 1 m/s; beside it a contact that can be solved.
    let numbers = Numbers {
        matrix: vec![2.0, 2.0, 0.5, 2.0, 2.0, 0.5, 0.5, 0.5, 1.0],
        offset: vec![0.0, -1.0, -1.0],
        bounds: vec![Bound::Free, Bound::Free, Bound::NonNegative],
    };
    let problem = numbers.problem(true);
    for (name, mut solver) in behind() {
        let (solution, lambda) = solve(solver.as_mut(), &problem);
        assert_eq!(solution.status, SolveStatus::Singular, "{name}: {solution:?}");
        assert!(solution.residual >= 0.4, "{name}: {solution:?}");
        assert!(lambda.iter().all(|force| force.abs() <= 10.0), "{name}: {lambda:?}");
        let w = velocity(&problem, &lambda);
        assert!(w[0].abs() <= 1e-9 && w[2] >= -1e-9, "{name}: {w:?}");
    }
}

#[test]
fn a_row_that_the_equalities_hold_is_not_pushed() {
    let mut rng = rng(44);
    let numbers = mixed(&mut rng, 0, 4, 0.0);
    // A fifth row that is the sum of two that stand still: nothing can open or close it.
    let combine = |row: usize| if row < 4 { vec![(row, 1.0)] } else { vec![(0, 1.0), (1, 1.0)] };
    let entry = |row: usize, column: usize| -> f64 {
        let pairs =
            combine(row).into_iter().flat_map(|left| combine(column).into_iter().map(move |it| (left, it)));
        pairs.map(|((i, a), (j, b))| a * b * numbers.matrix[i * 4 + j]).sum()
    };
    let sum = Numbers {
        matrix: (0..25).map(|k| entry(k / 5, k % 5)).collect(),
        offset: (0..5)
            .map(|row| combine(row).into_iter().map(|(i, a)| a * numbers.offset[i]).sum())
            .collect(),
        bounds: [vec![Bound::Free; 4], vec![Bound::NonNegative]].concat(),
    };
    let problem = sum.problem(true);
    for (name, mut solver) in behind() {
        let (solution, lambda) = solve(solver.as_mut(), &problem);
        assert_eq!(solution.status, SolveStatus::Solved, "{name}: {solution:?}");
        assert!(lambda[4].abs() <= 1e-6, "{name}: {lambda:?}");
    }
}

#[test]
fn a_free_row_may_press_a_contact_together() {
    let mut rng = rng(45);
    let mut numbers = random_contacts(&mut rng, 1, 0.5);
    numbers.bounds[0] = Bound::Free;
    numbers.offset[0] = -numbers.offset[0].abs() - 1.0;
    let problem = numbers.problem(true);
    let (solution, lambda) = solve(&mut Equality::new(Newton::new(200, TOLERANCE), TOLERANCE), &problem);
    assert_eq!(solution.status, SolveStatus::Solved);
    assert_laws(&problem, &lambda, 1e-8);
}

#[test]
fn numbers_that_are_none_are_found() {
    for bad in [f64::NAN, f64::INFINITY] {
        for place in 0..4 {
            let mut numbers = Numbers {
                matrix: vec![2.0, 1.0, 1.0, 2.0],
                offset: vec![1.0, -1.0],
                bounds: vec![Bound::Free, Bound::NonNegative],
            };
            numbers.matrix[place] = bad;
            for (name, mut solver) in behind() {
                let status = solve(solver.as_mut(), &numbers.problem(true)).0.status;
                assert_eq!(status, SolveStatus::NotFinite, "{name}, place {place}");
            }
        }
    }
}
