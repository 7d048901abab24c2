//! A motion in the forms that other programs open.
//!
//! `sampled` turns the motion document and its character into evenly spaced frames, once for all formats; each
//! format is written by a file of its own from those frames.

mod bvh;
mod closing;
mod csv;
mod entry;
mod feet;
mod glb;
mod ground_travel;
mod mjcf;
mod ros;
mod sampled;
mod skeleton;
mod tessellation;
mod track;
mod unused;
mod up;

use std::collections::BTreeMap;
use std::str::FromStr;

use nalgebra::Isometry3;

use gaitwright_physics::character::Character;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::Motion;

use skeleton::Skeleton;

pub use closing::{EntryCertificate, LoopCertificate, PoseChange};
pub use feet::{Mended, StandingFoot};
pub use sampled::{MotionClip, MotionFrame, SampledMotion, animation_name};

/// Frames per second where no rate is asked for.
pub const DEFAULT_FPS: f64 = 60.0;

/// A form in which a motion is handed to other programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportFormat {
    /// glTF 2.0 binary: the character with its animations.
    Glb,
    /// Biovision hierarchy: the skeleton and one cycle of the loop.
    Bvh,
    /// Comma-separated values: root, angles and targets, a row a frame.
    Csv,
    /// ROS 2 `trajectory_msgs/JointTrajectory`, as YAML.
    Ros,
    /// A MuJoCo model with keyframes that hold poses and controls.
    Mujoco,
}

impl ExportFormat {
    /// All formats.
    pub const ALL: [Self; 5] = [Self::Glb, Self::Bvh, Self::Csv, Self::Ros, Self::Mujoco];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Glb => "glb",
            Self::Bvh => "bvh",
            Self::Csv => "csv",
            Self::Ros => "ros",
            Self::Mujoco => "mujoco",
        }
    }

    /// The extension of its files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Ros => "yaml",
            Self::Mujoco => "xml",
            Self::Glb | Self::Bvh | Self::Csv => self.name(),
        }
    }

    /// Whether its files hold targets. Those are of the plain motion: what its steering adds depends on the trunk and has no place in them.
    pub fn holds_targets(self) -> bool {
        matches!(self, Self::Csv | Self::Ros | Self::Mujoco)
    }

    /// The media type of its files.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Glb => "model/gltf-binary",
            Self::Bvh => "text/plain; charset=utf-8",
            Self::Csv => "text/csv; charset=utf-8",
            Self::Ros => "application/yaml",
            Self::Mujoco => "application/xml",
        }
    }
}

impl FromStr for ExportFormat {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|format| format.name() == name);
        found.ok_or_else(|| format!("unknown format \"{name}\", expected one of {}", names()))
    }
}

/// How a motion is exported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportOptions {
    /// Frames per second. The nearest rate at which a cycle of the loop is a whole number of frames is used.
    pub fps: f64,
    /// Whether the root stays where the loop starts instead of travelling.
    pub in_place: bool,
}

impl Default for ExportOptions {
    fn default() -> Self {
        Self { fps: DEFAULT_FPS, in_place: false }
    }
}

/// A motion in a format that other programs open.
#[derive(Debug, Clone, PartialEq)]
pub struct Exported {
    /// The file.
    pub file: Vec<u8>,
    /// What was adjusted in its poses; `None` in a format that holds targets alone.
    pub certificate: Option<LoopCertificate>,
}

/// Writes `motion` of `character` in a format that other programs open.
///
/// # Errors
///
/// [`InputError::Impossible`] when the motion was made for another character or is faulty, when the rate cannot be
/// used, and when the format cannot hold what is asked for.
pub fn export(
    motion: &Motion,
    character: &Character,
    format: ExportFormat,
    options: &ExportOptions,
) -> Result<Exported, InputError> {
    if options.in_place && matches!(format, ExportFormat::Ros | ExportFormat::Mujoco) {
        let reason =
            format!("the format {} holds no motion of the root that could stay in place", format.name());
        return Err(InputError::impossible("in_place", reason));
    }
    let sampled = SampledMotion::new(motion, character, options.fps)?;
    let file = match format {
        ExportFormat::Glb => glb::write(&sampled, &[], options.in_place)?,
        ExportFormat::Bvh => bvh::write(&sampled, options.in_place).into_bytes(),
        ExportFormat::Csv => csv::write(&sampled, options.in_place)?,
        ExportFormat::Ros => ros::write(&sampled).into_bytes(),
        ExportFormat::Mujoco => mjcf::write(&sampled, motion)?.into_bytes(),
    };
    let certificate = (format != ExportFormat::Ros).then_some(sampled.certificate);
    Ok(Exported { file, certificate })
}

/// Writes several motions of one character into one glTF binary, with the animations of each called after its name.
///
/// # Errors
///
/// [`InputError::Impossible`] when there is no motion, when two are of different characters or have the same name, and
/// when the file would be too large for its format.
pub fn export_repertoire(motions: &[SampledMotion<'_>], in_place: bool) -> Result<Vec<u8>, InputError> {
    let Some((first, others)) = motions.split_first() else {
        return Err(InputError::impossible("", "there is no motion to be exported"));
    };
    for (index, motion) in others.iter().enumerate() {
        if motion.skeleton.character.digest != first.skeleton.character.digest {
            return Err(InputError::impossible(&*motion.name, "the motion is of another character"));
        }
        if motions[..=index].iter().any(|before| before.name == motion.name) {
            return Err(InputError::impossible(&*motion.name, "two motions have this name"));
        }
    }
    glb::write(first, others, in_place)
}

/// Writes `character` without a motion as glTF binary: its root link at `root` over the ground, in the world frame, and
/// its joints at `angles` by their names, rad or m (0 where they are left out).
///
/// # Errors
///
/// [`InputError::Impossible`] when the file would be too large for its format.
pub fn export_pose(
    character: &Character,
    root: &Isometry3<f64>,
    angles: &BTreeMap<String, f64>,
) -> Result<Vec<u8>, InputError> {
    let skeleton = Skeleton::new(character);
    let angle = |name: &String| angles.get(name).copied().unwrap_or(0.0);
    let angles: Vec<f64> = skeleton.joints.iter().map(angle).collect();
    glb::write_pose(&skeleton, root, &angles)
}
