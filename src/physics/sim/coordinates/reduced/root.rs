//! The root's six equations, solved by a Cholesky factor.
//!
//! A free root may accelerate in six directions. A root whose rotation is locked keeps three: the
//! three equality rows of the lock (Tokizaki & Hasegawa section 3.4) are eliminated here, exactly and
//! at no cost, instead of being iterated on. A fixed root keeps none.

use crate::sim::root_freedom::RootFreedom;
use crate::sim::spatial::{ArticulatedInertia, SpatialForce, SpatialMotion};

/// Cholesky factor of the inertia the root shows, translations first, over the directions in which
/// it may accelerate.
#[derive(Debug, Clone, Copy)]
pub struct RootFactor {
    /// The factor below its diagonal.
    lower: [[f64; 6]; 6],
    /// One over the factor's diagonal; 0 in directions that are not free.
    inverse: [f64; 6],
}

impl RootFactor {
    /// The factor of nothing.
    pub const EMPTY: Self = Self { lower: [[0.0; 6]; 6], inverse: [0.0; 6] };

    /// Factorises `inertia`; `None` if it is not positive definite.
    #[inline(always)] // part of the kernels
    pub fn new(freedom: RootFreedom, inertia: &ArticulatedInertia) -> Option<Self> {
        let size = match freedom {
            RootFreedom::Fixed => 0,
            RootFreedom::Translating => 3,
            RootFreedom::Free => 6,
        };
        let mut lower = inertia.entries();
        for (row, entries) in lower.iter_mut().enumerate() {
            entries[row + 1..].fill(0.0);
        }
        // First L D of L D Lᵀ, so that no column waits for the root of the one before.
        let mut inverse = [0.0; 6];
        for column in 0..size {
            let pivot = lower[column][column];
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            inverse[column] = 1.0 / pivot;
            for other in column + 1..size {
                let share = lower[other][column] * inverse[column];
                for row in other..size {
                    lower[row][other] -= lower[row][column] * share;
                }
            }
        }
        let inverse = inverse.map(f64::sqrt);
        for row in &mut lower {
            for (entry, inverse) in row.iter_mut().zip(inverse) {
                *entry *= inverse;
            }
        }
        Some(Self { lower, inverse })
    }

    /// `L⁻¹ force` over the root's free directions, 0 in the others: of several forces side by side, each given by its
    /// components, moment first.
    #[inline(always)] // part of the kernels
    pub fn half_solve<const LANES: usize>(&self, forces: [[f64; LANES]; 6]) -> [[f64; LANES]; 6] {
        let [mx, my, mz, fx, fy, fz] = forces;
        let mut z = [fx, fy, fz, mx, my, mz];
        // A direction that is not free has an inverse of 0, and so adds nothing to those below it.
        for row in 0..6 {
            let (known, rest) = z.split_at_mut(row);
            let entry = &mut rest[0];
            for (column, known) in known.iter().enumerate() {
                *entry = std::array::from_fn(|lane| entry[lane] - self.lower[row][column] * known[lane]);
            }
            *entry = entry.map(|entry| entry * self.inverse[row]);
        }
        z
    }

    /// `L⁻ᵀ z`: the acceleration that belongs to the half-solved force `z`.
    #[inline(always)] // part of the kernels
    pub fn finish(&self, mut z: [f64; 6]) -> SpatialMotion {
        for row in (0..6).rev() {
            let mut entry = z[row];
            for below in row + 1..6 {
                entry -= self.lower[below][row] * z[below];
            }
            z[row] = entry * self.inverse[row];
        }
        SpatialMotion { linear: [z[0], z[1], z[2]].into(), angular: [z[3], z[4], z[5]].into() }
    }

    /// Acceleration under `force`, where directions that are not free accelerate as `prescribed`.
    #[inline(always)] // part of the kernels
    pub fn accelerate(
        &self,
        inertia: &ArticulatedInertia,
        force: SpatialForce,
        prescribed: SpatialMotion,
    ) -> SpatialMotion {
        let rest = force.plus(inertia.times(prescribed).scaled(-1.0));
        let half = self.half_solve(rest.components().map(|each| [each]));
        prescribed.plus(self.finish(half.map(|[each]| each)))
    }
}
