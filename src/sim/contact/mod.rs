//! Where the character touches the world.

pub mod ground;

use nalgebra::Vector3;

/// A place at which the character touches the ground, or is about to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// The model's contact slot.
    pub slot: usize,
    /// Index of the character's link.
    pub link: usize,
    /// Index of the body.
    pub body: usize,
    /// The point of the character, relative to the common point, m.
    pub at: Vector3<f64>,
    /// Depth of penetration, m; negative for a gap.
    pub depth: f64,
}
