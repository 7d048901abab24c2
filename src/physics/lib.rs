//! A simulator of articulated characters: rigid-body dynamics, contact, joint limits and torque-limited
//! tracking are one linear complementarity problem each step.
//!
//! The modules stand in the order of the data: what the user drew, what can be simulated, in which scene,
//! how it moves.
//!
//! | room | what it holds |
//! |---|---|
//! | [`fault`] | what is wrong with an input, and where |
//! | [`character`] | what the user drew: URDF, JSON, zip → [`character::Character`] |
//! | [`model`] | what can be simulated: flat arrays over a kinematic tree |
//! | [`scene`] | ground, gravity, friction, effects, accuracy → [`scene::StepPlan`] |
//! | [`sim`] | the simulator |
//! | [`motion`] | keyframes, Hermite splines, the motion document |
//! | [`stance`] | a standing pose for any character, found and verified in the simulator |
//! | [`playback`] | a motion played in the simulator, sampled and judged |
//!
//! Units are SI, angles radians, frames right-handed with z up; quaternions in documents are
//! `[w, x, y, z]`.
//!
//! Reads a robot, lets it stand, and steps it (`examples/step.rs`):
#![doc = concat!("```no_run\n", include_str!("../../examples/step.rs"), "```")]

pub mod character;
pub mod fault;
pub mod model;
pub mod motion;
pub mod playback;
pub mod scene;
pub mod sim;
pub mod stance;
