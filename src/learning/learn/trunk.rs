//! Whether the trunk may rotate.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gaitwright_physics::fault::Fault;
use gaitwright_physics::scene::{Effect, Scene, Switch};

/// Whether the trunk may rotate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Trunk {
    /// As physics has it.
    #[default]
    Free,
    /// The root link keeps its orientation (Tokizaki & Hasegawa section 3.4).
    Locked,
}

impl Trunk {
    /// `scene` with the effect that a locked trunk is: the rotation lock of the root link.
    pub fn in_scene(self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        if self == Self::Locked {
            scene.effects.insert(Effect::TrunkRotationLock, Switch::On);
        }
        scene
    }

    /// The faults of a trunk that is to be locked in a scene that switches the effect off, one at each of the two
    /// places: JSON pointers into a document with `scene` and `learning`.
    pub fn contradictions(self, scene: &Scene) -> Vec<Fault> {
        let lock = scene.effects.get(&Effect::TrunkRotationLock);
        if self != Self::Locked || lock != Some(&Switch::Off) {
            return Vec::new();
        }
        vec![
            Fault::new(
                "/scene/effects/trunk_rotation_lock",
                "the effect is switched off, but /learning/trunk is locked, which is this effect",
            ),
            Fault::new(
                "/learning/trunk",
                "the trunk is to be locked, but /scene/effects/trunk_rotation_lock is off",
            ),
        ]
    }
}
