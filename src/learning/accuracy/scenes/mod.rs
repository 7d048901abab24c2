//! Scenes whose motion is known exactly: each a scenario, its solution and its own measure of error.
//!
//! The solutions are independent of the simulator: formulas where there are some, otherwise the equations of
//! motion written down for the scene and integrated with a Runge-Kutta method whose error is at the level of
//! rounding.

mod ballistic;
mod block;
mod bounce;
mod closed_form;
mod double_pendulum;
mod elliptic;
mod ode;
mod pendulum;
mod rolling;
mod tumbling;

pub use closed_form::{ClosedForm, GRAVITY};
pub use elliptic::{Jacobi, arithmetic_geometric_mean};

/// Every scene.
pub const SCENES: [ClosedForm; 7] = [
    ballistic::SCENE,
    tumbling::SCENE,
    pendulum::SCENE,
    double_pendulum::SCENE,
    block::SCENE,
    rolling::SCENE,
    bounce::SCENE,
];

impl ClosedForm {
    /// The scene called `name`, if there is one.
    pub fn named(name: &str) -> Option<&'static Self> {
        SCENES.iter().find(|scene| scene.name == name)
    }
}
