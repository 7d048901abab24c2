//! One simulation as a document describes it: character, scene, accuracy, drive and duration; and its output, line by
//! line.

mod document;
mod lines;
mod run;
mod script;
mod setup;

pub use document::{CharacterSource, InlineCharacter, JointStart, Scenario, ScenarioFormat, Start};
pub use lines::{ContactLine, JointLine, Line, SampleLine, Summary};
pub use run::{PreparedScenario, ScenarioEnd};
pub use script::Script;
pub use setup::{Files, NoFiles, ScenarioSetup};
