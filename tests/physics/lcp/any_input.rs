//! Empty, malformed, non-finite and hopeless problems, and solvers used again.

use super::contacts::{Motion, Numbers, contact_bounds, quadruped};
use super::{any_interval, random_contacts, rng, solved, solvers};
use gaitwright_physics::sim::lcp::{
    Bound, Lemke, Newton, Pgs, Problem, Solution, SolveStatus, Solver, project, residual,
};
use nalgebra::{DMatrix, Matrix3};
use proptest::prelude::*;

#[test]
fn an_empty_problem_is_solved() {
    for (name, mut solver) in solvers() {
        let problem =
            Problem { matrix: &[], symmetric: true, offset: &[], bounds: &[], cone: true, enough: 0.0 };
        let solution = solver.solve(&problem, &mut []);
        assert_eq!(
            solution,
            Solution { status: SolveStatus::Solved, iterations: 0, residual: 0.0 },
            "{name}"
        );
    }
}

#[test]
fn numbers_that_are_none_are_named() {
    let mut rng = rng(7);
    let numbers = quadruped(&mut rng, Motion::Sliding, 1.0, 0.7);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for (name, mut solver) in solvers() {
            let mut status = |numbers: &Numbers| {
                solver.solve(&numbers.problem(false), &mut vec![0.0; numbers.bounds.len()]).status
            };
            for place in [0, 17, 143] {
                let mut numbers = numbers.clone();
                numbers.matrix[place] = bad;
                assert_eq!(status(&numbers), SolveStatus::NotFinite, "{name}");
            }
            let mut offset = numbers.clone();
            offset.offset[11] = bad;
            assert_eq!(status(&offset), SolveStatus::NotFinite, "{name}");
            let mut coefficient = numbers.clone();
            coefficient.bounds = contact_bounds(4, bad);
            assert_eq!(status(&coefficient), SolveStatus::NotFinite, "{name}");
        }
    }
    assert!(residual(&numbers.problem(true), &[f64::NAN; 12]).is_nan());
    let mut lambda = [f64::NAN; 12];
    assert_eq!(Pgs::new(9, 0.0).solve(&numbers.problem(true), &mut lambda).status, SolveStatus::NotFinite);
    assert_eq!(Newton::new(9, 0.0).solve(&numbers.problem(true), &mut lambda).status, SolveStatus::NotFinite);
}

#[test]
fn problems_that_are_none_are_refused() {
    let friction = Bound::Friction { normal: 0, coefficient: 0.5 };
    for bounds in [
        vec![Bound::NonNegative; 2],
        vec![Bound::NonNegative, Bound::Free, Bound::Box { lower: 1.0, upper: 0.0 }],
        vec![Bound::NonNegative, Bound::Free, friction],
        vec![Bound::NonNegative, friction, Bound::Friction { normal: 0, coefficient: 0.6 }],
        vec![Bound::NonNegative, Bound::Friction { normal: 3, coefficient: 0.5 }, friction],
        contact_bounds(1, -0.1),
    ] {
        let identity = Matrix3::<f64>::identity();
        let problem = Problem {
            matrix: identity.as_slice(),
            symmetric: true,
            offset: &[-1.0; 3],
            bounds: &bounds,
            cone: false,
            enough: 0.0,
        };
        assert!(residual(&problem, &[0.0; 3]).is_nan());
        for (name, mut solver) in solvers() {
            assert_eq!(
                solver.solve(&problem, &mut [0.0; 3]).status,
                SolveStatus::Malformed,
                "{name}: {bounds:?}"
            );
        }
    }
    let numbers = quadruped(&mut rng(8), Motion::Sliding, 1.0, 0.7);
    assert_eq!(Lemke::new(9).solve(&numbers.problem(true), &mut [0.0; 12]).status, SolveStatus::Unsupported);
}

#[test]
fn a_solution_is_a_start_that_needs_no_work() {
    let mut rng = rng(9);
    for motion in [Motion::Sticking, Motion::Sliding, Motion::Opening] {
        let numbers = quadruped(&mut rng, motion, 1.0, 0.7);
        let problem = numbers.problem(true);
        let lambda = solved("newton", &mut Newton::new(200, 1e-9), &problem);
        for mut solver in [Box::new(Pgs::new(50, 1e-9)) as Box<dyn Solver>, Box::new(Newton::new(50, 1e-9))] {
            let mut again = lambda.clone();
            assert_eq!(solver.solve(&problem, &mut again).iterations, 0);
            assert_eq!(again, lambda);
        }
    }
}

#[test]
fn earlier_solves_leave_no_trace() {
    let mut rng = rng(10);
    let first = quadruped(&mut rng, Motion::Sliding, 1e3, 0.7);
    let second = random_contacts(&mut rng, 2, 0.4);
    for (name, mut solver) in solvers() {
        let fresh = solved(
            name,
            solvers().into_iter().find(|(n, _)| *n == name).unwrap().1.as_mut(),
            &second.problem(false),
        );
        solver.solve(&first.problem(false), &mut [0.0; 12]);
        assert_eq!(solved(name, solver.as_mut(), &second.problem(false)), fresh, "{name}");
    }
}

fn any_bounds(rows: usize) -> impl Strategy<Value = Vec<Bound>> {
    prop::collection::vec((any_interval(), any::<bool>(), 0.0..2.0_f64), rows).prop_map(|picks| {
        let n = picks.len();
        let mut bounds = Vec::with_capacity(n);
        // Row 0 is always a normal row for the friction rows to lean on.
        while bounds.len() < n {
            let (interval, friction, coefficient) = picks[bounds.len()];
            if friction && !bounds.is_empty() && bounds.len() + 1 < n {
                bounds.extend([Bound::Friction { normal: 0, coefficient }; 2]);
            } else {
                bounds.push(interval);
            }
        }
        bounds
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..Default::default() })]

    /// Indefinite, singular and badly scaled matrices: most have no solution, none may do harm.
    #[test]
    fn forces_stay_finite_and_within_their_bounds(
        (entries, offset, bounds, start) in (1_usize..9).prop_flat_map(|n| (
            prop::collection::vec(prop_oneof![3 => -1.0..1.0_f64, 1 => Just(0.0), 1 => -1e6..1e6_f64], n * n),
            prop::collection::vec(-10.0..10.0_f64, n),
            any_bounds(n),
            prop::collection::vec(-10.0..10.0_f64, n),
        )),
        semidefinite: bool,
        cone: bool,
    ) {
        let n = offset.len();
        let g = DMatrix::from_vec(n, n, entries);
        let matrix = if semidefinite { &g * g.transpose() } else { g };
        let numbers = Numbers { matrix: matrix.as_slice().to_vec(), offset, bounds };
        let problem = numbers.problem(cone);
        for mut solver in [
            Box::new(Pgs::new(30, 1e-9)) as Box<dyn Solver>,
            Box::new(Newton::new(30, 1e-9)),
            Box::new(Lemke::new(100)),
        ] {
            let mut lambda = start.clone();
            let solution = solver.solve(&problem, &mut lambda);
            if matches!(solution.status, SolveStatus::NotFinite | SolveStatus::Unsupported) {
                prop_assert!(solution.residual.is_nan() || solution.residual == f64::INFINITY);
                continue;
            }
            prop_assert!(solution.residual.is_finite(), "{:?} {:?}", solution, lambda);
            prop_assert_eq!(solution.residual, residual(&problem, &lambda));
            let mut projected = lambda.clone();
            project(&problem, &mut projected);
            prop_assert_eq!(&projected, &lambda);
            for (row, bound) in problem.bounds.iter().enumerate() {
                prop_assert!(lambda[row].is_finite());
                match *bound {
                    Bound::Free => {}
                    Bound::NonNegative => prop_assert!(lambda[row] >= 0.0),
                    Bound::Box { lower, upper } => prop_assert!((lower..=upper).contains(&lambda[row])),
                    Bound::Friction { normal, coefficient } => {
                        prop_assert!(lambda[row].abs() <= coefficient * lambda[normal].max(0.0));
                    }
                }
            }
        }
    }
}
