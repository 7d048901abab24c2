//! Learns motion for articulated characters, judges it, and measures what accuracy costs.
//!
//! | room | what it holds |
//! |---|---|
//! | [`scenario`] | one simulation as a document asks for it |
//! | [`gait`] | footfalls, phases, gait names, cost of transport |
//! | [`learn`] | QDSEGA over the simulator |
//! | [`program`] | natural gaits from leg programs |
//! | [`accuracy`] | what accuracy costs, which setting to take for a tolerance, the hard cases that must hold, and rapier3d as the engine compared with |

pub mod accuracy;
pub mod gait;
pub mod learn;
pub mod program;
pub mod scenario;
