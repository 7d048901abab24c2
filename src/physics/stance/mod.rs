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
mod starts;
mod upright;
mod verify;

use std::sync::Arc;

use nalgebra::DMatrix;

use crate::model::Model;
use crate::scene::{Scene, Terrain};

pub use feet::feet;
pub use standing::Stance;
pub use upright::Upright;

/// What a sole costs in the search for a pose that is tilted by a right angle: at first, and where the pose found falls or tilts a sole.
const TILTED: [f64; 2] = [4.0, 400.0];

/// A sole is level up to this, rad: one of a fifth of the leg's length then lies within a five-hundredth of it.
const LEVEL: f64 = 0.01;

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
        let verified = |angles: Vec<f64>, given: bool| {
            let gains = gains::suited(model, scene, &angles);
            verify::verify(model, scene, angles, given, gains, stop)
        };
        if let Some(given) = pose::given(model) {
            return verified(given, true);
        }
        let found = verified(pose::search(model, TILTED[0]), false);
        if found.stable && pose::tilt(model, &found.angles) < LEVEL {
            return found;
        }
        // Soles near the end of their ankles' range may have been tilted for bent knees, and tip the character over.
        let angles = pose::search(model, TILTED[1]);
        if angles == found.angles {
            return found;
        }
        let level = verified(angles, false);
        if level.stable { level } else { found }
    }
}
