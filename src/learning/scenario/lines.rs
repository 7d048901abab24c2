//! The lines of a simulation's output.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use gaitwright_physics::motion::RootMotion;
use gaitwright_physics::scene::{Accuracy, AccuracyChoice, Decision, Effect};
use gaitwright_physics::sim::StepRecord;

/// A line of output: samples, and a summary at the end.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Line {
    /// The state at one time.
    Sample(Box<SampleLine>),
    /// The end of the simulation.
    End {
        /// The figures of the whole simulation.
        summary: Box<Summary>,
    },
}

/// The state at one time.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SampleLine {
    /// s.
    pub time: f64,
    /// The root link.
    pub root: RootMotion,
    /// Joints by name.
    pub joints: BTreeMap<String, JointLine>,
    /// Centre of mass, world frame, m.
    pub center_of_mass: [f64; 3],
    /// Kinetic and potential energy, J.
    pub energy: EnergyLine,
    /// Linear momentum, kg m/s, and angular momentum about the centre of mass, kg m²/s.
    pub momentum: MomentumLine,
    /// Contacts of the last step.
    pub contacts: Vec<ContactLine>,
    /// Residual of the last step's complementarity problem, m/s or rad/s.
    pub residual: f64,
}

/// A joint at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct JointLine {
    /// rad or m.
    pub angle: f64,
    /// rad/s or m/s.
    pub velocity: f64,
    /// Mean torque of the actuator over the last step, N m; force along a joint that slides, N.
    pub torque: f64,
}

/// Energy, J.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct EnergyLine {
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Potential energy of gravity, J.
    pub potential: f64,
}

/// Momentum in the world frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct MomentumLine {
    /// kg m/s.
    pub linear: [f64; 3],
    /// About the centre of mass, kg m²/s.
    pub angular: [f64; 3],
}

/// A contact.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct ContactLine {
    /// The character's link.
    pub link: String,
    /// What it is in contact with: `ground`, an obstacle or another link, by name.
    pub other: String,
    /// Contact point, world frame, m.
    pub position: [f64; 3],
    /// Unit vector from the other body into the link, world frame.
    pub normal: [f64; 3],
    /// Force on the link, world frame, N.
    pub force: [f64; 3],
}

/// The figures of a whole simulation.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// `finished`; `finished, but …` with the number of steps left unsolved, if there are any; or `failed:` with cause, time and
    /// body.
    pub status: String,
    /// Number of steps computed.
    pub steps: u64,
    /// Computing time of the steps alone, s.
    pub step_seconds: f64,
    /// Simulated time, s.
    pub simulated_seconds: f64,
    /// Every effect, whether it was simulated, and why.
    pub effects: BTreeMap<Effect, Decision>,
    /// The settings used.
    pub accuracy: Accuracy,
    /// Why they were chosen, where the scenario gave a tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy_choice: Option<AccuracyChoice>,
    /// Greatest distance of a joint from its range of motion, or between its two bodies (of loops, and of all joints in
    /// maximal coordinates), rad or m.
    pub greatest_joint_error: f64,
    /// What the steps took, and what they left unsolved.
    #[serde(flatten)]
    pub record: StepRecord,
}
