//! The scenario document.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::{Deserialize, Serialize};

use gaitwright_physics::character::LENGTH;
use gaitwright_physics::fault::{Fault, InputError, member};
use gaitwright_physics::motion::RootMotion;
use gaitwright_physics::scene::{Accuracy, AskedAccuracy, Drive, Scene};

/// A simulation to run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// `gaitwright/scenario@1`.
    #[serde(default)]
    pub format: ScenarioFormat,
    /// The character: a path, or inline.
    pub character: CharacterSource,
    /// Whether the root link is fixed to the world. It is fixed at the pose in `start`, and does not move.
    #[serde(default)]
    pub fixed_base: bool,
    /// The world around it.
    #[serde(default)]
    pub scene: Scene,
    /// How finely it is simulated.
    #[serde(default)]
    pub accuracy: AskedAccuracy,
    /// How it starts: in the standing pose where left out.
    #[serde(default)]
    pub start: Start,
    /// What moves its joints.
    #[serde(default)]
    pub drive: Drive,
    /// Simulated time, s.
    #[serde(default = "one")]
    pub duration: f64,
    /// Time between lines of output, s.
    #[serde(default = "hundredth")]
    pub sample_every: f64,
}

fn one() -> f64 {
    1.0
}

fn hundredth() -> f64 {
    0.01
}

/// The document's kind and version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum ScenarioFormat {
    /// The one described here.
    #[default]
    #[serde(rename = "gaitwright/scenario@1")]
    V1,
}

/// Where a character comes from.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum CharacterSource {
    /// Path of a URDF, JSON or zip file.
    Path(String),
    /// Inline.
    Inline(InlineCharacter),
}

/// A character within another document.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InlineCharacter {
    /// The text of a URDF.
    Urdf(String),
    /// A character document.
    Json(serde_json::Value),
    /// A zip of a URDF with its meshes, in Base64.
    Zip(String),
    /// The id of a character that was posted to a service, which the service replaces by that character.
    Id(String),
}

impl<'de> Deserialize<'de> for CharacterSource {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Source;

        impl<'de> Visitor<'de> for Source {
            type Value = CharacterSource;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a path, {\"urdf\": \"…\"}, {\"json\": {…}}, {\"zip\": \"…\"} or {\"id\": \"…\"}")
            }

            fn visit_str<E>(self, path: &str) -> Result<CharacterSource, E> {
                Ok(CharacterSource::Path(path.to_owned()))
            }

            fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<CharacterSource, A::Error> {
                let given = Inline::deserialize(MapAccessDeserializer::new(members))?;
                Ok(CharacterSource::Inline(match given {
                    Inline { urdf: Some(text), json: None, zip: None, id: None } => {
                        InlineCharacter::Urdf(text)
                    }
                    Inline { urdf: None, json: Some(document), zip: None, id: None } => {
                        InlineCharacter::Json(document)
                    }
                    Inline { urdf: None, json: None, zip: Some(archive), id: None } => {
                        InlineCharacter::Zip(archive)
                    }
                    Inline { urdf: None, json: None, zip: None, id: Some(id) } => InlineCharacter::Id(id),
                    _ => return Err(A::Error::custom("give one of `urdf`, `json`, `zip` and `id`")),
                }))
            }
        }

        deserializer.deserialize_any(Source)
    }
}

/// An [`InlineCharacter`] as it is read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Inline {
    urdf: Option<String>,
    json: Option<serde_json::Value>,
    zip: Option<String>,
    id: Option<String>,
}

/// The state in which a simulation starts.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Start {
    /// The root link; in the standing pose where left out. A root fixed to the world is then upright at the world's
    /// origin, whatever the ground there, since it need not stand.
    pub root: Option<RootMotion>,
    /// Joints by name; as in the standing pose, at rest, where left out, or where a loop determines them. A loop
    /// that is open although all of its joints are given is closed by moving them.
    pub joints: BTreeMap<String, JointStart>,
}

/// Angle and velocity of a joint at the start.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct JointStart {
    /// rad or m; as in the standing pose where left out.
    pub angle: Option<f64>,
    /// rad/s or m/s.
    pub velocity: f64,
}

/// Greatest number of steps in one simulation.
pub(super) const STEPS: f64 = 1e8;

impl Scenario {
    /// Reads a scenario.
    ///
    /// # Errors
    /// [`InputError::Malformed`] for what is not JSON, [`InputError::Impossible`] with a JSON pointer for
    /// unknown fields and for values that make no sense.
    pub fn parse(bytes: &[u8]) -> Result<Self, InputError> {
        gaitwright_physics::fault::from_json(bytes)
    }

    /// Every fault of the document that can be found without reading the character.
    pub fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        faults.extend(self.scene.faults().into_iter().map(|fault| fault.under("/scene")));
        faults.extend(self.accuracy.faults().into_iter().map(|fault| fault.under("/accuracy")));
        let mut positive = |name: &str, value: f64| {
            if !(value.is_finite() && value > 0.0) {
                faults.push(Fault::new(name, "must be a positive finite number of seconds"));
            }
        };
        positive("/duration", self.duration);
        positive("/sample_every", self.sample_every);
        let step = match &self.accuracy {
            AskedAccuracy::Settings(accuracy) | AskedAccuracy::StepBySize(accuracy) => accuracy.step,
            AskedAccuracy::Tolerance(_) => AskedAccuracy::FINEST * Accuracy::default().step,
        };
        if self.duration / step > STEPS {
            faults.push(Fault::new(
                "/duration",
                format!("the simulation would take more than {STEPS:e} steps"),
            ));
        }
        if let Some(root) = &self.start.root {
            let numbers = [&root.position[..], &root.linear_velocity, &root.angular_velocity].concat();
            if !numbers.iter().all(|number| number.abs() <= LENGTH) {
                let reason = format!("every number must be finite and within {LENGTH:e} m, m/s or rad/s");
                faults.push(Fault::new("/start/root", reason));
            }
            let length = root.orientation.iter().map(|part| part * part).sum::<f64>().sqrt();
            if (length - 1.0).abs() > 1e-3 || length.is_nan() {
                faults.push(Fault::new("/start/root/orientation", "must be a quaternion of unit length"));
            }
            let velocities = [("linear", root.linear_velocity), ("angular", root.angular_velocity)];
            for (kind, _) in
                velocities.iter().filter(|(_, velocity)| self.fixed_base && *velocity != [0.0; 3])
            {
                let reason = "must be zero: the root is bolted to the world, see `fixed_base`";
                faults.push(Fault::new(format!("/start/root/{kind}_velocity"), reason));
            }
        }
        for (name, joint) in &self.start.joints {
            if !(joint.angle.unwrap_or(0.0).abs() <= LENGTH && joint.velocity.abs() <= LENGTH) {
                let reason =
                    format!("every number must be finite and within {LENGTH:e} rad, m, rad/s or m/s");
                faults.push(Fault::new(member("/start/joints", name), reason));
            }
        }
        faults
    }
}
