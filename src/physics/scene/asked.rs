//! How finely a document asks for a scene to be simulated: by settings, or by the error it accepts.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::units::usual_step;
use super::wire::{Accuracy, Coordinates, FrictionCone, Integrator, JointBias, SolverChoice};
use crate::fault::Fault;

/// How finely a scene is to be simulated. In documents either the fields of [`Accuracy`], or `tolerance` alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Fields", into = "Fields")]
#[schemars(with = "Fields")]
pub enum AskedAccuracy {
    /// With these settings.
    Settings(Accuracy),
    /// With these settings but for the step, which follows from the character's size ([`usual_step`]).
    StepBySize(Accuracy),
    /// With the cheapest settings whose error is at most this, m; they are chosen before the simulation.
    Tolerance(f64),
}

/// Why settings were chosen for a tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracyChoice {
    /// What was asked for, m.
    pub tolerance: f64,
    /// Mean error of the settings chosen, m.
    pub error: f64,
    /// How they were chosen.
    pub because: String,
}

/// How finely a scene is simulated: settings, or a tolerance for which they are chosen.
#[derive(Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "AskedAccuracy")]
struct Fields {
    /// Greatest error accepted, as the root mean square displacement of the bodies, m: the cheapest settings
    /// that keep it are chosen. No other field goes with it.
    #[serde(skip_serializing_if = "Option::is_none")]
    tolerance: Option<f64>,
    /// Time step, s; with `step_tolerance` the longest. Follows from the character's size where left out: 2 ms for the size of
    /// a dog.
    #[serde(skip_serializing_if = "Option::is_none")]
    step: Option<f64>,
    /// Greatest error that one step may add to a joint angle (rad), a joint position or the root's
    /// position (m): steps are divided until they keep it.
    #[serde(skip_serializing_if = "Option::is_none")]
    step_tolerance: Option<f64>,
    /// Method of integration.
    #[serde(skip_serializing_if = "Option::is_none")]
    integrator: Option<Integrator>,
    /// Solver of the complementarity problem.
    #[serde(skip_serializing_if = "Option::is_none")]
    solver: Option<SolverChoice>,
    /// Coordinates in which the character is simulated.
    #[serde(skip_serializing_if = "Option::is_none")]
    coordinates: Option<Coordinates>,
    /// What the rows of joints ask for: of all joints in maximal coordinates, of those that close loops in joint coordinates.
    #[serde(skip_serializing_if = "Option::is_none")]
    joint_bias: Option<JointBias>,
    /// Shape of the set of admissible friction forces.
    #[serde(skip_serializing_if = "Option::is_none")]
    friction_cone: Option<FrictionCone>,
}

impl Fields {
    /// Names of the settings given.
    fn settings(&self) -> Vec<&'static str> {
        let given = [
            ("`step`", self.step.is_some()),
            ("`step_tolerance`", self.step_tolerance.is_some()),
            ("`integrator`", self.integrator.is_some()),
            ("`solver`", self.solver.is_some()),
            ("`coordinates`", self.coordinates.is_some()),
            ("`joint_bias`", self.joint_bias.is_some()),
            ("`friction_cone`", self.friction_cone.is_some()),
        ];
        given.into_iter().filter_map(|(name, given)| given.then_some(name)).collect()
    }
}

impl AskedAccuracy {
    /// The shortest step that is chosen for a tolerance, as a share of the character's [usual one](usual_step).
    pub const FINEST: f64 = 0.125;

    /// The settings for a character of this `size` ([`Model::size`](crate::model::Model::size), m); `None` where they are to
    /// be chosen for a tolerance.
    pub fn settings(&self, size: f64) -> Option<Accuracy> {
        match *self {
            Self::Settings(accuracy) => Some(accuracy),
            Self::StepBySize(accuracy) => Some(Accuracy { step: usual_step(size), ..accuracy }),
            Self::Tolerance(_) => None,
        }
    }

    /// Everything impossible in what is asked for.
    pub fn faults(&self) -> Vec<Fault> {
        match self {
            Self::Settings(accuracy) | Self::StepBySize(accuracy) => accuracy.faults(),
            Self::Tolerance(tolerance) if *tolerance > 0.0 && tolerance.is_finite() => Vec::new(),
            Self::Tolerance(_) => {
                vec![Fault::new("/tolerance", "the tolerance must be a positive finite number")]
            }
        }
    }
}

impl Default for AskedAccuracy {
    fn default() -> Self {
        Self::StepBySize(Accuracy::default())
    }
}

impl From<Accuracy> for AskedAccuracy {
    fn from(accuracy: Accuracy) -> Self {
        Self::Settings(accuracy)
    }
}

impl TryFrom<Fields> for AskedAccuracy {
    type Error = String;

    fn try_from(fields: Fields) -> Result<Self, Self::Error> {
        if let Some(tolerance) = fields.tolerance {
            let settings = fields.settings();
            return if settings.is_empty() {
                Ok(Self::Tolerance(tolerance))
            } else {
                Err(format!(
                    "`tolerance` chooses the settings: give either it or the settings ({})",
                    settings.join(", ")
                ))
            };
        }
        let Fields {
            tolerance: _,
            step,
            step_tolerance,
            integrator,
            solver,
            coordinates,
            joint_bias,
            friction_cone,
        } = fields;
        let usual = Accuracy::default();
        let accuracy = Accuracy {
            step: step.unwrap_or(usual.step),
            step_tolerance: step_tolerance.or(usual.step_tolerance),
            integrator: integrator.unwrap_or(usual.integrator),
            solver: solver.unwrap_or(usual.solver),
            coordinates: coordinates.unwrap_or(usual.coordinates),
            joint_bias: joint_bias.unwrap_or(usual.joint_bias),
            friction_cone: friction_cone.unwrap_or(usual.friction_cone),
        };
        Ok(if step.is_some() { Self::Settings(accuracy) } else { Self::StepBySize(accuracy) })
    }
}

impl From<AskedAccuracy> for Fields {
    fn from(asked: AskedAccuracy) -> Self {
        let step = match asked {
            AskedAccuracy::Settings(accuracy) => Some(accuracy.step),
            AskedAccuracy::StepBySize(_) | AskedAccuracy::Tolerance(_) => None,
        };
        match asked {
            AskedAccuracy::Tolerance(tolerance) => Self { tolerance: Some(tolerance), ..Self::default() },
            AskedAccuracy::Settings(accuracy) | AskedAccuracy::StepBySize(accuracy) => Self {
                tolerance: None,
                step,
                step_tolerance: accuracy.step_tolerance,
                integrator: Some(accuracy.integrator),
                solver: Some(accuracy.solver),
                coordinates: Some(accuracy.coordinates),
                joint_bias: Some(accuracy.joint_bias),
                friction_cone: Some(accuracy.friction_cone),
            },
        }
    }
}
