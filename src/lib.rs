//! gaitwright learns physically valid motion for any articulated character.
//!
//! The modules stand in the order of the data: what the user drew, what can be simulated, its motion
//! in time, what was learned, what is handed back.
//!
//! | room | what it holds |
//! |---|---|
//! | [`fault`] | what is wrong with an input, and where |
//! | [`character`] | what the user drew: URDF, JSON, zip → [`character::Character`] |
//! | [`model`] | what can be simulated: flat arrays over a kinematic tree |
//! | [`scene`] | ground, gravity, friction, effects, accuracy → [`scene::StepPlan`] |
//! | [`motion`] | keyframes, Hermite splines, the motion document |
//! | [`sim`] | rigid-body dynamics, contact, limits and tracking as one LCP each step |
//! | [`stance`] | a standing pose for any character, found and proven in the simulator |
//! | [`playback`] | a motion or a behaviour played in the simulator, sampled and judged |
//! | [`scenario`] | one simulation as a document asks for it |
//! | [`gait`] | footfalls, phases, gait names, cost of transport |
//! | [`learn`] | QDSEGA over the simulator |
//! | [`accuracy`] | what accuracy costs, which setting to take for a tolerance, and the hard cases that must hold |
//! | [`export`] | recordings, curves, diagrams |
//! | [`jobs`] | jobs, their store, queue and workers |
//! | [`http`] | the REST service |
//!
//! Units are SI, angles radians, frames right-handed with z up; quaternions in documents are
//! `[w, x, y, z]`.

pub mod accuracy;
pub mod character;
pub mod export;
pub mod fault;
pub mod gait;
pub mod http;
pub mod jobs;
pub mod learn;
pub mod model;
pub mod motion;
pub mod playback;
pub mod scenario;
pub mod scene;
pub mod sim;
pub mod stance;
