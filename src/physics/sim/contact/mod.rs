//! Contacts of the character with the ground, with obstacles and with itself.

mod candidate;
mod detection;
mod displacement;
mod field;
pub mod grip;
pub mod ground;
mod manifold;
pub mod solids;
pub mod travel;

use nalgebra::{Point3, Vector3};

pub use candidate::{Against, ContactCandidate};
pub use detection::DetectionSettings;

/// A contact of the last step. In a step of several substeps: of all substeps in which it was closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Index of the character's link.
    pub link: usize,
    /// The other side of the contact.
    pub against: Against,
    /// Point of contact, world frame, m; over substeps the mean, weighted by the normal force.
    pub position: Point3<f64>,
    /// Unit normal, world frame, from the other side into the link.
    pub normal: Vector3<f64>,
    /// Force on the link, world frame, N: the mean over the step.
    pub force: Vector3<f64>,
    /// Velocity of the link's material point there relative to the other side, world frame, m/s, after the last substep.
    pub velocity: Vector3<f64>,
    /// Greatest depth of penetration at the beginning of a substep, m; negative for a gap.
    pub depth: f64,
}
