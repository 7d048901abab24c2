//! Contact geometry: where shapes can make contact with a plane, their convex solids, and which pairs of shapes can
//! make contact with each other.

mod convert;
pub mod convex;
mod hull;
pub mod pairs;
mod surface;

pub(super) use surface::candidates;
pub use surface::{CYLINDER_SLOTS, GroundShape, Surface};
