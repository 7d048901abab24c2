//! Joint coordinates on the kinematic tree: kinematics, articulated dynamics, response to forces.

// Indices run over several arrays at once here: bodies, their parents, triangular factors.
#![allow(clippy::needless_range_loop)]

pub mod articulated;
pub mod displaced;
pub mod flight;
pub mod kinematics;
pub mod response;
pub mod root;
pub(in crate::sim) mod stages;
pub mod trigonometry;
pub mod velocity_control;
