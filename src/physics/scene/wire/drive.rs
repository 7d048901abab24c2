//! What moves the joints.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::de::{Deserializer, Error, Unexpected, Visitor};
use serde::{Deserialize, Serialize};

/// What moves the joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Drive {
    /// Passive joints.
    // With braces: of a variant without them any field is taken, and ignored.
    None {},
    /// Constant torques, within the character's greatest ones.
    Torque {
        /// N m (N for prismatic joints) by joint name; 0 where left out.
        #[serde(default)]
        joints: BTreeMap<String, f64>,
    },
    /// Constant velocities, held with whatever torque they require within the greatest one (Tokizaki & Hasegawa eq. 17).
    Velocity {
        /// Greatest torque of the actuators.
        #[serde(default)]
        max_torque: MaxTorque,
        /// Velocity, rad/s or m/s, by joint name; a joint left out is passive.
        #[serde(default)]
        joints: BTreeMap<String, f64>,
    },
    /// Fixed target angles.
    Hold {
        /// Spring K, N m/rad (N/m); suited to the character where left out.
        #[serde(default)]
        stiffness: Option<f64>,
        /// Damper D, N m s/rad (N s/m); suited to the character where left out.
        #[serde(default)]
        damping: Option<f64>,
        /// How the offset torque f₀ is found.
        #[serde(default)]
        feedforward: Feedforward,
        /// Time within which f₀ brings a joint to its target's velocity, s.
        #[serde(default = "feedforward_period")]
        feedforward_period: f64,
        /// Greatest torque of the actuators.
        #[serde(default)]
        max_torque: MaxTorque,
        /// Constant torque f₀ beside the spring, N m (N), by joint name; 0 where left out.
        #[serde(default)]
        offset: BTreeMap<String, f64>,
        /// Target angle, rad or m, by joint name; the standing pose where left out.
        #[serde(default)]
        joints: BTreeMap<String, f64>,
    },
    /// A motion, looped.
    Track {
        /// Spring K, N m/rad (N/m); that of the motion where left out.
        #[serde(default)]
        stiffness: Option<f64>,
        /// Damper D, N m s/rad (N s/m); that of the motion where left out.
        #[serde(default)]
        damping: Option<f64>,
        /// How the offset torque f₀ is found; as in the motion where left out.
        #[serde(default)]
        feedforward: Option<Feedforward>,
        /// Time within which f₀ brings a joint to its target's velocity, s; as in the motion where left out.
        #[serde(default)]
        feedforward_period: Option<f64>,
        /// Greatest torque of the actuators; as in the motion where left out.
        #[serde(default)]
        max_torque: Option<MaxTorque>,
        /// Constant torque f₀ beside the spring, N m (N), by joint name; as in the motion where left out.
        #[serde(default)]
        offset: BTreeMap<String, f64>,
        /// A motion document, or the path of one.
        motion: serde_json::Value,
    },
}

impl Default for Drive {
    fn default() -> Self {
        Self::None {}
    }
}

/// How strongly each joint is driven toward its target (Tokizaki & Hasegawa eq. 19), one entry a
/// joint of the model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Gains {
    /// Spring K, N m/rad (N/m).
    pub stiffness: Vec<f64>,
    /// Damper D, N m s/rad (N s/m).
    pub damping: Vec<f64>,
    /// Greatest torque, N m (N); `null` is unlimited.
    pub max_torque: Vec<Option<f64>>,
    /// How the offset torque f₀ is found.
    #[serde(default)]
    pub feedforward: Feedforward,
    /// Time within which f₀ brings a joint to its target's velocity, s (see [`DEFAULT_FEEDFORWARD_PERIOD`]).
    #[serde(default = "feedforward_period")]
    pub feedforward_period: f64,
    /// Constant torque beside spring and feedforward, N m (N); empty for none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub offset: Vec<f64>,
}

/// The feedforward's period where a document states none, s: the time within which the offset torque f₀ brings a joint to
/// its target's velocity. It does not depend on the step, so that the motion converges as the step falls.
pub const DEFAULT_FEEDFORWARD_PERIOD: f64 = 0.01;

fn feedforward_period() -> f64 {
    DEFAULT_FEEDFORWARD_PERIOD
}

impl Default for Gains {
    fn default() -> Self {
        Self {
            stiffness: Vec::new(),
            damping: Vec::new(),
            max_torque: Vec::new(),
            feedforward: Feedforward::default(),
            feedforward_period: DEFAULT_FEEDFORWARD_PERIOD,
            offset: Vec::new(),
        }
    }
}

/// How the offset torque f₀ of tracking is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Feedforward {
    /// f₀ = 0: spring and damper within the torque limit, as in a servo.
    #[default]
    None,
    /// The torque that would follow the target exactly if nothing touched the character.
    ContactFree,
    /// The torque that would follow the target exactly, contacts included.
    ContactAware,
}

/// Greatest torque of the actuators; in documents `"character"`, a number, or `null`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "MaxTorqueWord")]
#[schemars(with = "MaxTorqueWord")]
pub enum MaxTorque {
    /// The character's own effort limits.
    #[default]
    Character,
    /// The same limit for all joints, N m or N.
    All(f64),
    /// No limit.
    Unlimited,
}

/// The documents' spelling of [`MaxTorque`].
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum MaxTorqueWord {
    Number(f64),
    Word(CharacterWord),
    Null(()),
}

#[derive(Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum CharacterWord {
    Character,
}

impl<'de> Deserialize<'de> for MaxTorque {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Limit;

        impl Visitor<'_> for Limit {
            type Value = MaxTorque;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("\"character\", a number, or null")
            }

            fn visit_f64<E>(self, limit: f64) -> Result<MaxTorque, E> {
                Ok(MaxTorque::All(limit))
            }

            fn visit_u64<E>(self, limit: u64) -> Result<MaxTorque, E> {
                Ok(MaxTorque::All(limit as f64))
            }

            fn visit_i64<E>(self, limit: i64) -> Result<MaxTorque, E> {
                Ok(MaxTorque::All(limit as f64))
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<MaxTorque, E> {
                match word {
                    "character" => Ok(MaxTorque::Character),
                    _ => Err(E::invalid_value(Unexpected::Str(word), &self)),
                }
            }

            fn visit_unit<E>(self) -> Result<MaxTorque, E> {
                Ok(MaxTorque::Unlimited)
            }
        }

        deserializer.deserialize_any(Limit)
    }
}

impl From<MaxTorque> for MaxTorqueWord {
    fn from(limit: MaxTorque) -> Self {
        match limit {
            MaxTorque::All(limit) => Self::Number(limit),
            MaxTorque::Character => Self::Word(CharacterWord::Character),
            MaxTorque::Unlimited => Self::Null(()),
        }
    }
}
