//! Learning, what accuracy costs, and the hard cases.

mod accuracy;
#[path = "../common/bodies.rs"]
mod bodies;
#[path = "../common/mod.rs"]
mod common;
mod disturbance;
mod documents;
mod gait;
mod hard_cases;
mod learn;
mod loops;
mod program;
mod rapier;
mod refinement;
mod scenarios;
mod starts;
mod study;
#[path = "../common/synthetic.rs"]
mod synthetic;
#[path = "../common/tables.rs"]
mod tables;
mod training;
mod waves;
