//! Contact geometry: where shapes can make contact with a plane, their convex solids, and which pairs of shapes can
//! make contact with each other.

mod convert;
pub mod convex;
mod hull;
pub mod pairs;
mod surface;

pub use surface::{CYLINDER_SLOTS, GroundBody, GroundShape, Surface};
pub(super) use surface::{candidates, ground_bodies};
