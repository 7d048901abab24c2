//! The scenes' solutions, checked by what they do not use: conserved quantities, periods, other formulas.

use std::f64::consts::{FRAC_PI_2, TAU};

use gaitwright_learning::accuracy::AccuracyProblem;
use gaitwright_learning::accuracy::scenes::{ClosedForm, GRAVITY, Jacobi, arithmetic_geometric_mean};
use gaitwright_physics::scene::Accuracy;
use gaitwright_physics::sim::{State, energy, momentum};

fn problem(name: &str) -> AccuracyProblem {
    ClosedForm::named(name).unwrap().problem().unwrap()
}

/// Start and marks of a scene with a single piece.
fn states(problem: &AccuracyProblem) -> Vec<State> {
    let [piece] = problem.pieces.as_slice() else { panic!("a scene has one piece") };
    std::iter::once(&piece.start).chain(&piece.marks).cloned().collect()
}

/// Total energy of every state, J, by the simulator's spatial algebra.
fn energies(problem: &AccuracyProblem) -> Vec<f64> {
    let plan = problem.setup.plan(&Accuracy::default()).unwrap();
    let total = |state: &State| {
        let energy = energy(&problem.setup.model, &plan, state);
        energy.kinetic + energy.potential
    };
    states(problem).iter().map(total).collect()
}

#[test]
fn elliptic_functions_keep_their_identities() {
    for k in [0.0, 0.3, 0.84, 0.999] {
        let quarter = FRAC_PI_2 / arithmetic_geometric_mean(1.0, (1.0_f64 - k * k).sqrt());
        for step in -20..=20 {
            let u = 0.37 * f64::from(step);
            let Jacobi { sn, cn, dn } = Jacobi::new(u, k);
            assert!((sn * sn + cn * cn - 1.0).abs() < 1e-13);
            assert!((dn * dn + k * k * sn * sn - 1.0).abs() < 1e-13);
            // sn(u + 2K) = -sn(u), and d sn / du = cn dn.
            let later = Jacobi::new(u + 2.0 * quarter, k);
            assert!((later.sn + sn).abs() < 1e-11, "period at u = {u}, k = {k}");
            let tiny = 1e-5;
            let slope = (Jacobi::new(u + tiny, k).sn - Jacobi::new(u - tiny, k).sn) / (2.0 * tiny);
            assert!((slope - cn * dn).abs() < 1e-8, "slope at u = {u}, k = {k}");
        }
        let end = Jacobi::new(quarter, k);
        assert!((end.sn - 1.0).abs() < 1e-13 && end.cn.abs() < 1e-6);
    }
    assert!((Jacobi::new(0.7, 0.0).sn - 0.7_f64.sin()).abs() < 1e-15);
}

/// The series for K(k) in powers of k², which knows nothing of means (Abramowitz & Stegun 17.3.11).
#[test]
fn mean_gives_the_complete_integral() {
    let k: f64 = 0.5;
    let (mut term, mut sum) = (1.0, 1.0);
    for n in 1..60 {
        let n = f64::from(n);
        term *= ((2.0 * n - 1.0) / (2.0 * n)).powi(2) * k * k;
        sum += term;
    }
    let mean = arithmetic_geometric_mean(1.0, (1.0 - k * k).sqrt());
    assert!((FRAC_PI_2 / mean - FRAC_PI_2 * sum).abs() < 1e-14);
}

#[test]
fn pendulums_keep_their_energy() {
    for name in ["pendulum", "double-pendulum"] {
        let energies = energies(&problem(name));
        for energy in &energies {
            assert!((energy - energies[0]).abs() < 1e-11, "{name}: {energies:?}");
        }
    }
}

#[test]
fn tumbling_keeps_energy_and_angular_momentum() {
    let problem = problem("tumbling");
    let energies = energies(&problem);
    let states = states(&problem);
    let spin = |state| momentum(&problem.setup.model, state).angular;
    for (state, energy) in states.iter().zip(&energies) {
        assert!((energy - energies[0]).abs() < 1e-12);
        assert!((spin(state) - spin(&states[0])).norm() < 1e-12);
    }
    // It does tumble: its unstable axis turns over.
    let axis = |state: &State| state.root.orientation * nalgebra::Vector3::y();
    assert!(states.iter().any(|state| axis(state).dot(&axis(&states[0])) < -0.5));
}

#[test]
fn thrown_ball_turns_height_into_speed() {
    let problem = problem("ballistic");
    let energies = energies(&problem);
    assert!(energies.iter().all(|energy| (energy - energies[0]).abs() < 1e-12 * energies[0].abs()));
    let states = states(&problem);
    let end = states.last().unwrap();
    assert!((end.root.position.x - 3.072).abs() < 1e-14, "3 m/s for 1.024 s");
}

#[test]
fn block_stops_when_friction_has_done_its_work() {
    let problem = problem("sliding-block");
    let energies = energies(&problem);
    let states = states(&problem);
    let weight = problem.setup.model.mass * GRAVITY;
    for (state, energy) in states.iter().zip(&energies) {
        let work = problem.setup.scene.friction * weight * state.root.position.x;
        assert!((energies[0] - energy - work).abs() < 1e-11 * energies[0]);
    }
    assert!(states.last().unwrap().root.linear_velocity.norm() < 1e-15);
}

#[test]
fn ball_rolls_at_five_sevenths() {
    let problem = problem("rolling-ball");
    let states = states(&problem);
    let (start, end) = (&states[0], states.last().unwrap());
    let speed = start.root.linear_velocity.x;
    assert!((end.root.linear_velocity.x - 5.0 / 7.0 * speed).abs() < 1e-14);
    assert!((end.root.angular_velocity.y * 0.1 - end.root.linear_velocity.x).abs() < 1e-14);
    // Angular momentum about any point of the ground is conserved, slipping or rolling.
    let about_ground = |state: &State| {
        let momentum = momentum(&problem.setup.model, state);
        momentum.angular.y + 0.1 * momentum.linear.x
    };
    for state in &states {
        assert!((about_ground(state) - about_ground(start)).abs() < 1e-12);
    }
    // Once it rolls it turns by its way over its radius.
    let turned =
        |state: &State| state.root.position.x / 0.1 - TAU * (state.root.position.x / (0.1 * TAU)).floor();
    let (one, other) = (&states[states.len() - 2], end);
    let angle = one.root.orientation.angle_to(&other.root.orientation);
    let way = (turned(other) - turned(one)).rem_euclid(TAU);
    assert!((angle - way.min(TAU - way)).abs() < 1e-9);
}

/// Between impacts the energy is that of the drop times e² for each impact.
#[test]
fn bounces_keep_their_share_of_the_energy() {
    let problem = problem("bouncing-ball");
    let resting = problem.setup.model.mass * GRAVITY * 0.1;
    let energies = energies(&problem);
    let shares: Vec<f64> =
        energies.iter().map(|energy| (energy - resting) / (energies[0] - resting)).collect();
    let impacts: Vec<f64> = shares.iter().map(|share| share.ln() / 0.64_f64.ln()).collect();
    assert!(impacts.iter().all(|count| (count - count.round()).abs() < 1e-9), "{impacts:?}");
    let impacts: Vec<f64> = impacts.iter().map(|count| count.round()).collect();
    assert!(impacts.is_sorted() && impacts.last().unwrap() >= &2.0, "{impacts:?}");
}
