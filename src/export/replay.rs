//! A motion document about to be played again as it was learned.

use std::sync::Arc;

use gaitwright_learning::check::MotionCheck;
use gaitwright_learning::learn::Task;
use gaitwright_physics::character::Character;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::model::{Base, Model};
use gaitwright_physics::motion::{Motion, Player, TargetLimits};
use gaitwright_physics::stance::Stance;

/// A motion document with everything it takes to play it.
#[derive(Debug, Clone)]
pub struct Replay<'a> {
    motion: &'a Motion,
    model: Arc<Model>,
    stance: Stance,
    player: Player,
    direction: [f64; 3],
    /// The gait that was asked for; `None` where any would do.
    gait: Option<String>,
}

impl<'a> Replay<'a> {
    /// Of `motion` and its character.
    ///
    /// # Errors
    ///
    /// When the motion is faulty, or not of this character.
    pub fn new(motion: &'a Motion, character: &Character) -> Result<Self, InputError> {
        let model = Arc::new(Model::new(Arc::new(character.clone()), Base::Floating));
        let player = Player::new(motion, &model.joint_names, &TargetLimits::of(&model.character))?;
        let stance = Stance::find(&model, &motion.scene);
        let direction =
            serde_json::from_value(asked(motion, "direction")).unwrap_or(Task::default().direction);
        let gait =
            serde_json::from_value(asked(motion, "gait")).ok().filter(|gait| *gait != Task::default().gait);
        Ok(Self { motion, model, stance, player, direction, gait })
    }

    /// Its targets.
    pub fn player(&self) -> &Player {
        &self.player
    }

    /// Names of the joints in the order in which they are played.
    pub(super) fn joint_names(&self) -> &[String] {
        &self.model.joint_names
    }

    /// The motion about to be played.
    pub fn check(&self) -> MotionCheck<'_> {
        MotionCheck {
            model: &self.model,
            stance: &self.stance,
            gains: &self.motion.drive,
            scene: &self.motion.scene,
            accuracy: &self.motion.provenance.accuracy,
            player: &self.player,
            direction: self.direction,
            speed: asked(self.motion, "speed").as_f64(),
            gait: self.gait.as_deref(),
        }
    }
}

/// A field of the task of a motion. Whatever else the task asked for: direction, speed and gait are all that a motion is judged by.
fn asked(motion: &Motion, field: &str) -> serde_json::Value {
    motion.provenance.task.get(field).cloned().unwrap_or_default()
}
