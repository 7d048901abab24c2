//! Where bodies are in a step, and the velocities that its stages give them.

use nalgebra::Point3;

use crate::sim::bodies::BodyMotion;
use crate::sim::spatial::SpatialMotion;

/// Where the bodies are, and how they move before the step. (CoordinateSystem::place)
#[derive(Debug, Clone)]
pub struct Placement {
    /// Common point of the step: the root's origin in the world at its beginning, m.
    pub common_point: Point3<f64>,
    /// B poses and inertias, and the velocities at which velocity-dependent forces are taken (place, predict_mean,
    /// correct_mean).
    pub bodies: Vec<BodyMotion>,
    /// B velocities at the beginning of the step.
    pub old: Vec<SpatialMotion>,
    /// J joint velocities at which velocity-dependent forces are taken, rad/s or m/s. (place, predict_mean, correct_mean)
    pub mean_rates: Vec<f64>,
}

impl Placement {
    /// Room for `bodies` bodies.
    pub fn new(bodies: usize) -> Self {
        Self {
            common_point: Point3::origin(),
            bodies: vec![BodyMotion::REST; bodies],
            old: vec![SpatialMotion::ZERO; bodies],
            mean_rates: vec![0.0; bodies - 1],
        }
    }

    /// Keeps the bodies' velocities and the joints' `rates` as those of the beginning, at which forces are first taken.
    pub fn begin(&mut self, rates: &[f64]) {
        for (old, body) in self.old.iter_mut().zip(&self.bodies) {
            *old = body.velocity;
        }
        self.mean_rates.copy_from_slice(rates);
    }

    /// Exchanges the bodies' velocities for `others`.
    pub fn exchange_velocities(&mut self, others: &mut [SpatialMotion]) {
        for (body, other) in self.bodies.iter_mut().zip(others) {
            std::mem::swap(&mut body.velocity, other);
        }
    }
}

/// Velocities of all bodies and all joints.
#[derive(Debug, Clone)]
pub struct Velocities {
    /// B, about the common point.
    pub bodies: Vec<SpatialMotion>,
    /// J, rad/s or m/s.
    pub rates: Vec<f64>,
}

impl Velocities {
    /// At rest: `bodies` bodies.
    pub fn new(bodies: usize) -> Self {
        Self { bodies: vec![SpatialMotion::ZERO; bodies], rates: vec![0.0; bodies - 1] }
    }

    /// Takes those of `other`.
    pub fn copy_from(&mut self, other: &Self) {
        self.bodies.copy_from_slice(&other.bodies);
        self.rates.copy_from_slice(&other.rates);
    }

    /// Gives the bodies the velocities `before` and the changes `by`.
    pub fn change(&mut self, before: &[SpatialMotion], by: &[SpatialMotion]) {
        for (new, (before, change)) in self.bodies.iter_mut().zip(before.iter().zip(by)) {
            *new = before.plus(*change);
        }
    }
}
