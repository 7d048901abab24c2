//! Contact problems with a mechanical origin, for the tests and the benchmark of the solvers.

use gaitwright_physics::sim::lcp::{Bound, Problem};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The numbers of a [`Problem`].
#[derive(Debug, Clone)]
pub struct Numbers {
    pub matrix: Vec<f64>,
    pub offset: Vec<f64>,
    pub bounds: Vec<Bound>,
}

impl Numbers {
    pub fn problem(&self, cone: bool) -> Problem<'_> {
        let n = self.bounds.len();
        let symmetric = (0..n * n).all(|at| self.matrix[at] == self.matrix[at % n * n + at / n]);
        Problem {
            matrix: &self.matrix,
            symmetric,
            offset: &self.offset,
            bounds: &self.bounds,
            cone,
            enough: 0.0,
        }
    }

    /// A = J M⁻¹ Jᵀ and b = J v for given J, M and v.
    pub fn of_motion(
        jacobian: &DMatrix<f64>,
        mass: &DMatrix<f64>,
        velocity: &DVector<f64>,
        bounds: Vec<Bound>,
    ) -> Self {
        let factor = mass.clone().cholesky().expect("a mass matrix is positive definite");
        let matrix = jacobian * factor.solve(&jacobian.transpose());
        let matrix = 0.5 * (&matrix + matrix.transpose());
        let offset = jacobian * velocity;
        Self { matrix: matrix.as_slice().to_vec(), offset: offset.as_slice().to_vec(), bounds }
    }
}

/// The bounds of `contacts` contacts, each with the rows normal, tangent, tangent.
pub fn contact_bounds(contacts: usize, coefficient: f64) -> Vec<Bound> {
    (0..contacts)
        .flat_map(|contact| {
            let friction = Bound::Friction { normal: 3 * contact, coefficient };
            [Bound::NonNegative, friction, friction]
        })
        .collect()
}

/// What the feet of a quadruped are about to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// It lands straight down.
    Sticking,
    /// It lands while it moves along.
    Sliding,
    /// It tumbles: some feet leave the ground.
    Opening,
}

/// Four feet of a quadruped with three joints a leg on flat ground, at a random moment. Every leg's mass
/// is divided by `ratio`.
pub fn quadruped(rng: &mut ChaCha8Rng, motion: Motion, ratio: f64, coefficient: f64) -> Numbers {
    const SPEEDS: usize = 18;
    let mut mass = DMatrix::zeros(SPEEDS, SPEEDS);
    for (axis, inertia) in [5.0, 5.0, 5.0, 0.02, 0.05, 0.06].into_iter().enumerate() {
        mass[(axis, axis)] = inertia;
    }
    let mut jacobian = DMatrix::zeros(12, SPEEDS);
    for leg in 0..4 {
        let (x, y) = ([0.18, 0.18, -0.18, -0.18][leg], [0.13, -0.13, 0.13, -0.13][leg]);
        let joints = [
            (Vector3::x(), Vector3::new(x, 0.6 * y, 0.0)),
            (Vector3::y(), Vector3::new(x, y, 0.0)),
            (Vector3::y(), Vector3::new(x - 0.1, y, -0.14)),
        ];
        // Point masses: hip, thigh, calf, foot.
        for (part, (depth, kilograms)) in
            [(0.0, 0.7), (0.1, 1.0), (0.2, 0.17), (0.27, 0.06)].into_iter().enumerate()
        {
            let point =
                Vector3::new(x + rng.random_range(-0.02..0.02), y + rng.random_range(-0.02..0.02), -depth);
            let mut motion_of_point = DMatrix::zeros(3, SPEEDS);
            motion_of_point.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
            motion_of_point.fixed_view_mut::<3, 3>(0, 3).copy_from(&-point.cross_matrix());
            for (joint, (axis, origin)) in joints.iter().enumerate().take(part + 1) {
                let column = axis.cross(&(point - origin));
                motion_of_point.fixed_view_mut::<3, 1>(0, 6 + 3 * leg + joint).copy_from(&column);
            }
            mass += motion_of_point.transpose() * &motion_of_point * (kilograms / ratio);
            if part == 3 {
                for (row, axis) in [2, 0, 1].into_iter().enumerate() {
                    jacobian.row_mut(3 * leg + row).copy_from(&motion_of_point.row(axis));
                }
            }
        }
        for joint in 6 + 3 * leg..9 + 3 * leg {
            // Rotor inertia, and what a tracking spring adds over a step of 2 ms.
            mass[(joint, joint)] += 0.002 / ratio + 0.001;
        }
    }
    let mut velocity = DVector::from_fn(SPEEDS, |_, _| rng.random_range(-0.1..0.1));
    match motion {
        Motion::Sticking => velocity[2] -= 0.2,
        Motion::Sliding => {
            velocity[0] += 1.0;
            velocity[1] += 0.5;
            velocity[2] -= 0.2;
        }
        Motion::Opening => {
            velocity[3] += 0.5;
            velocity[4] += 0.5;
        }
    }
    Numbers::of_motion(&jacobian, &mass, &velocity, contact_bounds(4, coefficient))
}
