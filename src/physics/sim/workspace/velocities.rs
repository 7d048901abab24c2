//! Where bodies are in a step, and the velocities that its stages give them.

use nalgebra::Point3;

use crate::model::Model;
use crate::sim::bodies::Bodies;
use crate::sim::per_body::{Motions, PerBody};
use crate::sim::spatial::SpatialMotion;

/// Where the bodies are, and how they move before the step. (CoordinateSystem::place)
#[derive(Debug, Clone)]
pub struct Placement {
    /// Common point of the step: the root's origin in the world at its beginning, m.
    pub common_point: Point3<f64>,
    /// B poses and inertias, and the velocities at which velocity-dependent forces are taken (place, predict_mean,
    /// correct_mean).
    pub bodies: Bodies,
    /// B velocities at the beginning of the step.
    pub old: Motions,
    /// J joint velocities at which velocity-dependent forces are taken, rad/s or m/s. (place, predict_mean, correct_mean)
    pub mean_rates: Vec<f64>,
}

impl Placement {
    /// Room for the bodies of `model`.
    pub fn new(model: &Model) -> Self {
        Self {
            common_point: Point3::origin(),
            bodies: Bodies::new(model),
            old: PerBody::new(model, SpatialMotion::ZERO),
            mean_rates: vec![0.0; model.joint_count()],
        }
    }

    /// Keeps the bodies' velocities and the joints' `rates` as those of the beginning, at which forces are first taken.
    pub fn begin(&mut self, rates: &[f64]) {
        self.old.copy_from(&self.bodies.velocity);
        self.mean_rates.copy_from_slice(rates);
    }

    /// Exchanges the bodies' velocities for `others`.
    pub fn exchange_velocities(&mut self, others: &mut Motions) {
        std::mem::swap(&mut self.bodies.velocity, others);
    }
}

/// Velocities of all bodies and all joints.
#[derive(Debug, Clone)]
pub struct Velocities {
    /// B, about the common point.
    pub bodies: Motions,
    /// J, rad/s or m/s.
    pub rates: Vec<f64>,
}

impl Velocities {
    /// Those of `model` at rest.
    pub fn new(model: &Model) -> Self {
        Self { bodies: PerBody::new(model, SpatialMotion::ZERO), rates: vec![0.0; model.joint_count()] }
    }

    /// Takes those of `other`.
    pub fn copy_from(&mut self, other: &Self) {
        self.bodies.copy_from(&other.bodies);
        self.rates.copy_from_slice(&other.rates);
    }

    /// Gives the bodies the velocities `before` and the changes `by`.
    pub fn change(&mut self, before: &Motions, by: &Motions) {
        for ((new, before), change) in self.bodies.groups.iter_mut().zip(&before.groups).zip(&by.groups) {
            new.set_sum(before, change);
        }
    }
}
