//! `export`: a motion in the form that other programs open.

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use gaitwright::export::{
    DEFAULT_FPS, EntryCertificate, ExportFormat, ExportOptions, LoopCertificate, PoseChange, SampledMotion,
    StandingFoot, animation_name, export, export_repertoire,
};
use gaitwright_physics::character::Character;
use gaitwright_physics::fault::{Fault, InputError};
use gaitwright_physics::motion::Motion;

use super::failure::CommandError;
use super::input::{check_once, name, read, read_character, to_stdout};
use super::message::tell;

/// Writes a motion for another program: glTF binary, BVH, CSV, a ROS 2 JointTrajectory, or a MuJoCo model with
/// keyframes. The guide describes each.
#[derive(Debug, clap::Args)]
pub struct ExportCommand {
    /// Motion documents; `-` is standard input. Several, such as a whole repertoire, go into one glTF binary
    #[arg(required = true, value_name = "MOTION")]
    motions: Vec<PathBuf>,
    /// The character it was made for: URDF, character JSON, or zip
    #[arg(long)]
    character: PathBuf,
    /// What to write
    #[arg(long, value_parser = formats())]
    format: ExportFormat,
    /// Frames per second; the nearest rate at which the loop is a whole number of frames is used
    #[arg(long, default_value_t = DEFAULT_FPS, allow_negative_numbers = true)]
    fps: f64,
    /// Let the root stay where the loop starts instead of travelling
    #[arg(long)]
    in_place: bool,
    /// Where to write it; `-` is standard output
    #[arg(long)]
    out: PathBuf,
}

fn formats() -> impl TypedValueParser<Value = ExportFormat> {
    PossibleValuesParser::new(ExportFormat::ALL.map(ExportFormat::name))
        .try_map(|name| name.parse::<ExportFormat>())
}

impl ExportCommand {
    pub fn run(self) -> Result<(), CommandError> {
        let motions = self.motions.iter().map(|motion| ("MOTION", motion));
        check_once(motions.chain([("--character", &self.character)]))?;
        let reading = read_character(&self.character, false)?;
        let file = match self.motions.as_slice() {
            [motion] => self.one(motion, &reading.character)?,
            motions => self.several(motions, &reading.character)?,
        };
        if self.out.as_os_str() == "-" {
            return Ok(to_stdout(|out| out.write_all(&file))?);
        }
        std::fs::write(&self.out, file)
            .with_context(|| format!("{} cannot be written", self.out.display()))?;
        Ok(())
    }

    /// One motion in the form that was asked for.
    fn one(&self, path: &Path, character: &Character) -> Result<Vec<u8>, CommandError> {
        let motion = read_motion(path)?;
        let options = ExportOptions { fps: self.fps, in_place: self.in_place };
        let exported =
            export(&motion, character, self.format, &options).map_err(|error| refused(path, error))?;
        if let Some(certificate) = &exported.certificate {
            tell(format_args!("{}", adjustments(certificate)));
        }
        if motion.steering.is_some() && self.format.holds_targets() {
            tell(format_args!(
                "the motion is steered, which the format {} has no place for: by its targets alone it may fall or turn",
                self.format.name()
            ));
        }
        Ok(exported.file)
    }

    /// Several motions in one file, each called after its own.
    fn several(&self, paths: &[PathBuf], character: &Character) -> Result<Vec<u8>, CommandError> {
        if self.format != ExportFormat::Glb {
            let reason =
                format!("a file of the format {} holds one motion, of glb several", self.format.name());
            let error = InputError::impossible("", reason);
            return Err(CommandError::Input { name: "--format".to_owned(), error });
        }
        let sampled = paths.iter().map(|path| {
            let motion = read_motion(path)?;
            let sampled =
                SampledMotion::new(&motion, character, self.fps).map_err(|error| refused(path, error))?;
            let file = path.file_name().unwrap_or_default().to_string_lossy();
            Ok(sampled.named(animation_name(&file)))
        });
        let sampled = sampled.collect::<Result<Vec<_>, CommandError>>()?;
        let file = export_repertoire(&sampled, self.in_place).map_err(CommandError::input("the motions"))?;
        for SampledMotion { name, certificate, .. } in &sampled {
            tell(format_args!("{name}: {}", adjustments(certificate)));
        }
        Ok(file)
    }
}

fn read_motion(path: &Path) -> Result<Motion, CommandError> {
    Motion::parse(&read(path)?).map_err(CommandError::input(name(path)))
}

/// The error under the name of the motion's file, or of the option that is wrong.
fn refused(motion: &Path, error: InputError) -> CommandError {
    let place = match error.faults() {
        [Fault { pointer, .. }, ..] if pointer == "fps" => "--fps".to_owned(),
        [Fault { pointer, .. }, ..] if pointer == "in_place" => "--in-place".to_owned(),
        _ => name(motion),
    };
    CommandError::Input { name: place, error: without_option(error) }
}

/// What was adjusted, in a line.
fn adjustments(certificate: &LoopCertificate) -> String {
    let LoopCertificate { closed, held, feet, entry } = certificate;
    let mut text = format!("the loop was closed by at most {}", change(closed));
    if feet.is_empty() {
        return format!("{text}; the motion does not tell when its feet stand");
    }
    text += &standing(feet, held);
    let dragged: Vec<&str> = feet.iter().filter(|foot| !foot.held).map(|foot| &*foot.link).collect();
    if !dragged.is_empty() {
        text += &format!("; left as simulated, dragged or never lifted: {}", dragged.join(", "));
    }
    if let Some(EntryCertificate { joined, held, feet }) = entry {
        text +=
            &format!("; the entry was led to the loop by at most {}{}", change(joined), standing(feet, held));
    }
    text
}

fn change(change: &PoseChange) -> String {
    let PoseChange { angle, translation, rotation } = change;
    format!("{angle:.4} rad in a joint, {:.2} mm and {rotation:.4} rad at the root", 1e3 * translation)
}

/// How the feet that are held stand, and what that took.
fn standing(feet: &[StandingFoot], held: &PoseChange) -> String {
    let most = |figure: fn(&StandingFoot) -> f64| {
        1e3 * feet.iter().filter(|foot| foot.held).map(figure).fold(0.0, f64::max)
    };
    format!(
        "; standing feet slid by up to {:.2} mm a step and lay up to {:.2} mm off the ground, and are held to \
         {:.2} mm and {:.2} mm by at most {}",
        most(|foot| foot.slide.simulated),
        most(|foot| foot.gap.simulated),
        most(|foot| foot.slide.exported),
        most(|foot| foot.gap.exported),
        change(held),
    )
}

/// The error without the place of a fault that is an option.
fn without_option(error: InputError) -> InputError {
    match error.faults() {
        [fault] if ["fps", "in_place"].contains(&&*fault.pointer) => {
            InputError::impossible("", &*fault.reason)
        }
        _ => error,
    }
}
