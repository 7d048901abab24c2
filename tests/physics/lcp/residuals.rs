//! The residual against its definition and its unit.

use super::contacts::{Numbers, contact_bounds};
use super::{random_contacts, rng};
use gaitwright_physics::sim::lcp::{Bound, Problem, residual};
use nalgebra::Matrix3;
use proptest::prelude::*;
use rand::RngExt;

#[test]
fn the_residual_is_the_velocity_error_row_by_row() {
    let one = |bound: Bound, b: f64, force: f64| {
        residual(
            &Problem {
                matrix: &[2.0],
                symmetric: true,
                offset: &[b],
                bounds: &[bound],
                cone: false,
                enough: 0.0,
            },
            &[force],
        )
    };
    // w = 2 λ + b.
    assert_eq!(one(Bound::Free, -3.0, 1.0), 1.0);
    assert_eq!(one(Bound::NonNegative, -3.0, 1.0), 1.0);
    assert_eq!(one(Bound::NonNegative, 3.0, 0.0), 0.0);
    assert_eq!(one(Bound::NonNegative, 3.0, 1.0), 2.0);
    assert_eq!(one(Bound::NonNegative, 1.0, -1.0), 2.0);
    let boxed = Bound::Box { lower: -1.0, upper: 1.0 };
    assert_eq!(one(boxed, -5.0, 1.0), 0.0);
    assert_eq!(one(boxed, -5.0, 0.5), 1.0);
    assert_eq!(one(boxed, 5.0, -1.0), 0.0);
    // A unit contact with normal force 1 and friction 1/2 that slides along (3, 4)/5 at 1 m/s.
    let identity = Matrix3::<f64>::identity();
    let bounds = contact_bounds(1, 0.5);
    let at = |force: [f64; 3], cone: bool| {
        let offset = [-1.0, 0.6 - force[1], 0.8 - force[2]];
        residual(
            &Problem {
                matrix: identity.as_slice(),
                symmetric: true,
                offset: &offset,
                bounds: &bounds,
                cone,
                enough: 0.0,
            },
            &force,
        )
    };
    assert!(at([1.0, -0.3, -0.4], true) <= 1e-15);
    assert!(
        (at([1.0, -0.5, 0.0], true)
            - (0.5_f64 - 1.1 * 0.5 / 1.1_f64.hypot(0.8)).hypot(0.4 / 1.1_f64.hypot(0.8)))
        .abs()
            <= 1e-15
    );
    assert!((at([1.0, -0.3, -0.4], false) - 0.2).abs() <= 1e-15);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..Default::default() })]

    #[test]
    fn the_residual_is_a_velocity(seed in 0_u64..1_000, newtons in 1e-3..1e3_f64, speed in 1e-3..1e3_f64, cone: bool) {
        let mut rng = rng(seed);
        let numbers = random_contacts(&mut rng, 3, 0.6);
        let lambda: Vec<f64> = (0..9).map(|_| rng.random_range(-1.0..1.0)).collect();
        let before = residual(&numbers.problem(cone), &lambda);
        // Another unit of force changes nothing, another unit of velocity changes it alike.
        let scaled = Numbers {
            matrix: numbers.matrix.iter().map(|entry| entry * speed * newtons).collect(),
            offset: numbers.offset.iter().map(|entry| entry * speed).collect(),
            bounds: numbers.bounds.clone(),
        };
        let forces: Vec<f64> = lambda.iter().map(|force| force / newtons).collect();
        let after = residual(&scaled.problem(cone), &forces);
        prop_assert!((after - speed * before).abs() <= 1e-9 * speed * before);
    }
}
