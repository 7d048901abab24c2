//! What a client asks for: the job document as it is posted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use uuid::Uuid;

use gaitwright_learning::learn::{Learning, Task};
use gaitwright_physics::fault::{Fault, InputError, Parts};
use gaitwright_physics::scene::{AskedAccuracy, Scene};

/// The format of a job document.
pub const FORMAT: &str = "gaitwright/job@1";

/// A job as posted: a character and what is wanted of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JobRequest {
    /// The character.
    pub character: CharacterChoice,
    /// What is wanted of it.
    #[serde(flatten)]
    pub settings: Settings,
}

/// Where a job's character comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CharacterChoice {
    /// A URDF document; meshes cannot be given this way.
    Urdf(String),
    /// A character document, see `/v1/schemas/character`.
    Json(serde_json::Map<String, serde_json::Value>),
    /// A character posted to `/v1/characters` before.
    Id(#[schemars(with = "String")] Uuid),
}

/// What is wanted of a character. Every field has a default that suits an unknown character.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Settings {
    /// The world and its effects.
    pub scene: Scene,
    /// What the motion is for.
    pub task: Task,
    /// Parameters of the learner.
    pub learning: Learning,
    /// How finely the scene is simulated: settings, or a tolerance for which they are chosen.
    pub accuracy: AskedAccuracy,
    /// Seed of everything that is drawn by chance.
    pub seed: u64,
}

impl JobRequest {
    /// Reads a job document.
    ///
    /// # Errors
    ///
    /// [`InputError::Malformed`] when `bytes` is not JSON, otherwise [`InputError::Impossible`] with the faults of
    /// every part.
    pub fn parse(bytes: &[u8]) -> Result<Self, InputError> {
        let mut parts = Parts::parse(bytes)?;
        let character = parts.require("character");
        let settings = Settings::take(&mut parts);
        let request = character.map(|character| Self { character, settings });
        parts.end(request, &["format", "character", "scene", "task", "learning", "accuracy", "seed"])
    }
}

impl Settings {
    /// Reads a job document without its character, which comes from elsewhere.
    ///
    /// # Errors
    ///
    /// As [`JobRequest::parse`].
    pub fn parse(bytes: &[u8]) -> Result<Self, InputError> {
        let mut parts = Parts::parse(bytes)?;
        let settings = Self::take(&mut parts);
        parts.end(Some(settings), &["format", "scene", "task", "learning", "accuracy", "seed"])
    }

    fn take(parts: &mut Parts) -> Self {
        parts.check_format(FORMAT);
        Self {
            scene: parts.take("scene").unwrap_or_default(),
            task: parts.take("task").unwrap_or_default(),
            learning: parts.take("learning").unwrap_or_default(),
            accuracy: parts.take("accuracy").unwrap_or_default(),
            seed: parts.take("seed").unwrap_or_default(),
        }
    }

    /// Everything impossible in what is wanted, with JSON pointers into the job document.
    pub fn faults(&self) -> Vec<Fault> {
        let parts = [
            ("/scene", self.scene.faults()),
            ("/task", self.task.faults()),
            ("/learning", self.learning.faults()),
            ("/accuracy", self.accuracy.faults()),
        ];
        let under = |(name, faults): (&'static str, Vec<Fault>)| {
            faults.into_iter().map(move |fault| fault.under(name))
        };
        parts.into_iter().flat_map(under).chain(self.learning.trunk.contradictions(&self.scene)).collect()
    }
}
