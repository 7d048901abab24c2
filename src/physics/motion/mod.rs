//! Motion in time: keyframes joined by cubic Hermite splines, the player that turns them into
//! targets, the limits that those keep, and the motion document.

mod check;
mod direction;
mod document;
mod limits;
mod metrics;
mod player;
mod playing;
mod shape;
mod spline;
mod steering;
mod steering_limits;

pub use direction::{ahead, ahead_in_plane};
pub use document::{
    CharacterRef, Interpolation, Keyframe, Motion, MotionFormat, MotionLoop, Provenance, RootAdvance,
    RootMotion, RootPose, SampledPose, StanceTime,
};
pub use limits::TargetLimits;
pub use metrics::{MeasureLimit, Metrics, NaturalnessMeasure, RootAdjustment, Trial, Validity};
pub use player::Player;
pub use playing::Playing;
pub use shape::shape;
pub use spline::{hermite, hermite_range, hermite_rate, hermite_rate_range};
pub use steering::{KeyframeChange, Steering, SteeringTable, TrunkMeasure};
