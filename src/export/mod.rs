//! What is handed back: the motion document, recordings, learning curves, diagrams.

mod bend;
mod curve;
mod diagram;
mod front;
mod motion;
mod recording;

pub use curve::{Curve, CurveFormat};
pub use diagram::{DiagramError, gait_diagram};
pub use front::front_diagram;
pub use motion::{Performance, motion};
pub use recording::{Recording, RecordingError, RecordingSubject};
