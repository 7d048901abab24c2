//! Joint coordinates on the kinematic tree: kinematics, articulated dynamics, response to forces.

pub mod articulated;
pub mod kinematics;
pub mod response;
pub mod root;
pub mod velocity_control;
