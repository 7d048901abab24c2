//! Where and how a character is simulated: ground, gravity, effects, accuracy, drive; and what a
//! step must therefore compute ([`StepPlan`]).

mod actuator;
mod asked;
mod decision;
mod plan;
mod surfaces;
mod terrain;
mod units;
mod wire;

pub use actuator::ActuatorLimits;
pub use asked::{AccuracyChoice, AskedAccuracy};
pub use decision::Decision;
pub use plan::{DrivePlan, StepPlan, UNLIMITED};
pub use surfaces::{Grain, PairMaterial, Surfaces};
pub use terrain::{HeightField, Terrain};
pub(crate) use units::STANDARD_GRAVITY;
pub use units::{CharacterUnits, usual_step};
pub use wire::{
    Accuracy, Coordinates, DEFAULT_FEEDFORWARD_PERIOD, Drive, Effect, Feedforward, FrictionCone, Gains,
    Ground, Integrator, JointBias, MaxTorque, Obstacle, Scene, SolverChoice, SolverKind, Switch,
};
