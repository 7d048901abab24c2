//! The guide: how to use gaitwright, what it costs, where it ends, and how it is built.
//!
//! | page | about |
//! |---|---|
//! | [first steps](first_steps) | from a file to a motion that plays; how the learner works |
//! | [natural gaits](natural_gaits) | walks, trots and runs from leg programs, and how they do in MuJoCo |
//! | [study] | the paper's open questions, QDSEGA's repairs, and rival searches, measured |
//! | [judging] | the names of gaits, what makes a motion natural, and the trials |
//! | [characters] | URDF, JSON and zip; faults and repairs; loops and passive joints |
//! | [formats] | scenario, job, motion, recording |
//! | [exports] | glTF, BVH, CSV, ROS 2, MuJoCo: the motion in other programs |
//! | [service] | REST, curl, where jobs are kept |
//! | [machines] | servers and workers on several machines, over PostgreSQL and an object store |
//! | [accuracy] | how finely to simulate, and what it costs |
//! | [other engines](other_engines) | speed and accuracy beside MuJoCo and rapier3d |
//! | [effects] | what each part of the physics costs |
//! | [hard cases](hard_cases) | scenes in which simulators fail |
//! | [limits] | what is not simulated, or only roughly |
//! | [design] | the three crates and the way of the data through them |
//! | [contributing] | how tests, benches and CI are organised |
//!
//! The pages are Markdown files in `src/guide/`. Their Rust examples are tests of the documentation, and their shell commands
//! are tried by `tests/service/guide.rs`.

// rustdoc copies no pictures, so that the plots stand in the pages themselves.

#[doc = include_str!("first_steps.md")]
pub mod first_steps {}

#[doc = include_str!("natural_gaits.md")]
#[doc = include_str!("../../static/froude.svg")]
pub mod natural_gaits {}

#[doc = include_str!("study.md")]
#[doc = include_str!("../../static/study-rivals.svg")]
#[doc = include_str!("../../static/study-repairs.svg")]
pub mod study {}

#[doc = include_str!("judging.md")]
pub mod judging {}

#[doc = include_str!("characters.md")]
pub mod characters {}

#[doc = include_str!("formats.md")]
pub mod formats {}

#[doc = include_str!("exports.md")]
pub mod exports {}

#[doc = include_str!("service.md")]
#[doc = include_str!("../../static/page-character.svg")]
pub mod service {}

#[doc = include_str!("machines.md")]
pub mod machines {}

#[doc = include_str!("accuracy.md")]
#[doc = include_str!("../../static/accuracy-walk.svg")]
#[doc = include_str!("accuracy_exact.md")]
#[doc = include_str!("../../static/accuracy-double-pendulum.svg")]
#[doc = include_str!("../../static/accuracy-rolling-ball.svg")]
pub mod accuracy {}

#[doc = include_str!("other_engines.md")]
#[doc = include_str!("../../static/front-passive.svg")]
#[doc = include_str!("../../static/front-walk.svg")]
pub mod other_engines {}

#[doc = include_str!("effects.md")]
#[doc = include_str!("../../static/convergence.svg")]
pub mod effects {}

#[doc = include_str!("hard_cases.md")]
#[doc = include_str!("hard_cases_table.md")]
pub mod hard_cases {}

#[doc = include_str!("limits.md")]
pub mod limits {}

#[doc = include_str!("design.md")]
pub mod design {}

#[doc = include_str!("contributing.md")]
pub mod contributing {}
