//! How a character is taught: gait by gait or by QDSEGA, and why.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use gaitwright_learning::gait::{Leg, Side};
use gaitwright_learning::learn::LearningSetup;
use gaitwright_learning::program::gaits::task_gaits;
use gaitwright_learning::program::legs::{LegChain, Legs};
use gaitwright_learning::program::no_gaits::NoGaits;
use gaitwright_learning::program::subject::Subject;
use gaitwright_physics::model::Model;

/// How a character is taught, as it stands and for a direction of travel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Teaching {
    /// The search.
    pub method: TeachingMethod,
    /// Its legs, left ones before right ones, front to back; none unless the method is `leg_programs`.
    pub legs: Vec<LegFinding>,
    /// The gaits that it can be taught, as a task names them.
    pub gaits: Vec<String>,
    /// Height of the hips above the ground, or what stands in for it in a body without legs, m: the h of the Froude number
    /// v² / (g h). `null` where the method is `qdsega`.
    pub hip_height: Option<f64>,
    /// Why it is taught by QDSEGA; `null` where it is not.
    pub because: Option<String>,
}

/// A search for motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TeachingMethod {
    /// Gait by gait, each a program of the legs.
    LegPrograms,
    /// Waves along a body without legs.
    Waves,
    /// QDSEGA, which finds one motion without a name.
    Qdsega,
}

/// A leg.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LegFinding {
    /// Side and row, as the footfall diagram calls it: `LF` is the left fore leg.
    pub name: String,
    /// The link that is its foot.
    pub foot: String,
    /// The joints that its gaits move, from the trunk outward, and behind them those that closed loops move along.
    pub joints: Vec<String>,
    /// Whether the foot stands beside the hip rather than below it.
    pub sprawled: bool,
}

impl Teaching {
    /// Of a character that has gaits, or none for the reason given.
    pub(super) fn of(subject: &Result<Subject, NoGaits>) -> Self {
        match subject {
            Ok(Subject { model, legs, .. }) => Self::gait_by_gait(model, legs),
            Err(none) => Self::by_qdsega(none.to_string()),
        }
    }

    /// Of a run about to learn.
    pub(super) fn of_setup(setup: &LearningSetup) -> Self {
        let LearningSetup { model, stance, scene, accuracy, task, parameters, .. } = setup;
        if parameters.gait_by_gait() {
            Self::of(&Subject::new(model, stance, scene, accuracy, task.direction))
        } else {
            Self::by_qdsega("the job's `learning` asks for it".to_owned())
        }
    }

    fn gait_by_gait(model: &Model, legs: &Legs) -> Self {
        Self {
            method: if legs.spine.is_some() { TeachingMethod::Waves } else { TeachingMethod::LegPrograms },
            legs: legs.legs.iter().map(|leg| leg_finding(model, leg, legs.rows())).collect(),
            gaits: task_gaits(legs).into_iter().map(str::to_owned).collect(),
            hip_height: Some(legs.hip_height),
            because: None,
        }
    }

    fn by_qdsega(because: String) -> Self {
        let (legs, gaits) = (Vec::new(), Vec::new());
        Self { method: TeachingMethod::Qdsega, legs, gaits, hip_height: None, because: Some(because) }
    }
}

/// In a sentence without its full stop.
impl fmt::Display for Teaching {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let gaits = self.gaits.join(", ");
        match (self.method, &self.because) {
            (TeachingMethod::LegPrograms, _) => {
                write!(f, "can be taught gait by gait on {} legs: {gaits}", self.legs.len())
            }
            (TeachingMethod::Waves, _) => write!(f, "can be taught waves of its body: {gaits}"),
            (TeachingMethod::Qdsega, Some(because)) => {
                write!(f, "is taught one motion by QDSEGA, because {because}")
            }
            (TeachingMethod::Qdsega, None) => f.write_str("is taught one motion by QDSEGA"),
        }
    }
}

fn leg_finding(model: &Model, leg: &LegChain, rows: usize) -> LegFinding {
    let side = if leg.left { Side::Left } else { Side::Right };
    LegFinding {
        name: Leg { side, row: leg.row, rows }.to_string(),
        foot: model.character.links[leg.links[0]].name.clone(),
        joints: leg.moved().map(|joint| model.joint_names[joint].clone()).collect(),
        sprawled: leg.sprawled,
    }
}
