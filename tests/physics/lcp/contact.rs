//! Contact with friction: the laws, closed forms, and the solvers against each other.

use super::contacts::{Motion, Numbers, contact_bounds, quadruped};
use super::{
    TOLERANCE, assert_laws, greatest_difference, random_contacts, repeated, rng, solved, solvers, velocity,
};
use gaitwright_physics::sim::lcp::{Bound, Lemke, Newton, Pgs, Problem, SolveStatus, Solver, residual};
use nalgebra::{DMatrix, DVector, Matrix3};
use rand::RngExt;

#[test]
fn without_friction_all_solvers_give_the_same_velocities() {
    let mut rng = rng(1);
    for case in 0..60 {
        let mut numbers = random_contacts(&mut rng, 1 + case % 6, 0.0);
        // Repeated contacts make A singular; the velocities stay unique.
        if case % 2 == 1 {
            numbers = repeated(&numbers);
        }
        let problem = numbers.problem(false);
        let exact = velocity(&problem, &solved("lemke", &mut Lemke::new(2_000), &problem));
        for (name, mut solver) in solvers() {
            let w = velocity(&problem, &solved(name, solver.as_mut(), &problem));
            assert!(greatest_difference(&w, &exact) <= 1e-8, "{name} in case {case}");
        }
    }
}

#[test]
fn pyramids_obey_the_law_and_agree_where_friction_is_small() {
    let mut rng = rng(2);
    for case in 0..100 {
        // Small friction leaves the solution unique (Pang & Trinkle 1996).
        let coefficient = if case % 2 == 0 { 0.05 } else { rng.random_range(0.1..1.0) };
        let numbers = random_contacts(&mut rng, 1 + case % 5, coefficient);
        let problem = numbers.problem(false);
        let exact = solved("lemke", &mut Lemke::new(5_000), &problem);
        assert_laws(&problem, &exact, 1e-9);
        for (name, mut solver) in solvers() {
            let mut lambda = vec![0.0; problem.rows()];
            let solution = solver.solve(&problem, &mut lambda);
            if coefficient == 0.05 {
                assert_eq!(solution.status, SolveStatus::Solved, "{name} in case {case}");
                let w = velocity(&problem, &lambda);
                assert!(greatest_difference(&w, &velocity(&problem, &exact)) <= 1e-8, "{name}, case {case}");
            } else if solution.status == SolveStatus::Solved {
                assert_laws(&problem, &lambda, 1e-8);
            }
        }
    }
}

/// Contacts that occur twice: a residual that is enough ends the search for another where Newton's steps from the forces at hand come so
/// far, and changes nothing where they solve the problem.
#[test]
fn what_is_enough_is_solved_no_further() {
    let mut rng = rng(22);
    let (mut fewer, mut same) = (0, 0);
    for case in 0..200 {
        let numbers = repeated(&random_contacts(&mut rng, 1 + case % 8, 0.7));
        let exactly = numbers.problem(true);
        let roughly = Problem { enough: 1e-2, ..exactly };
        let [(exact, exact_forces), (rough, rough_forces)] = [exactly, roughly].map(|problem| {
            let mut forces = vec![0.0; problem.rows()];
            (Newton::new(50, TOLERANCE).solve(&problem, &mut forces), forces)
        });
        assert_eq!(rough.status, SolveStatus::Solved, "case {case}");
        assert!(residual(&exactly, &rough_forces) <= 1e-2, "case {case}: {rough:?}");
        assert!(rough.iterations <= exact.iterations, "case {case}: {rough:?}, {exact:?}");
        if rough.iterations < exact.iterations {
            fewer += 1;
        } else {
            assert_eq!(rough_forces, exact_forces, "case {case}");
            same += 1;
        }
    }
    assert!(fewer > 0 && same > 0, "{fewer}, {same}");
}

#[test]
fn a_quadruped_is_solved_exactly_whatever_its_mass_ratio() {
    let mut rng = rng(3);
    for motion in [Motion::Sticking, Motion::Sliding, Motion::Opening] {
        for ratio in [1.0, 1e3, 1e6] {
            for _ in 0..20 {
                let numbers = quadruped(&mut rng, motion, ratio, 0.7);
                for cone in [true, false] {
                    let problem = numbers.problem(cone);
                    let lambda = solved("newton", &mut Newton::new(200, 1e-9), &problem);
                    assert_laws(&problem, &lambda, 1e-7);
                }
                let problem = numbers.problem(false);
                assert_laws(&problem, &solved("lemke", &mut Lemke::new(500), &problem), 1e-9);
            }
        }
    }
}

/// The equations of an active set are solved by a symmetric core and a border where A is known to be symmetric, and otherwise by
/// elimination with pivots: the same Newton steps, but for rounding.
#[test]
fn newton_steps_are_the_same_whether_or_not_symmetry_is_known() {
    const FEW: u32 = 8;
    let mut rng = rng(19);
    let mut sliding = 0;
    for case in 0..300 {
        let motion = [Motion::Sticking, Motion::Sliding, Motion::Opening][case % 3];
        let numbers = match case % 2 {
            0 => quadruped(&mut rng, motion, 10.0_f64.powi(case as i32 % 4), 0.3 + 0.1 * (case % 5) as f64),
            _ => random_contacts(&mut rng, 1 + case % 5, 0.3),
        };
        for cone in [true, false] {
            let known = numbers.problem(cone);
            assert!(known.symmetric, "case {case}");
            let unknown = Problem { symmetric: false, ..known };
            let [(one, forces), (other, others)] = [known, unknown].map(|problem| {
                let mut lambda = vec![0.0; problem.rows()];
                let solution = Newton::new(200, 1e-9).solve(&problem, &mut lambda);
                (solution, lambda)
            });
            assert_eq!((one.status, other.status), (SolveStatus::Solved, SolveStatus::Solved), "case {case}");
            // Where the first steps do not lead on, rounding decides where others begin, and which solution is found.
            if one.iterations.max(other.iterations) > FEW {
                assert_laws(&known, &forces, 1e-7);
                assert_laws(&known, &others, 1e-7);
                continue;
            }
            assert_eq!(one.iterations, other.iterations, "case {case}, cone {cone}");
            let great = forces.iter().fold(0.0_f64, |most, force| most.max(force.abs()));
            assert!(greatest_difference(&forces, &others) <= 1e-6 * great, "case {case}, cone {cone}");
            let w = velocity(&known, &forces);
            sliding += (0..w.len() / 3)
                .filter(|contact| w[3 * contact + 1].hypot(w[3 * contact + 2]) > 1e-6)
                .count();
        }
    }
    assert!(sliding > 500, "only {sliding} contacts slide or part");
}

#[test]
fn heavy_on_light_blocks_carry_their_exact_weight() {
    let fall = 9.81 * 0.002;
    for masses in [vec![1.0, 1e6], vec![1e6, 1.0], vec![1.0, 1e6, 1.0, 1e6], vec![1e-6, 1.0, 1e-6, 1.0]] {
        let n = masses.len();
        // Contact k lies between block k - 1 (or the ground) and block k.
        let jacobian = DMatrix::from_fn(n, n, |contact, block| match contact as i64 - block as i64 {
            0 => 1.0,
            1 => -1.0,
            _ => 0.0,
        });
        let mass = DMatrix::from_diagonal(&DVector::from_column_slice(&masses));
        let velocity = DVector::from_element(n, -fall);
        let numbers = Numbers::of_motion(&jacobian, &mass, &velocity, vec![Bound::NonNegative; n]);
        let problem = numbers.problem(false);
        let mut newton = Newton::new(50, TOLERANCE);
        for (name, solver) in [("newton", &mut newton as &mut dyn Solver), ("lemke", &mut Lemke::new(50))] {
            let lambda = solved(name, solver, &problem);
            for (contact, force) in lambda.iter().enumerate() {
                let weight: f64 = masses[contact..].iter().sum::<f64>() * fall;
                // The condition of A is that of the mass ratio, 4·10⁶ a pair.
                assert!((force - weight).abs() <= 1e-6 * weight, "{name}, {masses:?}: {force} for {weight}");
            }
        }
        // Sweeps hardly get anywhere where a heavy block stands on a light one, and say so.
        let status = Pgs::new(50, 1e-9).solve(&problem, &mut vec![0.0; n]).status;
        assert_eq!(status == SolveStatus::Solved, masses == [1e6, 1.0]);
    }
}

#[test]
fn more_sweeps_leave_less_residual() {
    let mut rng = rng(4);
    for motion in [Motion::Sticking, Motion::Sliding] {
        let numbers = quadruped(&mut rng, motion, 1.0, 0.7);
        let problem = numbers.problem(true);
        let after = |sweeps: u32| {
            let mut lambda = vec![0.0; problem.rows()];
            let solution = Pgs::new(sweeps, 0.0).solve(&problem, &mut lambda);
            assert_eq!(solution.residual, residual(&problem, &lambda));
            solution.residual
        };
        let residuals = [0, 1, 5, 10, 20].map(after);
        assert!(residuals.is_sorted_by(|more, fewer| more > fewer), "{residuals:?}");
        // The convergence is linear: the later ten sweeps gain at least as much as a factor of 10.
        assert!(residuals[4] <= 0.1 * residuals[3], "{residuals:?}");
    }
}

#[test]
fn a_block_on_a_slope_sticks_or_slides_as_in_the_closed_form() {
    let (kilograms, gravity, step): (f64, f64, f64) = (3.0, 9.81, 0.01);
    for coefficient in [0.0, 0.3, 0.8] {
        for degrees in [0.0_f64, 5.0, 16.0, 17.0, 30.0, 60.0] {
            for downhill in [0.0_f64, 0.7, 2.0] {
                let slope = degrees.to_radians();
                let pull = gravity * step * slope.sin();
                let normal = kilograms * gravity * step * slope.cos();
                let direction = [downhill.cos(), downhill.sin()];
                let over_mass = Matrix3::identity() / kilograms;
                let numbers = Numbers {
                    matrix: over_mass.as_slice().to_vec(),
                    offset: vec![-gravity * step * slope.cos(), pull * direction[0], pull * direction[1]],
                    bounds: contact_bounds(1, coefficient),
                };
                let problem = numbers.problem(true);
                let friction = (kilograms * pull).min(coefficient * normal);
                let expected = [normal, -friction * direction[0], -friction * direction[1]];
                for (name, mut solver) in solvers().into_iter().filter(|(name, _)| *name != "lemke") {
                    let lambda = solved(name, solver.as_mut(), &problem);
                    assert!(greatest_difference(&lambda, &expected) <= 1e-10, "{name} at {degrees}°");
                }
            }
        }
    }
}

#[test]
fn one_contact_of_a_rigid_body_slides_against_its_velocity() {
    let mut rng = rng(5);
    let (mut sticking, mut sliding, mut open) = (0, 0, 0);
    let mut steps = 0;
    for _ in 0..300 {
        let coefficient = rng.random_range(0.0..0.5);
        let numbers = random_contacts(&mut rng, 1, coefficient);
        let problem = numbers.problem(true);
        steps += Newton::new(50, TOLERANCE).solve(&problem, &mut [0.0; 3]).iterations;
        for (name, mut solver) in solvers().into_iter().filter(|(name, _)| *name != "lemke") {
            let lambda = solved(name, solver.as_mut(), &problem);
            assert_laws(&problem, &lambda, 1e-9);
            let w = velocity(&problem, &lambda);
            match (lambda[0] > 0.0, w[1].hypot(w[2]) > 1e-9) {
                (false, _) => open += 1,
                (true, false) => sticking += 1,
                (true, true) => sliding += 1,
            }
        }
    }
    // The cases are spread over all three states, or the test shows nothing.
    assert!(sticking > 10 && sliding > 10 && open > 10, "{sticking} {sliding} {open}");
    // Newton's method converges quadratically also while the direction of sliding turns.
    assert!(steps <= 300 * 4, "{steps} steps for 300 contacts");
}
