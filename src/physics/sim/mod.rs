//! The simulator: articulated bodies, contact, joint limits and torque-limited tracking as one
//! linear complementarity problem each step.
//!
//! A [`Simulator`] is a model, a step plan, a state and a workspace; a step is a function of the four
//! ([`Simulator::step`]; the stages are listed by name in `step.rs`). It allocates nothing once it is warm.
//!
//! Its kernels are free functions that are compiled for AVX2 as well, and the processor decides at run time
//! (`multiversion`). Helpers that would not be compiled along with them by themselves are `inline(always)`. A product and
//! a sum are never fused, so that a kernel gives the same bits with AVX2 as without.

pub(crate) mod actuator;
pub mod bodies;
mod command;
pub mod contact;
mod convergence;
pub mod coordinates;
mod diagnostics;
mod energy;
mod failure;
mod integrate;
pub(crate) mod joint_friction;
mod joint_load;
pub mod lcp;
mod memory;
mod momentum;
pub mod per_body;
mod restitution;
pub mod root_freedom;
pub mod rows;
mod simulator;
pub mod spatial;
mod state;
mod step;
mod step_control;
mod step_data;
mod step_record;
mod step_totals;
mod substeps;
pub mod tracking;
mod workspace;

pub use command::Command;
pub use contact::Contact;
pub use diagnostics::{center_of_mass, energy, link_poses, momentum};
pub use energy::Energy;
pub use failure::{Failure, FailureCause, check_finite};
pub use momentum::Momentum;
pub use simulator::Simulator;
pub use state::{Root, State};
pub use step_record::StepRecord;
