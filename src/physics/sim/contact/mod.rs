//! Where the character touches the world and itself.

mod candidate;
mod detection;
mod displacement;
mod field;
pub mod ground;
mod manifold;
pub mod solids;
pub mod travel;

use nalgebra::{Point3, Vector3};

pub use candidate::{Against, ContactCandidate};
pub use detection::DetectionSettings;

/// A contact of the last step. Where the step was computed in parts, what follows is that of all parts in which it touched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Index of the character's link.
    pub link: usize,
    /// What it touches.
    pub against: Against,
    /// Where, in the world frame, m: of several parts the mean, by how hard they pushed.
    pub position: Point3<f64>,
    /// From what is touched into the link, of unit length.
    pub normal: Vector3<f64>,
    /// On the link, world frame, N: the mean over the step.
    pub force: Vector3<f64>,
    /// Velocity of the link's material point there after the step (or the last part), against that of what it touches,
    /// world frame, m/s.
    pub velocity: Vector3<f64>,
    /// Greatest depth of penetration at the beginning of the step (or of a part), m; negative for a gap.
    pub depth: f64,
}
