//! The documents' words for scene, accuracy and drive, with their defaults.

mod accuracy;
mod drive;
mod ground;
mod obstacle;
mod world;

pub use accuracy::{Accuracy, Coordinates, FrictionCone, Integrator, JointBias, SolverChoice, SolverKind};
pub use drive::{DEFAULT_FEEDFORWARD_PERIOD, Drive, Feedforward, Gains, MaxTorque};
pub use ground::Ground;
pub use obstacle::Obstacle;
pub use world::{Effect, Scene, Switch};
