//! When a character has fallen.

use nalgebra::{Unit, Vector3};

use super::standing::Stance;
use crate::model::Model;
use crate::scene::{Scene, Terrain};
use crate::sim::State;

/// Tilt of the root from its standing orientation at which a character has fallen, rad.
const FALLEN_TILT: f64 = 1.0;

/// Share of the trunk's standing height below which a character has fallen.
const FALLEN_HEIGHT: f64 = 0.4;

/// The test whether a character is still upright.
#[derive(Debug, Clone, PartialEq)]
pub struct Upright {
    /// The world's vertical in the root's frame when standing.
    up: Unit<Vector3<f64>>,
    /// The point by which the height of the trunk is told ([`Model::height_mark`]), in the root's frame, m.
    mark: Vector3<f64>,
    /// The ground, and the least height of that point over it, m; `None` where the root may lie on the ground.
    least_height: Option<(Terrain, f64)>,
}

impl Upright {
    /// For `model` standing as in `stance` on the ground of `scene`.
    ///
    /// A root that carries the character when it stands (a snake's) may be as low as it likes.
    pub fn new(model: &Model, stance: &Stance, scene: &Scene) -> Self {
        let root_carries = stance.support.iter().any(|link| model.links[*link].body == 0);
        let ground = scene.ground.as_ref().filter(|_| !root_carries && !model.fixed_base).map(Terrain::new);
        let orientation = stance.state.root.orientation;
        let mark = model.height_mark(stance.root_height, &orientation);
        let height = stance.root_height + (orientation * mark).z;
        Self {
            up: Unit::new_unchecked(orientation.inverse() * Vector3::z()),
            mark,
            least_height: ground.map(|ground| (ground, FALLEN_HEIGHT * height)),
        }
    }

    /// Whether the character is upright in `state`.
    pub fn holds(&self, state: &State) -> bool {
        let up = state.root.orientation * self.up;
        let mark = state.root.position + state.root.orientation * self.mark;
        let over = |(ground, least): &(Terrain, f64)| mark.z > ground.height(mark.x, mark.y) + least;
        up.z > FALLEN_TILT.cos() && self.least_height.as_ref().is_none_or(over)
    }
}
