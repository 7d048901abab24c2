//! Motion in time: keyframes joined by cubic Hermite splines, the player that turns them into
//! targets, and the motion document.

mod check;
mod document;
mod player;
mod spline;

pub use document::{
    CharacterRef, Interpolation, Keyframe, Metrics, Motion, MotionFormat, MotionLoop, Provenance,
    RootAdjustment, RootAdvance, RootMotion, RootPose, SampledPose, Trial, Validity,
};
pub use player::Player;
pub use spline::{hermite, hermite_range, hermite_rate};
