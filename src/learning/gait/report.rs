//! The gait report.

use std::collections::BTreeMap;

use gaitwright_physics::motion::NaturalnessMeasure;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The measures of a gait, from the contact forces of a continuous simulation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GaitReport {
    /// Kind and version of the document.
    pub format: GaitFormat,
    /// Name of the gait, or `unclassified`; `null` for a number of legs whose gaits have no names.
    pub gait: Option<String>,
    /// Which of several gaits with the same name it is: `transverse` (the fore feet have the lead of the hind feet) or
    /// `rotary` (the other one) for a gallop.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// Mean circular distance of the phases to those of the nearest named gait, share of a stride.
    pub distance: Option<f64>,
    /// The same distance of the leg that fits least: what decides whether the gait has the name.
    #[serde(default)]
    pub greatest_distance: Option<f64>,
    /// Why the gait is `unclassified`; left out where it has a name, and for a number of legs whose gaits have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unnamed_because: Option<UnnamedBecause>,
    /// Whether the mean duty factor is at least or below one half; `null` without strides.
    pub regime: Option<Regime>,
    /// Time from a touch-down to the next of the same foot, s; `null` without strides.
    pub stride_period: Option<f64>,
    /// Least number of whole strides of any foot that steps.
    pub strides: u32,
    /// Supporting links, in the order of the legs' names.
    pub feet: Vec<Foot>,
    /// Pairs of a left and a right leg.
    pub pairs: Vec<Pair>,
    /// Share of the time in which nothing is on the ground, neither foot nor knee nor belly, 0 to 1.
    pub aerial_fraction: f64,
    /// Share of the time in which something else than a foot is on the ground, 0 to 1.
    #[serde(default)]
    pub scuffing: f64,
    /// How much strides differ from each other; `null` with fewer than two strides.
    pub spread: Option<Spread>,
    /// Mean speed of the centre of mass along the task's direction, m/s.
    pub speed: f64,
    /// Mean speed of the centre of mass across the task's direction, to the left, m/s.
    pub sideways_speed: f64,
    /// Whether the motion moves as animals do: whether every measure of `naturalness` holds.
    #[serde(default)]
    pub natural: bool,
    /// What `natural` was judged by, by the measure's name; empty where it was not judged.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub naturalness: BTreeMap<String, NaturalnessMeasure>,
    /// v² / (g h) with the horizontal speed v and the standing hip height h; `null` without gravity or
    /// legs.
    pub froude: Option<f64>,
    /// ∫ Σ |τ q̇| dt / (m g d) over the horizontal distance d; `null` where the character did not travel.
    pub cost_of_transport: Option<f64>,
    /// The same with positive work only: ∫ Σ max(τ q̇, 0) dt / (m g d).
    pub positive_cost_of_transport: Option<f64>,
    /// Mean tangential speed of the contacts, weighted by their normal force, m/s.
    pub stance_slip: f64,
    /// Standing height of the hips above the ground, m; `null` without legs.
    pub hip_height: Option<f64>,
    /// First and last time of the trace, s.
    pub span: [f64; 2],
    /// When the character fell, s, which ended the trace; left out where it stayed upright.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fell_at: Option<f64>,
}

/// The document's kind and version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub enum GaitFormat {
    /// The one described here.
    #[default]
    #[serde(rename = "gaitwright/gait@1")]
    V1,
}

/// Why a gait has no name although gaits of so many legs have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum UnnamedBecause {
    /// A leg never steps, or legs have no sides.
    NoSteps,
    /// There are fewer than two whole strides.
    TooFewStrides,
    /// Periods or phases differ by more than a sixteenth from stride to stride, or more than a tenth of the strides are
    /// stumbles.
    Irregular,
    /// A stride takes less than half of √(h / g), or a foot is lifted by less than a hundredth of the hip height h.
    Vibrating,
    /// A foot is on the ground for more than nine tenths of the stride.
    Shuffling,
    /// A leg stands for less than half as long as the legs do in the mean.
    Limping,
    /// A leg is too far from the nearest named gait.
    Phases,
}

/// Walking and running as distinguished by the duty factor (Hildebrand 1965).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Regime {
    /// Mean duty factor of at least one half.
    Walk,
    /// Mean duty factor below one half.
    Run,
}

/// The footfalls of a supporting link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Foot {
    /// Name of the link.
    pub link: String,
    /// Place of the leg: `LF`, `LH`, `RF`, `RH` on four legs; `null` where it has no side.
    pub leg: Option<String>,
    /// Duty factor: share of the stride in which it is on the ground, 0 to 1.
    pub duty_factor: f64,
    /// Touch-down after that of the reference foot, share of a stride, 0 up to 1; `null` for a foot
    /// that never steps. The reference foot is the first in the list that steps.
    pub phase: Option<f64>,
    /// Number of its whole strides.
    pub strides: u32,
    /// How high its lowest point is lifted over the ground in a swing, mean over the swings, m; `null` without a whole
    /// swing.
    #[serde(default)]
    pub clearance: Option<f64>,
    /// Beginning and end of every stance, s; the first and the last may be cut off by the span.
    pub stances: Vec<[f64; 2]>,
}

/// A left and a right leg at the same place along the body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pair {
    /// Name of the left link.
    pub left: String,
    /// Name of the right link.
    pub right: String,
    /// |φ_left − φ_right − ½| on the circle, share of a stride, 0 to ½; below 0.1 the gait is
    /// symmetrical in Hildebrand's sense.
    pub asymmetry: f64,
}

/// How much strides differ from each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Spread {
    /// Standard deviation of the stride period over its mean.
    pub period: f64,
    /// Greatest circular standard deviation of a foot's phase, share of a stride.
    pub phase: f64,
}
