//! Learns motion for articulated characters, judges it, and measures what accuracy costs.
//!
//! Everything here is computed with the simulator of [`gaitwright_physics`]; nothing here reads files, serves
//! requests or writes recordings.
//!
//! | module | what it holds |
//! |---|---|
//! | [`scenario`] | one simulation as a JSON document describes it, and its output line by line |
//! | [`gait`] | footfalls, phases, gait names and cost of transport of a simulated motion, and whether it is natural |
//! | [`check`] | a motion in one continuous simulation, judged, and under changed conditions |
//! | [`learn`] | QDSEGA: Q-learning in subsets of states that a genetic algorithm chooses |
//! | [`program`] | natural gaits: leg programs from force templates, refined by CMA-ES |
//! | [`training`] | what a task asks of a character, by the search that suits both: a repertoire of gaits, or one motion |
//! | [`study`] | the paper's open questions, and rival searches, on equal budgets |
//! | [`accuracy`] | computing time against error for integrators, solvers and steps; the setting to take for a tolerance; the hard cases and their bounds; rapier3d as the engine compared with |
//!
//! `learn` and `gait` know neither each other nor any of the rest; `accuracy` simulates scenarios.
//!
//! The same document and the same seed give the same result, bit for bit, whatever the number of threads. Only
//! computing times differ; a limit of seconds that ends or shapes a search makes the result depend on them, and the result says so
//! ([`learn::StopReason::Seconds`]).
//!
//! ```
//! use gaitwright_learning::accuracy::prepare;
//! use gaitwright_learning::scenario::{Line, NoFiles, Scenario, ScenarioEnd};
//!
//! // A ball of 10 cm falls from a height of 1 m for a tenth of a second.
//! let scenario = Scenario::parse(br#"{
//!     "character": { "json": { "format": "gaitwright/character@1", "name": "ball",
//!         "links": [{ "name": "ball", "density": 500, "shapes": [{ "kind": "sphere", "radius": 0.1 }] }] } },
//!     "start": { "root": { "position": [0, 0, 1], "orientation": [1, 0, 0, 0],
//!                          "linear_velocity": [0, 0, 0], "angular_velocity": [0, 0, 0] } },
//!     "duration": 0.1
//! }"#)?;
//! let mut height = f64::NAN;
//! let end = prepare(&scenario, &NoFiles)?.run(|line| {
//!     if let Line::Sample(sample) = line {
//!         height = sample.root.position[2];
//!     }
//!     true
//! });
//! assert_eq!(end, ScenarioEnd::Finished);
//! assert!((height - (1.0 - 0.5 * 9.81 * 0.1 * 0.1)).abs() < 0.002);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod accuracy;
pub mod check;
pub mod gait;
pub mod learn;
pub mod program;
pub mod scenario;
pub mod study;
pub mod training;
