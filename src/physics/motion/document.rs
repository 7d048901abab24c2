//! The motion document `gaitwright/motion@1`.
//!
//! With it and the character, a reader needs nothing else to play the motion back, in this
//! simulator or in another: `entry` leads from the standing pose into the loop, `keyframes` hold the
//! loop, both are joined by cubic Hermite splines, and `drive` holds the gains with which the joints are driven.

use std::collections::BTreeMap;

use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::metrics::Metrics;
use super::steering::Steering;
use crate::scene::{Accuracy, Decision, Effect, Gains, Scene};
use crate::sim::Root;

/// A motion of a character: keyframes of all its joints, and the loop among them.
///
/// SI units, radians, world frame with z up; quaternions are `[w, x, y, z]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Motion {
    /// Kind and version of the document.
    pub format: MotionFormat,
    /// Whose motion it is.
    pub character: CharacterRef,
    /// Names of the movable joints; every array over joints has their order.
    pub joints: Vec<String>,
    /// How a joint moves between two keyframes.
    pub interpolation: Interpolation,
    /// The motion, in order, the first at time 0, the last at the loop's end.
    pub keyframes: Vec<Keyframe>,
    /// Which part of `keyframes` is played over and over.
    #[serde(rename = "loop")]
    pub cycle: MotionLoop,
    /// From the standing pose, at rest at time 0, into `keyframes`: its last keyframe has the angles,
    /// velocities and root of the first of `keyframes`, where the motion goes on. Empty when the motion
    /// simply starts at its first keyframe.
    #[serde(default)]
    pub entry: Vec<Keyframe>,
    /// How the keyframes are changed by what the trunk does; none where the motion holds its course without.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering: Option<Steering>,
    /// How strongly the joints are driven toward the keyframes.
    pub drive: Gains,
    /// What was measured while the motion was played in a continuous simulation.
    pub metrics: Metrics,
    /// Ground, gravity, friction and effects the motion was made for.
    pub scene: Scene,
    /// How the motion came about.
    pub provenance: Provenance,
    /// The poses that the simulated character took over one cycle of the loop, densely sampled, for
    /// players without physics; the root as in `keyframes`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<Vec<SampledPose>>,
    /// When links carried weight over the cycle of `poses`; none where that is not told.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stances: Vec<StanceTime>,
}

/// A time in which a link stood on the ground.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StanceTime {
    /// Name of the link.
    pub link: String,
    /// Since the start of the cycle, s.
    pub start: f64,
    /// Since the start of the cycle, s; where the link stands on into the next cycle, the end of the cycle, and there is
    /// another stance that starts at 0.
    pub end: f64,
}

/// The document's kind and version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[schemars(rename = "Format")]
pub enum MotionFormat {
    /// The one described here.
    #[default]
    #[serde(rename = "gaitwright/motion@1")]
    V1,
}

/// A character, by name and content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CharacterRef {
    /// As its author named it.
    pub name: String,
    /// `sha256:…` of the file it was read from.
    pub digest: String,
}

/// How a joint moves between two keyframes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// The cubic with the keyframes' angles and velocities at its ends.
    #[default]
    CubicHermite,
}

/// Where every joint is asked to be, and where the root was, at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// s.
    pub time: f64,
    /// Target of every joint, rad (m for prismatic joints).
    pub angles: Vec<f64>,
    /// Rate of every target, rad/s (m/s).
    pub velocities: Vec<f64>,
    /// Motion of the root link as it came out of the simulation, up to `root_adjustment` of the metrics; it is
    /// not a target.
    pub root: RootMotion,
}

/// Position and motion of the root link's frame in the world frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RootMotion {
    /// Origin of the root link, m.
    pub position: [f64; 3],
    /// Unit quaternion `[w, x, y, z]`; upright where left out.
    #[serde(default = "upright")]
    pub orientation: [f64; 4],
    /// Velocity of the origin, m/s.
    #[serde(default)]
    pub linear_velocity: [f64; 3],
    /// rad/s.
    #[serde(default)]
    pub angular_velocity: [f64; 3],
}

fn upright() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

impl From<&Root> for RootMotion {
    fn from(root: &Root) -> Self {
        let q = root.orientation.quaternion();
        Self {
            position: root.position.coords.into(),
            orientation: [q.w, q.i, q.j, q.k],
            linear_velocity: root.linear_velocity.into(),
            angular_velocity: root.angular_velocity.into(),
        }
    }
}

impl From<&RootMotion> for Root {
    fn from(root: &RootMotion) -> Self {
        let [w, x, y, z] = root.orientation;
        Self {
            position: root.position.into(),
            orientation: UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)),
            linear_velocity: root.linear_velocity.into(),
            angular_velocity: root.angular_velocity.into(),
        }
    }
}

/// The part of `keyframes` that is played over and over.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Loop")]
pub struct MotionLoop {
    /// Time of the keyframe at which a cycle starts, s.
    pub start: f64,
    /// Time of the last keyframe, s. It equals the keyframe at `start` up to `root_advance`.
    pub end: f64,
    /// How far the root travels in one cycle.
    pub root_advance: RootAdvance,
}

/// The root's travel over one cycle of the loop.
///
/// With the root at position p₀ and orientation q₀ at the start of a cycle, its heading ψ₀ is the
/// angle about z of its x axis seen from above ([`RootMotion::heading`]), and at the end of the cycle
/// it is at p₀ + R_z(ψ₀) `translation` with the orientation R_z(`yaw`) q₀; its velocities in the
/// world frame are rotated by R_z(`yaw`) as well. The next cycle starts from there.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RootAdvance {
    /// Forward, left and up in the frame of the root's heading at the start of the cycle, m.
    pub translation: [f64; 3],
    /// Rotation to the left about the world's z axis, rad, in (−π, π].
    pub yaw: f64,
}

/// How a motion came about: with these figures the same program makes the same motion again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Provenance {
    /// The program that made it.
    pub program: String,
    /// Its version.
    pub version: String,
    /// Seed of the learner; `null` when nothing was left to chance.
    pub seed: Option<u64>,
    /// Parameters of the learner, as used.
    pub learning: Value,
    /// What was asked for.
    pub task: Value,
    /// How finely it was simulated.
    pub accuracy: Accuracy,
    /// Which effects were simulated, and why.
    pub effects: BTreeMap<Effect, Decision>,
}

/// The pose of the whole character at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Pose")]
pub struct SampledPose {
    /// Since the start of the cycle, s.
    pub time: f64,
    /// Angle of every joint, rad or m.
    pub angles: Vec<f64>,
    /// Where the root was.
    pub root: RootPose,
}

/// Position and orientation of the root link's frame in the world frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RootPose {
    /// Origin of the root link, m.
    pub position: [f64; 3],
    /// Unit quaternion `[w, x, y, z]`.
    pub orientation: [f64; 4],
}

impl RootMotion {
    /// The angle about the world's z axis of the root's x axis seen from above, rad, in (−π, π].
    pub fn heading(&self) -> f64 {
        let forward = rotation(self.orientation) * Vector3::x();
        forward.y.atan2(forward.x)
    }
}

impl RootAdvance {
    /// The travel that takes the root from `start` to `end`. Whatever tilt `end` has
    /// against `start` beyond the rotation about z is left out.
    pub fn between(start: &RootMotion, end: &RootMotion) -> Self {
        let heading = start.heading();
        let travel = Vector3::from(end.position) - Vector3::from(start.position);
        let yaw = end.heading() - heading;
        Self { translation: (about_z(-heading) * travel).into(), yaw: yaw.sin().atan2(yaw.cos()) }
    }

    /// Position and velocity of the root one cycle after `start`.
    pub fn apply(&self, start: &RootMotion) -> RootMotion {
        let rotated = about_z(self.yaw);
        let travel = about_z(start.heading()) * Vector3::from(self.translation);
        let q = UnitQuaternion::from_rotation_matrix(&rotated) * rotation(start.orientation);
        RootMotion {
            position: (Vector3::from(start.position) + travel).into(),
            orientation: [q.w, q.i, q.j, q.k],
            linear_velocity: (rotated * Vector3::from(start.linear_velocity)).into(),
            angular_velocity: (rotated * Vector3::from(start.angular_velocity)).into(),
        }
    }
}

/// The rotation of a document's quaternion `[w, x, y, z]`.
fn rotation([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

fn about_z(angle: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), angle)
}

impl Motion {
    /// The drive's gains with one entry for each of `joints`, in their order. A joint that the motion
    /// does not name gets neither spring nor damper.
    pub fn gains_for(&self, joints: &[String]) -> Gains {
        let own = |name: &String| self.joints.iter().position(|joint| joint == name);
        let pick = |values: &[f64], name: &String| own(name).and_then(|joint| values.get(joint)).copied();
        let limit =
            |name: &String| own(name).and_then(|joint| self.drive.max_torque.get(joint)).copied().flatten();
        Gains {
            stiffness: joints.iter().map(|name| pick(&self.drive.stiffness, name).unwrap_or(0.0)).collect(),
            damping: joints.iter().map(|name| pick(&self.drive.damping, name).unwrap_or(0.0)).collect(),
            max_torque: joints.iter().map(limit).collect(),
            feedforward: self.drive.feedforward,
            feedforward_period: self.drive.feedforward_period,
            offset: match self.drive.offset.is_empty() {
                true => Vec::new(),
                false => joints.iter().map(|name| pick(&self.drive.offset, name).unwrap_or(0.0)).collect(),
            },
        }
    }
}
