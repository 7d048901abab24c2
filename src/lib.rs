//! gaitwright learns physically valid motion for any articulated character.
//!
//! The [`guide`] explains how to use it, what accuracy costs, and how it is built. Three crates, each knowing only
//! those before it:
//!
//! | crate | what it holds |
//! |---|---|
//! | [`gaitwright_physics`] | the character, its model, the scene, and the simulator |
//! | [`gaitwright_learning`] | scenarios, natural gaits and their judge, QDSEGA, training, the study, the price of accuracy |
//! | this one | recordings and files, jobs, the REST service, and the command line |
//!
//! | room of this crate | what it holds |
//! |---|---|
//! | [`export`] | motions for other programs, recordings, curves, diagrams |
//! | [`jobs`] | jobs, their store, queue and workers |
//! | [`http`] | the REST service |
//!
//! Units are SI, angles radians, frames right-handed with z up; quaternions in documents are
//! `[w, x, y, z]`.
//!
//! Learns a motion and saves it (`examples/train.rs`):
#![doc = concat!("```no_run\n", include_str!("../examples/train.rs"), "```")]

pub mod export;
pub mod guide;
pub mod http;
pub mod jobs;
