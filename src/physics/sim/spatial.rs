//! Six-dimensional rigid-body algebra (Featherstone 2008), in one frame.
//!
//! Every quantity of a step is written along the world axes about one common point, the origin of
//! the root link at the beginning of the step. Velocities, forces and inertias of different bodies
//! may therefore be added as they are, with no transform between them, and numbers stay small
//! however far the character has travelled.

use nalgebra::{Matrix3, Vector3};

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

impl SpatialMotion {
    /// At rest.
    pub const ZERO: Self = Self { angular: Vector3::new(0.0, 0.0, 0.0), linear: Vector3::new(0.0, 0.0, 0.0) };

    /// Sum of two motions.
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        Self { angular: self.angular + other.angular, linear: self.linear + other.linear }
    }

    /// Difference of two motions.
    #[inline]
    pub fn minus(self, other: Self) -> Self {
        Self { angular: self.angular - other.angular, linear: self.linear - other.linear }
    }

    /// `self + scale * other`.
    #[inline]
    pub fn plus_scaled(self, other: Self, scale: f64) -> Self {
        Self { angular: self.angular + other.angular * scale, linear: self.linear + other.linear * scale }
    }

    /// The motion times `scale`.
    #[inline]
    pub fn scaled(self, scale: f64) -> Self {
        Self { angular: self.angular * scale, linear: self.linear * scale }
    }

    /// Its six components, rotation first.
    #[inline]
    pub fn components(self) -> [f64; 6] {
        let (angular, linear) = (self.angular, self.linear);
        [angular.x, angular.y, angular.z, linear.x, linear.y, linear.z]
    }

    /// Greatest magnitude of a component, rad/s or m/s.
    #[inline]
    pub fn amax(self) -> f64 {
        self.angular.amax().max(self.linear.amax())
    }

    /// Power of `force` along this motion (W), or any other pairing of the two kinds.
    #[inline]
    pub fn dot(self, force: SpatialForce) -> f64 {
        self.angular.dot(&force.moment) + self.linear.dot(&force.force)
    }

    /// Rate of change of a motion vector `other` that moves with this motion.
    #[inline]
    pub fn cross_motion(self, other: Self) -> Self {
        Self {
            angular: self.angular.cross(&other.angular),
            linear: self.angular.cross(&other.linear) + self.linear.cross(&other.angular),
        }
    }

    /// Rate of change of a force vector `other` that moves with this motion.
    #[inline]
    pub fn cross_force(self, other: SpatialForce) -> SpatialForce {
        SpatialForce {
            moment: self.angular.cross(&other.moment) + self.linear.cross(&other.force),
            force: self.angular.cross(&other.force),
        }
    }

    /// Velocity of the point `at` (relative to the common point) of a body with this motion.
    #[inline]
    pub fn at(self, at: Vector3<f64>) -> Vector3<f64> {
        self.linear + self.angular.cross(&at)
    }
}

impl SpatialForce {
    /// No force.
    pub const ZERO: Self = Self { moment: Vector3::new(0.0, 0.0, 0.0), force: Vector3::new(0.0, 0.0, 0.0) };

    /// A force (N) acting at the point `at` (relative to the common point).
    #[inline]
    pub fn at(at: Vector3<f64>, force: Vector3<f64>) -> Self {
        Self { moment: at.cross(&force), force }
    }

    /// Sum of two forces.
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        Self { moment: self.moment + other.moment, force: self.force + other.force }
    }

    /// `self + scale * other`.
    #[inline]
    pub fn plus_scaled(self, other: Self, scale: f64) -> Self {
        Self { moment: self.moment + other.moment * scale, force: self.force + other.force * scale }
    }

    /// The force times `scale`.
    #[inline]
    pub fn scaled(self, scale: f64) -> Self {
        Self { moment: self.moment * scale, force: self.force * scale }
    }

    /// Its six components, moment first.
    #[inline]
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
    #[inline]
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
    #[inline]
    pub fn plus(self, other: Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            first_moment: self.first_moment + other.first_moment,
            rotational: self.rotational + other.rotational,
        }
    }

    /// Momentum of the body at velocity `motion`, or the force that gives it the acceleration `motion`.
    #[inline]
    pub fn times(self, motion: SpatialMotion) -> SpatialForce {
        SpatialForce {
            moment: self.rotational * motion.angular + self.first_moment.cross(&motion.linear),
            force: motion.linear * self.mass - self.first_moment.cross(&motion.angular),
        }
    }
}

/// `rotation · inertia · rotationᵀ`: a symmetric matrix in a body's axes, expressed in the axes that `rotation` leads to.
#[inline]
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
/// (articulated-body inertia, Featherstone 2008 chapter 7): a symmetric 6 × 6 matrix.
///
/// Rows are those of a [`SpatialForce`], moment first, and columns those of a [`SpatialMotion`], rotation first. Whole
/// aligned columns, both halves of the matrix kept, are what compiles to the fewest instructions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(16))]
pub struct ArticulatedInertia {
    columns: [[f64; 6]; 6],
}

impl From<RigidInertia> for ArticulatedInertia {
    #[inline]
    fn from(rigid: RigidInertia) -> Self {
        let i = &rigid.rotational;
        let (x, y, z) = (rigid.first_moment.x, rigid.first_moment.y, rigid.first_moment.z);
        let m = rigid.mass;
        Self {
            columns: [
                [i[(0, 0)], i[(1, 0)], i[(2, 0)], 0.0, -z, y],
                [i[(0, 1)], i[(1, 1)], i[(2, 1)], z, 0.0, -x],
                [i[(0, 2)], i[(1, 2)], i[(2, 2)], -y, x, 0.0],
                [0.0, z, -y, m, 0.0, 0.0],
                [-z, 0.0, x, 0.0, m, 0.0],
                [y, -x, 0.0, 0.0, 0.0, m],
            ],
        }
    }
}

impl ArticulatedInertia {
    /// Force that gives the acceleration `motion`.
    #[inline(always)] // the two sweeps of the dynamics spend most of their time here
    pub fn times(&self, motion: SpatialMotion) -> SpatialForce {
        let (angular, linear) = (motion.angular, motion.linear);
        let motion = [angular.x, angular.y, angular.z, linear.x, linear.y, linear.z];
        let mut force = [0.0; 6];
        for (column, scale) in self.columns.iter().zip(motion) {
            force = std::array::from_fn(|row| force[row] + column[row] * scale);
        }
        let [moment @ .., fx, fy, fz] = force;
        SpatialForce { moment: moment.into(), force: [fx, fy, fz].into() }
    }

    /// Adds `other` less the effect of its joint's freedom: `other − u uᵀ / d`.
    #[inline(always)] // part of the kernels
    pub fn add_reduced(&mut self, other: &Self, u: SpatialForce, inverse_d: f64) {
        let u = u.components();
        for ((sum, column), each) in self.columns.iter_mut().zip(&other.columns).zip(u) {
            let scale = each * inverse_d;
            *sum = std::array::from_fn(|row| sum[row] + (column[row] - scale * u[row]));
        }
    }

    /// An entry, row and column both in the order moment and rotation first.
    #[inline]
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        self.columns[column][row]
    }
}
