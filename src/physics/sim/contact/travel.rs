//! An upper bound of how far the shapes of a character have moved towards each other.
//!
//! A joint rotation by Δq moves no point beyond the joint by more than its distance from the axis times |Δq|, so that
//! the distance of two shapes need not be computed again before the joints have rotated by that much.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::{Matrix3, Vector3};

use super::detection::DetectionSettings;
use crate::model::{DofKind, Model};
use crate::sim::bodies::Bodies;
use crate::sim::spatial::SpatialMotion;

/// Bounds how far shapes have moved since the last detection: relative to the root, or to the world if it holds
/// anything that they can touch.
#[derive(Debug, Clone)]
pub struct Travel {
    /// Whether shapes may touch what does not move with the root.
    world: bool,
    /// Joint angles, the common point and the root's orientation when last seen.
    angles: Vec<f64>,
    origin: Vector3<f64>,
    rotation: Matrix3<f64>,
    /// Whether they have been seen.
    seen: bool,
    /// Greatest distance from each body's origin of any point of its shapes, m.
    farthest: Vec<f64>,
    /// The same of its shapes and those beyond.
    beyond: Vec<f64>,
    /// How far any point of each body can have moved since it was last seen, m.
    moved: Vec<f64>,
    /// The same since [`Travel::measure`].
    travelled: Vec<f64>,
    /// Greatest speed of any point of each body's shapes, m/s.
    speed: Vec<f64>,
}

impl Travel {
    /// For the shapes of `model`.
    pub fn new(model: &Model, world: bool) -> Self {
        let bodies = model.bodies.len();
        let mut farthest = vec![0.0_f64; bodies];
        for shape in &model.ground_shapes {
            farthest[shape.body] = farthest[shape.body].max(shape.farthest);
        }
        Self {
            world,
            angles: vec![0.0; model.joint_count()],
            origin: Vector3::zeros(),
            rotation: Matrix3::identity(),
            seen: false,
            beyond: farthest.clone(),
            farthest,
            moved: vec![0.0; bodies],
            travelled: vec![0.0; bodies],
            speed: vec![0.0; bodies],
        }
    }

    /// Updates the bounds to the character's present pose, and returns the greatest distance that a body has travelled
    /// since [`Travel::measure`], m, infinite if it is unknown. `angles` are those of the joints if `bodies` follow from
    /// them, `origin` is the common point in the world.
    pub fn update(
        &mut self,
        model: &Model,
        bodies: &Bodies,
        origin: Vector3<f64>,
        angles: Option<&[f64]>,
    ) -> f64 {
        let seen = std::mem::replace(&mut self.seen, angles.is_some());
        let Some(angles) = angles else {
            self.travelled.fill(f64::INFINITY);
            return f64::INFINITY;
        };
        let rotation = bodies.at(0).rotation;
        if self.world {
            // A rotation by φ moves a point at distance r by 2 r sin(φ / 2), and the matrix by 2 √2 sin(φ / 2).
            let turned = (rotation - self.rotation).norm() * FRAC_1_SQRT_2;
            self.moved[0] = (origin - self.origin).norm() + turned * self.beyond[0];
        }
        self.travelled[0] += self.moved[0];
        let mut farthest = self.travelled[0];
        for (joint, (angle, last)) in angles.iter().zip(&self.angles).enumerate() {
            let body = &model.bodies[joint + 1];
            let moment_arm = match body.dof {
                DofKind::Revolute => self.beyond[joint + 1],
                DofKind::Prismatic => 1.0,
            };
            let moved = self.moved[body.parent] + (angle - last).abs() * moment_arm;
            self.moved[joint + 1] = moved;
            self.travelled[joint + 1] += moved;
            farthest = farthest.max(self.travelled[joint + 1]);
        }
        self.angles.copy_from_slice(angles);
        (self.origin, self.rotation) = (origin, rotation);
        if !seen {
            self.travelled.fill(f64::INFINITY);
            farthest = f64::INFINITY;
        }
        farthest
    }

    /// The most by which points of the two bodies can have come nearer to each other since [`Travel::measure`], m; what
    /// is no body of the character stands still.
    #[inline]
    pub fn nearer(&self, body: usize, other: Option<usize>) -> f64 {
        self.travelled[body] + other.map_or(0.0, |other| self.travelled[other])
    }

    /// Starts again from the present pose, and measures the reach of every body. The bounds hold until a sliding joint has
    /// moved by `slide` m.
    pub fn measure(&mut self, model: &Model, slide: f64) {
        self.travelled.fill(0.0);
        self.beyond.copy_from_slice(&self.farthest);
        for index in (1..model.bodies.len()).rev() {
            let body = &model.bodies[index];
            let shift = match body.dof {
                DofKind::Revolute => 0.0,
                DofKind::Prismatic => self.angles[index - 1].abs() + slide,
            };
            // Without a shape nothing beyond this joint is of interest.
            if self.beyond[index] > 0.0 {
                let reach = body.offset.norm() + shift + self.beyond[index];
                self.beyond[body.parent] = self.beyond[body.parent].max(reach);
            }
        }
    }

    /// Measures how fast the bodies move, and returns the greatest gap of two shapes that a step can close, m.
    pub fn measure_speeds(&mut self, bodies: &Bodies, settings: &DetectionSettings) -> f64 {
        let frame = if self.world { SpatialMotion::ZERO } else { bodies.at(0).velocity };
        let mut fastest = 0.0_f64;
        for (index, (farthest, speed)) in self.farthest.iter().zip(&mut self.speed).enumerate() {
            let body = bodies.at(index);
            let velocity = body.velocity.minus(frame);
            // Sums are no less than the norms and take no roots.
            *speed = velocity.at(body.origin).abs().sum() + velocity.angular.abs().sum() * farthest;
            fastest = fastest.max(*speed);
        }
        settings.margin(2.0 * fastest)
    }

    /// The greatest gap of shapes of the two bodies that a step can close, m.
    #[inline]
    pub fn within(&self, body: usize, other: Option<usize>, settings: &DetectionSettings) -> f64 {
        settings.margin(self.speed[body] + other.map_or(0.0, |other| self.speed[other]))
    }
}
