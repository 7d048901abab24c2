//! The solvers of the mixed complementarity problem: against textbook problems, against enumeration,
//! against each other, against closed forms and against the laws themselves.

use crate::contacts;

mod any_input;
mod contact;
mod contradictions;
mod convex;
mod equality;
mod few_freedoms;
mod redundancy;
mod residuals;
mod textbook;

use contacts::{Numbers, contact_bounds};
use gaitwright_physics::sim::lcp::{Bound, Lemke, Newton, Pgs, Problem, SolveStatus, Solver};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const TOLERANCE: f64 = 1e-11;

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

/// Every solver, with a budget that leaves the iterative ones no excuse.
fn solvers() -> Vec<(&'static str, Box<dyn Solver>)> {
    vec![
        ("pgs", Box::new(Pgs::new(200_000, TOLERANCE))),
        ("newton", Box::new(Newton::new(2_000, TOLERANCE))),
        ("lemke", Box::new(Lemke::new(2_000))),
    ]
}

fn solved(name: &str, solver: &mut dyn Solver, problem: &Problem<'_>) -> Vec<f64> {
    let mut lambda = vec![0.0; problem.rows()];
    let solution = solver.solve(problem, &mut lambda);
    assert_eq!(solution.status, SolveStatus::Solved, "{name}: {solution:?} for {problem:?}");
    lambda
}

fn velocity(problem: &Problem<'_>, lambda: &[f64]) -> Vec<f64> {
    let n = problem.rows();
    (0..n)
        .map(|row| (0..n).map(|k| problem.matrix[row * n + k] * lambda[k]).sum::<f64>() + problem.offset[row])
        .collect()
}

fn greatest_difference(left: &[f64], right: &[f64]) -> f64 {
    left.iter().zip(right).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The laws of contact, row by row and in their own words; `near` is an error in force and in velocity.
fn assert_laws(problem: &Problem<'_>, lambda: &[f64], near: f64) {
    let w = velocity(problem, lambda);
    let mut row = 0;
    while row < problem.rows() {
        let (force, speed) = (lambda[row], w[row]);
        match problem.bounds[row] {
            Bound::Free => assert!(speed.abs() <= near, "row {row} moves: {speed}"),
            Bound::NonNegative => {
                assert!(force >= 0.0 && speed >= -near, "row {row}: force {force}, velocity {speed}");
                assert!(force <= near || speed <= near, "row {row} pushes while it opens: {force}, {speed}");
            }
            Bound::Box { lower, upper } => {
                assert!((lower..=upper).contains(&force), "row {row}: {force} outside its box");
                assert!(speed >= -near || force >= upper - near, "row {row} gives way below its upper end");
                assert!(speed <= near || force <= lower + near, "row {row} gives way above its lower end");
            }
            Bound::Friction { normal, coefficient } => {
                let rim = coefficient * lambda[normal].max(0.0);
                let (force, speed) = ([force, lambda[row + 1]], [speed, w[row + 1]]);
                if problem.cone {
                    let slip = speed[0].hypot(speed[1]);
                    assert!(force[0].hypot(force[1]) <= rim * (1.0 + 1e-12), "row {row}: beyond the cone");
                    if slip > near {
                        let opposed = [-rim * speed[0] / slip, -rim * speed[1] / slip];
                        let amiss = (force[0] - opposed[0]).hypot(force[1] - opposed[1]);
                        assert!(amiss <= near * (1.0 + rim / slip), "row {row}: {force:?} against {speed:?}");
                    }
                } else {
                    for (force, speed) in force.into_iter().zip(speed) {
                        assert!(force.abs() <= rim, "row {row}: beyond the pyramid");
                        let opposed = -rim * speed.signum();
                        assert!(speed.abs() <= near || (force - opposed).abs() <= near, "row {row}: {force}");
                    }
                }
                row += 1;
            }
        }
        row += 1;
    }
}

/// A body of several random contacts: a random mass matrix and random contact frames about a point.
fn random_contacts(rng: &mut ChaCha8Rng, contacts: usize, coefficient: f64) -> Numbers {
    let speeds = 6 + 3 * contacts;
    let g = DMatrix::from_fn(speeds, speeds, |_, _| rng.random_range(-1.0..1.0));
    let mass = &g * g.transpose() + 0.5 * DMatrix::<f64>::identity(speeds, speeds);
    let jacobian = DMatrix::from_fn(3 * contacts, speeds, |_, _| rng.random_range(-1.0..1.0));
    let velocity = DVector::from_fn(speeds, |_, _| rng.random_range(-1.0..1.0));
    Numbers::of_motion(&jacobian, &mass, &velocity, contact_bounds(contacts, coefficient))
}

/// The problem with every contact twice: A singular, the motion the same.
fn repeated(numbers: &Numbers) -> Numbers {
    let n = numbers.bounds.len();
    let matrix = (0..4 * n * n).map(|k| numbers.matrix[(k / (2 * n) % n) * n + k % (2 * n) % n]).collect();
    let shifted = numbers.bounds.iter().map(|bound| match *bound {
        Bound::Friction { normal, coefficient } => Bound::Friction { normal: normal + n, coefficient },
        other => other,
    });
    Numbers {
        matrix,
        offset: numbers.offset.repeat(2),
        bounds: numbers.bounds.iter().copied().chain(shifted).collect(),
    }
}

fn any_interval() -> impl Strategy<Value = Bound> {
    prop_oneof![
        Just(Bound::Free),
        Just(Bound::NonNegative),
        (-2.0..0.5, 0.0..3.0).prop_map(|(lower, size)| Bound::Box { lower, upper: lower + size }),
        (-2.0..0.5).prop_map(|lower| Bound::Box { lower, upper: f64::INFINITY }),
        (-0.5..2.0).prop_map(|upper| Bound::Box { lower: f64::NEG_INFINITY, upper }),
    ]
}
