//! One simulation as a document asks for it: who, where, how finely, driven by what, for how long; and
//! its result, line by line.

mod document;
mod lines;
mod run;

pub use document::{CharacterSource, InlineCharacter, JointStart, Scenario, Start};
pub use lines::{ContactLine, JointLine, Line, SampleLine, Summary};
pub use run::{Ended, Files, NoFiles, Prepared};
