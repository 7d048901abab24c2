//! Rows that repeat each other, contradict each other, or cannot move.

use super::contacts::{Numbers, contact_bounds};
use super::{assert_laws, random_contacts, repeated, rng, solved, solvers, velocity};
use gaitwright_physics::sim::lcp::{Bound, Lemke, Newton, Pgs, SolveStatus, Solver};
use nalgebra::{DMatrix, DVector, Vector3};

/// A box of 2 kg, 0.4 m × 0.6 m × 0.2 m, about to fall onto `points` points of its lower face.
fn resting_box(points: &[(f64, f64)], coefficient: f64) -> (Numbers, DMatrix<f64>, DMatrix<f64>) {
    let (x, y, z): (f64, f64, f64) = (0.4, 0.6, 0.2);
    let inertia = Vector3::new(y * y + z * z, x * x + z * z, x * x + y * y) * (2.0 / 12.0);
    let mass =
        DMatrix::from_diagonal(&DVector::from_row_slice(&[2.0, 2.0, 2.0, inertia.x, inertia.y, inertia.z]));
    let mut jacobian = DMatrix::zeros(3 * points.len(), 6);
    for (contact, (px, py)) in points.iter().enumerate() {
        let arm = Vector3::new(*px, *py, -z / 2.0);
        for (row, axis) in [Vector3::z(), Vector3::x(), Vector3::y()].into_iter().enumerate() {
            let turn = arm.cross(&axis);
            for k in 0..3 {
                jacobian[(3 * contact + row, k)] = axis[k];
                jacobian[(3 * contact + row, k + 3)] = turn[k];
            }
        }
    }
    let fall = DVector::from_row_slice(&[0.0, 0.0, -9.81 * 0.01, 0.0, 0.0, 0.0]);
    let numbers = Numbers::of_motion(&jacobian, &mass, &fall, contact_bounds(points.len(), coefficient));
    (numbers, jacobian, mass)
}

#[test]
fn a_box_rests_on_more_points_than_it_needs() {
    let corners = [(0.2, 0.3), (0.2, -0.3), (-0.2, 0.3), (-0.2, -0.3)];
    let hundred: Vec<_> = (0..100)
        .map(|k| (0.2 - 0.4 * f64::from(k % 10) / 9.0, 0.3 - 0.6 * f64::from(k / 10) / 9.0))
        .collect();
    for points in [&corners[..], &hundred[..]] {
        for coefficient in [0.0, 0.5, 10.0] {
            let (numbers, ..) = resting_box(points, coefficient);
            for numbers in [numbers.clone(), repeated(&numbers)] {
                if numbers.bounds.len() > 300 {
                    continue;
                }
                for (name, mut solver) in solvers() {
                    // A hundred points with friction are beyond what pivoting is for.
                    let problem = numbers.problem(name != "lemke");
                    if name == "lemke" && problem.rows() > 30 {
                        continue;
                    }
                    let lambda = solved(name, solver.as_mut(), &problem);
                    let w = velocity(&problem, &lambda);
                    assert!(w.iter().all(|speed| speed.abs() <= 1e-9), "{name}: {w:?}");
                    let weight: f64 = lambda.iter().step_by(3).sum();
                    assert!((weight - 2.0 * 9.81 * 0.01).abs() <= 1e-8, "{name} carries {weight}");
                }
            }
        }
    }
}

#[test]
fn equalities_that_repeat_each_other_are_solved() {
    let mut rng = rng(6);
    for _ in 0..40 {
        let mut numbers = random_contacts(&mut rng, 2, 0.0);
        numbers.bounds = vec![Bound::Free; 6];
        let problem = numbers.problem(false);
        let once = velocity(&problem, &solved("lemke", &mut Lemke::new(100), &problem));
        assert!(once.iter().all(|speed| speed.abs() <= 1e-12));
        let numbers = repeated(&numbers);
        for (name, mut solver) in solvers() {
            let problem = numbers.problem(false);
            let w = velocity(&problem, &solved(name, solver.as_mut(), &problem));
            assert!(w.iter().all(|speed| speed.abs() <= 1e-9), "{name}: {w:?}");
        }
    }
}

#[test]
fn contradictions_have_a_clear_status_and_finite_forces() {
    // The same row is to stand still and to move at 1 m/s; beside it a contact that can be solved.
    let locks = Numbers {
        matrix: vec![2.0, 2.0, 0.5, 2.0, 2.0, 0.5, 0.5, 0.5, 1.0],
        offset: vec![0.0, -1.0, -1.0],
        bounds: vec![Bound::Free, Bound::Free, Bound::NonNegative],
    };
    // A body between two walls that approach each other.
    let walls = Numbers {
        matrix: vec![1.0, -1.0, -1.0, 1.0],
        offset: vec![-1.0, 0.0],
        bounds: vec![Bound::NonNegative; 2],
    };
    for (numbers, pivoting) in [(locks, SolveStatus::Singular), (walls, SolveStatus::Ray)] {
        let problem = numbers.problem(true);
        let n = problem.rows();
        let mut expected =
            [("pgs", SolveStatus::IterationLimit), ("newton", SolveStatus::Singular), ("lemke", pivoting)];
        for ((name, mut solver), (_, status)) in [
            ("pgs", Box::new(Pgs::new(50, 1e-9)) as Box<dyn Solver>),
            ("newton", Box::new(Newton::new(50, 1e-9))),
            ("lemke", Box::new(Lemke::new(50))),
        ]
        .into_iter()
        .zip(expected.iter_mut())
        {
            let mut lambda = vec![0.0; n];
            let solution = solver.solve(&problem, &mut lambda);
            assert_eq!(solution.status, *status, "{name}: {solution:?}");
            assert!(solution.residual >= 0.4, "{name}: {solution:?}");
            assert!(lambda.iter().all(|force| force.abs() <= 100.0), "{name}: {lambda:?}");
        }
    }
}

#[test]
fn a_row_that_cannot_move_is_singular_only_when_it_should() {
    let numbers = |b: f64, bound: Bound| Numbers {
        matrix: vec![0.0, 0.0, 0.0, 1.0],
        offset: vec![b, -1.0],
        bounds: vec![bound, Bound::NonNegative],
    };
    let boxed = Bound::Box { lower: -2.0, upper: 3.0 };
    for (b, bound, solvable) in [
        (0.0, Bound::Free, true),
        (1.0, Bound::Free, false),
        (1.0, Bound::NonNegative, true),
        (-1.0, Bound::NonNegative, false),
        (1.0, boxed, true),
        (-1.0, boxed, true),
    ] {
        let numbers = numbers(b, bound);
        let problem = numbers.problem(false);
        for (name, mut solver) in solvers() {
            let mut lambda = vec![0.0; 2];
            let status = solver.solve(&problem, &mut lambda).status;
            if solvable {
                assert_eq!(status, SolveStatus::Solved, "{name} with {b} and {bound:?}");
                assert_laws(&problem, &lambda, 1e-10);
            } else {
                assert!(matches!(status, SolveStatus::Singular | SolveStatus::Ray), "{name}: {status:?}");
            }
            // A ray leaves nothing; the others solve what can be solved.
            if status != SolveStatus::Ray {
                assert!((lambda[1] - 1.0).abs() <= 1e-8, "{name}: {lambda:?}");
            }
        }
    }
}
