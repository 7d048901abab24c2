//! What is handed back: the motion document and its forms for other programs, recordings, learning curves, diagrams.

mod bend;
mod course;
mod curve;
mod diagram;
mod formats;
mod front;
mod motion;
mod recording;
mod replay;

pub use course::course_diagram;
pub use curve::{Curve, CurveFormat};
pub use diagram::{DiagramError, gait_diagram};
pub use formats::{
    DEFAULT_FPS, EntryCertificate, ExportFormat, ExportOptions, Exported, LoopCertificate, Mended,
    MotionClip, MotionFrame, PoseChange, SampledMotion, StandingFoot, animation_name, export, export_pose,
    export_repertoire,
};
pub use front::front_diagram;
pub use motion::{Performance, motion};
pub use recording::{Recording, RecordingError, RecordingSubject};
pub use replay::Replay;
