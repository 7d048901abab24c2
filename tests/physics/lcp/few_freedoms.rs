//! Many contacts that press on a few freedoms, as the links of a collapsed mechanism do: most rows depend on others.

use super::contacts::{Numbers, contact_bounds};
use super::{assert_laws, rng};
use gaitwright_physics::sim::lcp::{Bound, Equality, Newton, Problem, SolveStatus, Solver};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;

/// `contacts` with random normals on `freedoms`, some of them open; those of a planar mechanism have nothing to slide
/// across its plane. A velocity that opens all of them exists, and therefore a solution.
fn pressed(seed: u64, freedoms: usize, contacts: usize, planar: bool) -> Numbers {
    let mut rng = rng(seed);
    let jacobian = DMatrix::from_fn(3 * contacts, freedoms, |row, _| {
        let entry = rng.random_range(-1.0..1.0);
        if planar && row % 3 == 2 { 0.0 } else { entry }
    });
    let mass = DMatrix::identity(freedoms, freedoms);
    let velocity = DVector::from_fn(freedoms, |_, _| rng.random_range(-1.0..1.0));
    let mut numbers = Numbers::of_motion(&jacobian, &mass, &velocity, contact_bounds(contacts, 0.8));
    for normal in numbers.offset.iter_mut().step_by(3) {
        *normal += rng.random_range(-0.2_f64..0.2).max(0.0);
    }
    numbers
}

#[test]
fn contacts_that_press_few_freedoms_are_solved_with_the_default_budget() {
    for (planar, allowed) in [(true, 0.01), (false, 0.1)] {
        let (mut cases, mut unsolved) = (0, 0);
        for freedoms in 1..=4 {
            for contacts in [3, 5, 8] {
                for seed in 0..50 {
                    let numbers = pressed(seed, freedoms, contacts, planar);
                    let problem = numbers.problem(true);
                    let mut lambda = vec![0.0; problem.rows()];
                    let solution = Newton::new(50, 1e-9).solve(&problem, &mut lambda);
                    cases += 1;
                    match solution.status {
                        SolveStatus::Solved => assert_laws(&problem, &lambda, 1e-7),
                        _ => unsolved += 1,
                    }
                    assert!(solution.residual <= 0.1, "{solution:?}");
                }
            }
        }
        let most = allowed * f64::from(cases);
        assert!(f64::from(unsolved) <= most, "planar {planar}: {unsolved} of {cases} unsolved");
    }
}

/// Rows x, y and z of the point where a planar loop closes. The plane is turned by so little that y hardly moves,
/// and is what x and z make of it; and it comes before z.
#[test]
fn a_weak_row_does_not_stand_in_for_a_strong_one() {
    let [x, z] = [[0.3, -0.2, 0.1], [-0.1, 0.4, 0.9]];
    for turned in [1e-3, 1e-5, 1e-7] {
        let y = [0, 1, 2].map(|column| turned * (x[column] - 0.5 * z[column]));
        let jacobian = DMatrix::from_row_slice(3, 3, &[x, y, z].concat());
        let mass = DMatrix::identity(3, 3);
        let velocity = DVector::from_vec(vec![1.0, -0.5, 0.7]);
        let numbers = Numbers::of_motion(&jacobian, &mass, &velocity, vec![Bound::Free; 3]);
        let strong = jacobian.select_rows(&[0, 2]);
        let wanted = (&strong * strong.transpose()).lu().solve(&(-&strong * &velocity)).unwrap();
        let problem: Problem<'_> = numbers.problem(true);
        let mut lambda = vec![0.0; 3];
        let solution = Equality::new(Newton::new(50, 1e-11), 1e-11).solve(&problem, &mut lambda);
        assert_eq!(solution.status, SolveStatus::Solved, "turned by {turned}: {solution:?}");
        // The weak row is left out, and the force at the strong ones is what they need by themselves.
        assert_eq!(lambda[1], 0.0, "turned by {turned}");
        for (force, wanted) in [lambda[0], lambda[2]].iter().zip(wanted.iter()) {
            assert!((force - wanted).abs() <= 1e-9 * wanted.abs(), "turned by {turned}: {lambda:?}");
        }
    }
}
