//! What was measured of a motion, and the limits that it is judged by.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What was measured over a continuous simulation of the motion.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Metrics {
    /// Mean speed along the task's direction, m/s.
    pub speed: f64,
    /// How long the character stayed upright, s.
    pub upright_seconds: f64,
    /// ∫ Σ |τ q̇| dt / (m g d), dimensionless; `null` when it got nowhere.
    pub cost_of_transport: Option<f64>,
    /// The same with positive work only, as it is measured of animals: ∫ Σ max(τ q̇, 0) dt / (m g d); `null` when it got
    /// nowhere.
    #[serde(default)]
    pub positive_cost_of_transport: Option<f64>,
    /// v² / (g l) with the standing hip height l, dimensionless; `null` without gravity or legs.
    pub froude: Option<f64>,
    /// Name of the gait, or `unclassified`; `null` for a number of legs whose gaits have no names.
    pub gait: Option<String>,
    /// Share of the stride that each supporting link spends on the ground, 0 to 1.
    pub duty_factors: BTreeMap<String, f64>,
    /// Time from a touch-down to the next of the same foot, s; `null` without strides.
    #[serde(default)]
    pub stride_period: Option<f64>,
    /// Whether the motion moves as animals do: whether every measure of `naturalness` holds.
    #[serde(default)]
    pub natural: bool,
    /// What `natural` was judged by, by the measure's name. Measures that do not apply to the character or its gait are
    /// left out; it is empty where the motion was not judged.
    #[serde(default)]
    pub naturalness: BTreeMap<String, NaturalnessMeasure>,
    /// Whether the motion is physically valid.
    pub validity: Validity,
}

/// How well a simulated motion keeps to what is physically possible.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Validity {
    /// Whether the check holds: the character stayed upright to its end, no step failed, and every step's complementarity
    /// problem was solved (`unsolved_steps` is 0). False in documents that do not say.
    #[serde(default)]
    pub valid: bool,
    /// Share of all samples of all joints whose torque is at its greatest, 0 to 1.
    pub torque_saturation: f64,
    /// Greatest excursion beyond the end of a joint's range of motion, rad or m.
    pub greatest_limit_violation: f64,
    /// Greatest depth of penetration at a contact, m, from the standing pose on.
    pub greatest_penetration: f64,
    /// Greatest residual of a step's complementarity problem, m/s or rad/s; this and the counts below are of all steps from
    /// the standing pose on.
    #[serde(default)]
    pub greatest_residual: f64,
    /// Steps that went on with forces that do not solve their complementarity problem.
    #[serde(default)]
    pub unsolved_steps: u64,
    /// Steps that were divided into substeps.
    #[serde(default)]
    pub divided_steps: u64,
    /// Divided steps in which the shortest substep allowed still created energy, drove a contact in, or missed the error tolerance.
    #[serde(default)]
    pub coarse_steps: u64,
    /// Greatest number of substeps of a step.
    #[serde(default)]
    pub greatest_substeps: u64,
    /// Mean speed along the ground of the contacts that carry the character, weighted by their
    /// normal force, m/s.
    pub foot_slip: f64,
    /// Root mean square of actual less target angle over all joints and samples, rad or m.
    pub tracking_error: f64,
    /// The most by which the root of the keyframes and poses differs from the simulated one, so that the loop
    /// closes and the entry ends where it starts. All other figures are those of the simulation.
    #[serde(default)]
    pub root_adjustment: RootAdjustment,
    /// Whole cycles of the loop for which the character stayed upright.
    pub upright_cycles: u32,
    /// How long it stayed upright when something was changed.
    #[serde(default)]
    pub trials: Vec<Trial>,
}

/// By how much the path of the root was changed.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RootAdjustment {
    /// m.
    pub translation: f64,
    /// rad.
    pub rotation: f64,
}

impl RootAdjustment {
    /// The greater of both in either.
    pub fn max(self, other: Self) -> Self {
        Self {
            translation: self.translation.max(other.translation),
            rotation: self.rotation.max(other.rotation),
        }
    }
}

/// The same motion under a changed condition.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Trial {
    /// What was changed, in words: `friction times 0.6`, `sideways push of 2 N s at 10.0 s`.
    pub change: String,
    /// How long the character stayed upright, s.
    pub upright_seconds: f64,
    /// Mean speed along the task's direction from the start of the loop on, as long as it stayed upright, m/s.
    #[serde(default)]
    pub speed: f64,
    /// That speed over the undisturbed one in the same time; `null` where that is 0 or the trial fell before the loop.
    #[serde(default)]
    pub relative_speed: Option<f64>,
    /// By how much that may differ from 1.
    #[serde(default = "Trial::usual_tolerance")]
    pub tolerance: f64,
    /// How long the trial lasted, s.
    pub of_seconds: f64,
}

impl Trial {
    /// By what share a change of the character or its world may change the speed.
    pub fn usual_tolerance() -> f64 {
        0.2
    }

    /// Whether the character stayed upright to the end, but for the rounding of the time.
    pub fn stood(&self) -> bool {
        self.upright_seconds >= 0.99 * self.of_seconds
    }

    /// Whether it stayed upright to the end and kept its speed to within the tolerance: whoever turns aside does not.
    pub fn kept(&self) -> bool {
        self.stood() && self.relative_speed.is_some_and(|share| (share - 1.0).abs() <= self.tolerance)
    }
}

/// One of the measures by which a motion is natural or not.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NaturalnessMeasure {
    /// What was measured, in the unit of its limit.
    pub value: f64,
    /// What it may be.
    pub limit: MeasureLimit,
    /// Whether it keeps to the limit.
    pub holds: bool,
}

/// What a measure may be, limits included: in JSON a number, which is the greatest value, or `[least, greatest]`, either of
/// which may be `null` for none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum MeasureLimit {
    /// The greatest value.
    AtMost(f64),
    /// The least and the greatest value.
    Between([Option<f64>; 2]),
}

impl MeasureLimit {
    /// A range.
    pub fn within([least, greatest]: [f64; 2]) -> Self {
        Self::Between([Some(least), Some(greatest)])
    }

    /// No less than `least`.
    pub fn at_least(least: f64) -> Self {
        Self::Between([Some(least), None])
    }

    /// How far `value` lies beyond the limit, in its unit: positive outside, 0 at the limit, negative inside.
    pub fn excess(self, value: f64) -> f64 {
        match self {
            Self::AtMost(greatest) => value - greatest,
            Self::Between([least, greatest]) => {
                let under = least.map_or(f64::NEG_INFINITY, |least| least - value);
                let over = greatest.map_or(f64::NEG_INFINITY, |greatest| value - greatest);
                under.max(over)
            }
        }
    }

    /// `value` judged by this limit. What is not a number does not hold.
    pub fn judge(self, value: f64) -> NaturalnessMeasure {
        NaturalnessMeasure { value, limit: self, holds: self.excess(value) <= 0.0 }
    }
}
