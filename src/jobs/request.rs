//! What a client asks for: the job document as it is posted.

use std::borrow::Cow;
use std::ops::RangeInclusive;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
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
    /// Everything else.
    #[serde(flatten)]
    pub terms: JobTerms,
}

/// A job as posted, but for its character, which comes from elsewhere.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct JobTerms {
    /// What is wanted of the character.
    #[serde(flatten)]
    pub settings: Settings,
    /// Which of the jobs that wait come first.
    #[serde(default)]
    pub priority: Priority,
}

/// Which of the jobs that wait come first: -10 to 10, the greatest first. Among equals callers take turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(try_from = "i64")]
pub struct Priority(i64);

impl JsonSchema for Priority {
    fn schema_name() -> Cow<'static, str> {
        "Priority".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "Which of the jobs that wait come first: the greatest. Among equals callers take turns",
            "type": "integer", "minimum": PRIORITIES.start(), "maximum": PRIORITIES.end(),
        })
    }
}

/// Least and greatest priority.
const PRIORITIES: RangeInclusive<i64> = -10..=10;

/// A priority that there is not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{0} does not lie between {least} and {most}", least = PRIORITIES.start(), most = PRIORITIES.end())]
pub struct PriorityError(i64);

impl TryFrom<i64> for Priority {
    type Error = PriorityError;

    fn try_from(number: i64) -> Result<Self, PriorityError> {
        if PRIORITIES.contains(&number) { Ok(Self(number)) } else { Err(PriorityError(number)) }
    }
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

/// The fields of a job document but for its character.
const FIELDS: [&str; 7] = ["format", "scene", "task", "learning", "accuracy", "seed", "priority"];

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
        let terms = JobTerms::take(&mut parts);
        let impossible = terms.settings.faults();
        let request = character.map(|character| Self { character, terms });
        parts.end(request, &[&["character"], &FIELDS[..]].concat(), impossible)
    }
}

impl JobTerms {
    /// Reads a job document without its character.
    ///
    /// # Errors
    ///
    /// As [`JobRequest::parse`].
    pub fn parse(bytes: &[u8]) -> Result<Self, InputError> {
        let mut parts = Parts::parse(bytes)?;
        let terms = Self::take(&mut parts);
        let impossible = terms.settings.faults();
        parts.end(Some(terms), &FIELDS, impossible)
    }

    fn take(parts: &mut Parts) -> Self {
        parts.check_format(FORMAT);
        Self { settings: Settings::take(parts), priority: parts.take("priority").unwrap_or_default() }
    }
}

impl Settings {
    fn take(parts: &mut Parts) -> Self {
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
