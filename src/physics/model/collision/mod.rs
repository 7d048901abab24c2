//! Shapes that touch: where they can touch a plane, their solids, and which of them can touch each other.

mod convert;
pub mod convex;
mod hull;
pub mod pairs;
mod surface;

pub(super) use surface::candidates;
pub use surface::{CYLINDER_SLOTS, GroundShape, Surface};
