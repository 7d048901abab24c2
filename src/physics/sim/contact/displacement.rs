//! Where a step takes the points of a body.

use nalgebra::{Rotation3, Vector3};

use crate::sim::bodies::BodyMotion;
use crate::sim::spatial::Motion;

/// A step may drive a point into what it touches by this much, m, before it becomes a touch.
pub(super) const DRIVEN_IN: f64 = 1e-5;

/// Where a step at a given velocity takes a body.
pub(super) struct Moved {
    /// Its origin at the beginning, relative to the common point, m.
    pub(super) origin: Vector3<f64>,
    /// How far that moves, m.
    pub(super) shift: Vector3<f64>,
    pub(super) turn: Rotation3<f64>,
}

impl Moved {
    /// For `step` seconds of the velocity `new`.
    pub(super) fn new(body: &BodyMotion, new: Motion, step: f64) -> Self {
        let shift = new.at(body.origin) * step;
        Self { origin: body.origin, shift, turn: Rotation3::new(new.angular * step) }
    }

    /// Where it takes the point `at` of the body.
    pub(super) fn point(&self, at: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.shift + self.turn * (at - self.origin)
    }

    /// Which point of the body it takes to `at`.
    pub(super) fn point_back(&self, at: Vector3<f64>) -> Vector3<f64> {
        self.origin + self.turned_back(at - self.origin - self.shift)
    }

    pub(super) fn turned(&self, direction: Vector3<f64>) -> Vector3<f64> {
        self.turn * direction
    }

    pub(super) fn turned_back(&self, direction: Vector3<f64>) -> Vector3<f64> {
        self.turn.inverse_transform_vector(&direction)
    }
}
