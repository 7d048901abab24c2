//! Motion in time: keyframes joined by cubic Hermite splines, the player that turns them into
//! targets, and the motion document.

mod check;
mod document;
mod metrics;
mod player;
mod spline;

pub use document::{
    CharacterRef, Interpolation, Keyframe, Motion, MotionFormat, MotionLoop, Provenance, RootAdvance,
    RootMotion, RootPose, SampledPose,
};
pub use metrics::{MeasureLimit, Metrics, NaturalnessMeasure, RootAdjustment, Trial, Validity};
pub use player::Player;
pub use spline::{hermite, hermite_range, hermite_rate};
