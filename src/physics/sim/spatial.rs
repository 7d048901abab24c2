//! Six-dimensional rigid-body algebra (Featherstone 2008), in one frame.
//!
//! Every quantity of a step is written along the world axes about one common point, the origin of
//! the root link at the beginning of the step. Velocities, forces and inertias of different bodies
//! may therefore be added as they are, with no transform between them, and numbers stay small
//! however far the character has travelled.

use nalgebra::{Matrix3, Vector3};

use crate::model::wide::{Numbers, Wide};

/// A velocity or acceleration: of rotation (rad/s), and of the body-fixed point at the common
/// point (m/s).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpatialMotion {
    /// rad/s or rad/s².
    pub angular: Vector3<f64>,
    /// m/s or m/s².
    pub linear: Vector3<f64>,
}

/// A force or momentum: moment about the common point (N m), and force (N).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpatialForce {
    /// N m or kg m²/s.
    pub moment: Vector3<f64>,
    /// N or kg m/s.
    pub force: Vector3<f64>,
}

/// Motions side by side.
pub type WideMotion = Wide<SpatialMotion, 6>;

/// Forces side by side.
pub type WideForce = Wide<SpatialForce, 6>;

/// Inertias side by side.
pub type WideInertia = Wide<RigidInertia, 10>;

/// Articulated-body inertias side by side.
pub type WideArticulated = Wide<ArticulatedInertia, 21>;

impl SpatialMotion {
    /// At rest.
    pub const ZERO: Self = Self { angular: Vector3::new(0.0, 0.0, 0.0), linear: Vector3::new(0.0, 0.0, 0.0) };

    /// Sum of two motions.
    #[inline(always)] // part of the kernels
    pub fn plus(self, other: Self) -> Self {
        Self { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }

    /// Difference of two motions.
    #[inline(always)] // part of the kernels
    pub fn minus(self, other: Self) -> Self {
        Self { angular: self.angular - other.angular, linear: self.linear - other.linear }
    }

    /// `self + scale * other`.
    #[inline(always)] // part of the kernels
    pub fn plus_scaled(self, other: Self, scale: f64) -> Self {
        Self { angular: self.angular + other.angular * scale, linear: self.linear + other.linear * scale }
    }

    /// The motion times `scale`.
    #[inline(always)] // part of the kernels
    pub fn scaled(self, scale: f64) -> Self {
        Self { angular: self.angular * scale, linear: self.linear * scale }
    }

    /// Its six components, rotation first.
    #[inline(always)] // part of the kernels
    pub fn components(self) -> [f64; 6] {
        let (angular, linear) = (self.angular, self.linear);
        [angular.x, angular.y, angular.z, linear.x, linear.y, linear.z]
    }

    /// Greatest magnitude of a component, rad/s or m/s.
    #[inline(always)] // part of the kernels
    pub fn amax(self) -> f64 {
        self.angular.amax().max(self.linear.amax())
    }

    /// Power of `force` along this motion (W), or any other pairing of the two kinds.
    #[inline(always)] // part of the kernels
    pub fn dot(self, force: SpatialForce) -> f64 {
        self.angular.dot(&force.moment) + self.linear.dot(&force.force)
    }

    /// Rate of change of a motion vector `other` that moves with this motion.
    #[inline(always)] // part of the kernels
    pub fn cross_motion(self, other: Self) -> Self {
        Self {
            angular: self.angular.cross(&other.angular),
            linear: self.angular.cross(&other.linear) + self.linear.cross(&other.angular),
        }
    }

    /// Rate of change of a force vector `other` that moves with this motion.
    #[inline(always)] // part of the kernels
    pub fn cross_force(self, other: SpatialForce) -> SpatialForce {
        SpatialForce {
            moment: self.angular.cross(&other.moment) + self.linear.cross(&other.force),
            force: self.angular.cross(&other.force),
        }
    }

    /// Velocity of the point `at` (relative to the common point) of a body with this motion.
    #[inline(always)] // part of the kernels
    pub fn at(self, at: Vector3<f64>) -> Vector3<f64> {
        self.linear + self.angular.cross(&at)
    }
}

impl SpatialForce {
    /// No force.
    pub const ZERO: Self = Self { moment: Vector3::new(0.0, 0.0, 0.0), force: Vector3::new(0.0, 0.0, 0.0) };

    /// A force (N) acting at the point `at` (relative to the common point).
    #[inline(always)] // part of the kernels
    pub fn at(at: Vector3<f64>, force: Vector3<f64>) -> Self {
        Self { moment: at.cross(&force), force }
    }

    /// Sum of two forces.
    #[inline(always)] // part of the kernels
    pub fn plus(self, other: Self) -> Self {
        Self { moment: self.moment + other.moment, force: self.force + other.force }
    }

    /// `self + scale * other`.
    #[inline(always)] // part of the kernels
    pub fn plus_scaled(self, other: Self, scale: f64) -> Self {
        Self { moment: self.moment + other.moment * scale, force: self.force + other.force * scale }
    }

    /// The force times `scale`.
    #[inline(always)] // part of the kernels
    pub fn scaled(self, scale: f64) -> Self {
        Self { moment: self.moment * scale, force: self.force * scale }
    }

    /// Its six components, moment first.
    #[inline(always)] // part of the kernels
    pub fn components(self) -> [f64; 6] {
        let (moment, force) = (self.moment, self.force);
        [moment.x, moment.y, moment.z, force.x, force.y, force.z]
    }
}

/// Inertia of a rigid body, or of several that move as one, about the common point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidInertia {
    /// kg.
    pub mass: f64,
    /// Mass times centre of mass, kg m.
    pub first_moment: Vector3<f64>,
    /// Rotational inertia about the common point, kg m².
    pub rotational: Matrix3<f64>,
}

impl RigidInertia {
    /// Nothing.
    pub const ZERO: Self = Self {
        mass: 0.0,
        first_moment: Vector3::new(0.0, 0.0, 0.0),
        rotational: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
    };

    /// From mass, centre of mass `center` (relative to the common point) and the rotational inertia
    /// about it, along the world axes.
    #[inline(always)] // part of the kernels
    pub fn new(mass: f64, center: Vector3<f64>, about_center: Matrix3<f64>) -> Self {
        let first_moment = center * mass;
        let (x, y, z) = (center.x, center.y, center.z);
        let (mx, my, mz) = (first_moment.x, first_moment.y, first_moment.z);
        let mut rotational = about_center;
        rotational[(0, 0)] += my * y + mz * z;
        rotational[(1, 1)] += mx * x + mz * z;
        rotational[(2, 2)] += mx * x + my * y;
        rotational[(0, 1)] -= mx * y;
        rotational[(1, 0)] -= mx * y;
        rotational[(0, 2)] -= mx * z;
        rotational[(2, 0)] -= mx * z;
        rotational[(1, 2)] -= my * z;
        rotational[(2, 1)] -= my * z;
        Self { mass, first_moment, rotational }
    }

    /// The inertia of both, moving as one.
    #[inline(always)] // part of the kernels
    pub fn plus(self, other: Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            rotational: self.rotational + other.rotational,
        }
    }

    /// Momentum of the body at velocity `motion`, or the force that gives it the acceleration `motion`.
    #[inline(always)] // part of the kernels
    pub fn times(self, motion: SpatialMotion) -> SpatialForce {
        SpatialForce {
            moment: self.rotational * motion.angular + self.first_moment.cross(&motion.linear),
            force: motion.linear * self.mass - self.first_moment.cross(&motion.angular),
        }
    }
}

/// `rotation · inertia · rotationᵀ`: a symmetric matrix in a body's axes, expressed in the axes that `rotation` leads to.
#[inline(always)] // part of the kernels
pub fn rotated(rotation: &Matrix3<f64>, inertia: &Matrix3<f64>) -> Matrix3<f64> {
    let half = rotation * inertia;
    let entry = |row: usize, column: usize| {
        half[(row, 0)] * rotation[(column, 0)]
            + half[(row, 1)] * rotation[(column, 1)]
            + half[(row, 2)] * rotation[(column, 2)]
    };
    let (xy, xz, yz) = (entry(0, 1), entry(0, 2), entry(1, 2));
    Matrix3::new(entry(0, 0), xy, xz, xy, entry(1, 1), yz, xz, yz, entry(2, 2))
}

/// Inertia that a body shows at the common point when the joints beyond it are free to accelerate
/// (articulated-body inertia, Featherstone 2008 chapter 7): a symmetric 6 × 6 matrix, in blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArticulatedInertia {
    /// Moment by rotation, kg m²; symmetric, of which these are xx, xy, xz, yy, yz, zz.
    rotational: [f64; 6],
    /// Moment by translation, kg m, by rows; transposed, force by rotation.
    coupling: [f64; 9],
    /// Force by translation, kg; symmetric, in the order of `rotational`.
    translational: [f64; 6],
}

impl From<RigidInertia> for ArticulatedInertia {
    #[inline(always)] // part of the kernels
    fn from(rigid: RigidInertia) -> Self {
        let [m, x, y, z, rotational @ ..] = rigid.numbers();
        Self {
            rotational,
            coupling: [0.0, -z, y, z, 0.0, -x, -y, x, 0.0],
            translational: [m, 0.0, 0.0, m, 0.0, m],
        }
    }
}

impl ArticulatedInertia {
    /// Force that gives the acceleration `motion`.
    #[inline(always)] // the two sweeps of the dynamics spend most of their time here
    pub fn times(&self, motion: SpatialMotion) -> SpatialForce {
        let (w, v) = (motion.angular, motion.linear);
        let (a, h, m) = (&self.rotational, &self.coupling, &self.translational);
        let moment = Vector3::new(
            a[0] * w.x + a[1] * w.y + a[2] * w.z + h[0] * v.x + h[1] * v.y + h[2] * v.z,
            a[1] * w.x + a[3] * w.y + a[4] * w.z + h[3] * v.x + h[4] * v.y + h[5] * v.z,
            a[2] * w.x + a[4] * w.y + a[5] * w.z + h[6] * v.x + h[7] * v.y + h[8] * v.z,
        );
        let force = Vector3::new(
            h[0] * w.x + h[3] * w.y + h[6] * w.z + m[0] * v.x + m[1] * v.y + m[2] * v.z,
            h[1] * w.x + h[4] * w.y + h[7] * w.z + m[1] * v.x + m[3] * v.y + m[4] * v.z,
            h[2] * w.x + h[5] * w.y + h[8] * w.z + m[2] * v.x + m[4] * v.y + m[5] * v.z,
        );
        SpatialForce { moment, force }
    }

    /// This less the effect of a joint's freedom: `self − u uᵀ / d`.
    #[inline(always)] // part of the kernels
    pub fn reduced(mut self, u: SpatialForce, inverse_d: f64) -> Self {
        let (c, f) = (u.moment, u.force);
        let (by_c, by_f) = (c * inverse_d, f * inverse_d);
        let of = |u: &Vector3<f64>, by: &Vector3<f64>| {
            [u.x * by.x, u.x * by.y, u.x * by.z, u.y * by.y, u.y * by.z, u.z * by.z]
        };
        for (entry, less) in self.rotational.iter_mut().zip(of(&c, &by_c)) {
            *entry -= less;
        }
        for (entry, less) in self.translational.iter_mut().zip(of(&f, &by_f)) {
            *entry -= less;
        }
        let (h, [x, y, z]) = (&mut self.coupling, <[f64; 3]>::from(by_f));
        h[0] -= c.x * x;
        h[1] -= c.x * y;
        h[2] -= c.x * z;
        h[3] -= c.y * x;
        h[4] -= c.y * y;
        h[5] -= c.y * z;
        h[6] -= c.z * x;
        h[7] -= c.z * y;
        h[8] -= c.z * z;
        self
    }

    /// All 36 entries by rows, both in the order translation first.
    #[inline(always)] // part of the kernels
    pub fn entries(&self) -> [[f64; 6]; 6] {
        let [xx, xy, xz, yy, yz, zz] = self.rotational;
        let [a, b, c, d, e, f, g, h, i] = self.coupling;
        let [mxx, mxy, mxz, myy, myz, mzz] = self.translational;
        [
            [mxx, mxy, mxz, a, d, g],
            [mxy, myy, myz, b, e, h],
            [mxz, myz, mzz, c, f, i],
            [a, b, c, xx, xy, xz],
            [d, e, f, xy, yy, yz],
            [g, h, i, xz, yz, zz],
        ]
    }
}

impl Numbers<6> for SpatialMotion {
    #[inline(always)] // part of the kernels
    fn numbers(self) -> [f64; 6] {
        self.components()
    }

    #[inline(always)] // part of the kernels
    fn from_numbers([x, y, z, linear @ ..]: [f64; 6]) -> Self {
        Self { angular: [x, y, z].into(), linear: linear.into() }
    }
}

impl Numbers<6> for SpatialForce {
    #[inline(always)] // part of the kernels
    fn numbers(self) -> [f64; 6] {
        self.components()
    }

    #[inline(always)] // part of the kernels
    fn from_numbers([x, y, z, force @ ..]: [f64; 6]) -> Self {
        Self { moment: [x, y, z].into(), force: force.into() }
    }
}

impl Numbers<10> for RigidInertia {
    /// The mass, the first moment, and xx, xy, xz, yy, yz, zz of the rotational inertia, which is symmetric.
    #[inline(always)] // part of the kernels
    fn numbers(self) -> [f64; 10] {
        let (first, i) = (self.first_moment, &self.rotational);
        [self.mass, first.x, first.y, first.z, i.m11, i.m12, i.m13, i.m22, i.m23, i.m33]
    }

    #[inline(always)] // part of the kernels
    fn from_numbers([mass, x, y, z, xx, xy, xz, yy, yz, zz]: [f64; 10]) -> Self {
        Self {
            mass,
            first_moment: Vector3::new(x, y, z),
            rotational: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        }
    }
}

impl Numbers<21> for ArticulatedInertia {
    #[inline(always)] // part of the kernels
    fn numbers(self) -> [f64; 21] {
        let [r0, r1, r2, r3, r4, r5] = self.rotational;
        let [c0, c1, c2, c3, c4, c5, c6, c7, c8] = self.coupling;
        let [t0, t1, t2, t3, t4, t5] = self.translational;
        [r0, r1, r2, r3, r4, r5, c0, c1, c2, c3, c4, c5, c6, c7, c8, t0, t1, t2, t3, t4, t5]
    }

    #[inline(always)] // part of the kernels
    fn from_numbers(n: [f64; 21]) -> Self {
        Self {
            rotational: [n[0], n[1], n[2], n[3], n[4], n[5]],
            coupling: [n[6], n[7], n[8], n[9], n[10], n[11], n[12], n[13], n[14]],
            translational: [n[15], n[16], n[17], n[18], n[19], n[20]],
        }
    }
}
