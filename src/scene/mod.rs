//! Where and how a character is simulated: ground, gravity, effects, accuracy, drive; and what a
//! step must therefore compute ([`StepPlan`]).

mod plan;
mod wire;

pub use plan::{Decision, DrivePlan, StepPlan};
pub use wire::{
    Accuracy, Coordinates, Drive, Effect, Feedforward, FrictionCone, Gains, Ground, Integrator, JointBias,
    MaxTorque, Scene, SolverChoice, SolverKind, Switch,
};
