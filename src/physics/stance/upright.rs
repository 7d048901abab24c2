//! When a character has fallen.

use nalgebra::{Unit, Vector3};

use super::standing::Stance;
use crate::model::Model;
use crate::scene::{Scene, Terrain};
use crate::sim::State;

/// Tilt of the root from its standing orientation at which a character has fallen, rad.
const FALLEN_TILT: f64 = 1.0;

/// Share of the standing root height below which a character has fallen.
const FALLEN_HEIGHT: f64 = 0.4;

/// The test whether a character is still upright.
#[derive(Debug, Clone, PartialEq)]
pub struct Upright {
    /// The world's vertical in the root's frame when standing.
    up: Unit<Vector3<f64>>,
    /// The ground, and the least height of the root's origin over it, m; `None` where the root may lie on the ground.
    least_height: Option<(Terrain, f64)>,
}

impl Upright {
    /// For `model` standing as in `stance` on the ground of `scene`.
    ///
    /// A root that carries the character when it stands (a snake's) may be as low as it likes.
    pub fn new(model: &Model, stance: &Stance, scene: &Scene) -> Self {
        let root_carries = stance.support.iter().any(|link| model.links[*link].body == 0);
        let ground = scene.ground.as_ref().filter(|_| !root_carries && !model.fixed_base).map(Terrain::new);
        Self {
            up: Unit::new_unchecked(stance.state.root.orientation.inverse() * Vector3::z()),
            least_height: ground.map(|ground| (ground, FALLEN_HEIGHT * stance.root_height)),
        }
    }

    /// Whether the character is upright in `state`.
    pub fn holds(&self, state: &State) -> bool {
        let up = state.root.orientation * self.up;
        let root = state.root.position;
        let over = |(ground, least): &(Terrain, f64)| root.z > ground.height(root.x, root.y) + least;
        up.z > FALLEN_TILT.cos() && self.least_height.as_ref().is_none_or(over)
    }
}
