//! A standing pose for any character, found and verified in the simulator, and the gains that hold it.
//!
//! The author's pose is taken where there is one. Otherwise a pose is searched for, with its
//! feet level and below their limbs, the limbs a little bent and the centre of mass above the feet. Either
//! is then held in the simulator until it is at rest, which shows whether it stands.

mod anatomy;
mod feet;
mod gains;
mod loops;
mod pose;
mod standing;
mod upright;
mod verify;

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::model::Model;
use crate::scene::{Scene, Terrain};

pub use feet::feet;
pub use standing::Stance;
pub use upright::Upright;

/// Height of the root's origin at which `model`, upright above the world's origin with joints at `angles`,
/// touches `ground`; all in m.
pub fn resting_height(model: &Model, angles: &[f64], ground: &Terrain) -> f64 {
    anatomy::Posed::new(model, angles).resting_height(ground)
}

/// Moves those of `angles` that are not `given` to where the loops of `model` are closed, as far as they can be. Gives the greatest
/// distance (m) or angle (rad) by which one is still open.
pub fn close_loops(model: &Model, angles: &mut [f64], given: impl Fn(usize) -> bool) -> f64 {
    loops::close_with(model, angles, given)
}

/// How the distances (m) and angles (rad) by which the loops of `model` are open change with each of its `angles`: a row for each relative
/// motion that a loop holds, a column for each joint.
pub fn loop_slopes(model: &Model, angles: &[f64]) -> DMatrix<f64> {
    loops::equations(model, &anatomy::Posed::new(model, angles)).0
}

impl Stance {
    /// Finds the standing pose of `model` on the ground of `scene`, or verifies the one its author gave.
    ///
    /// A character that is bolted to the world, or that has no ground or nothing to touch it with, is
    /// not verified: its root stays at the world's origin.
    pub fn find(model: &Arc<Model>, scene: &Scene) -> Self {
        Self::find_until(model, scene, &|| false)
    }

    /// The same, given up as soon as `stop` returns true; the stance is then not stable.
    pub fn find_until(model: &Arc<Model>, scene: &Scene, stop: &dyn Fn() -> bool) -> Self {
        let given = pose::given(model);
        let angles = given.clone().unwrap_or_else(|| pose::search(model));
        let gains = gains::suited(model, scene, &angles);
        verify::verify(model, scene, angles, given.is_some(), gains, stop)
    }
}
