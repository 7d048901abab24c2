//! A motion as evenly spaced frames, the same for every format.

use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::closing::{LoopCertificate, closed, entering, flattened, level, rotation_of, standing};
use super::entry;
use super::ground_travel::GroundTravel;
use super::skeleton::Skeleton;
use super::track::{Knot, Track};
use gaitwright_learning::gait::UNCLASSIFIED;
use gaitwright_physics::character::Character;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::{Keyframe, Motion, Player, RootMotion, TargetLimits};

/// Frames per second that are taken.
const RATES: std::ops::RangeInclusive<f64> = 1.0..=1000.0;

/// Most numbers of all frames together: angle, target and rate of every joint, and the root.
const MOST_NUMBERS: f64 = 5e6;

/// What the animations of a motion are called that has no name.
const UNNAMED: &str = "motion";

/// The whole character at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionFrame {
    /// Since the start of the clip, s.
    pub time: f64,
    /// Angle of every joint, rad or m: that of the simulated pose where the document holds poses, else the target.
    pub angles: Vec<f64>,
    /// Target of every joint, rad or m.
    pub targets: Vec<f64>,
    /// Rate of every target, rad/s or m/s.
    pub target_rates: Vec<f64>,
    /// The frame that travels evenly over the ground, in the world frame; at rest in the entry.
    pub travel: Isometry3<f64>,
    /// The root link in the travelling frame. In the loop, the last frame's is the first's.
    pub root: Isometry3<f64>,
}

impl MotionFrame {
    /// The root link in the world frame, or where it would be without travel.
    pub fn placed_root(&self, in_place: bool) -> Isometry3<f64> {
        if in_place { self.root } else { self.travel * self.root }
    }
}

/// A stretch of motion: frames from time 0 on, evenly spaced, the first and the last at its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionClip {
    /// At least two.
    pub frames: Vec<MotionFrame>,
}

impl MotionClip {
    /// Time between two frames, s.
    pub fn interval(&self) -> f64 {
        self.duration() / (self.frames.len() - 1) as f64
    }

    /// s.
    pub fn duration(&self) -> f64 {
        self.frames[self.frames.len() - 1].time
    }
}

/// A motion and its character, sampled.
///
/// The loop is closed: seen from the travelling frame, its last frame equals its first bit by bit, and the curve that
/// the frames are taken from has one rate there. The entry ends in the loop's first frame. Where the document tells when
/// its feet stand they stand still. What has to be adjusted for this stands in [`SampledMotion::certificate`].
#[derive(Debug, Clone)]
pub struct SampledMotion<'a> {
    pub(super) skeleton: Skeleton<'a>,
    /// From the standing pose to the loop, where the motion has an entry.
    pub entry: Option<MotionClip>,
    /// One cycle of the loop.
    pub cycle: MotionClip,
    /// What animations are named after: the gait, or `motion` where that has no name.
    pub name: String,
    /// What was adjusted, and how well the loop stands.
    pub certificate: LoopCertificate,
}

impl<'a> SampledMotion<'a> {
    /// Samples a motion `fps` times a second, or as nearly so as gives the entry and the loop whole numbers of frames.
    ///
    /// # Errors
    ///
    /// [`InputError::Impossible`] when the motion is faulty or not of this character, and for a rate that is out of
    /// range.
    pub fn new(motion: &Motion, character: &'a Character, fps: f64) -> Result<Self, InputError> {
        if !character.has_digest(&motion.character.digest) {
            let reason = format!(
                "the motion was made for \"{}\" ({}), not for this character ({})",
                motion.character.name, motion.character.digest, character.digest
            );
            return Err(InputError::impossible("/character", reason));
        }
        let skeleton = Skeleton::new(character);
        // It finds everything that is wrong with the document, and with its joints for this character.
        Player::new(motion, &skeleton.joints, &TargetLimits::of(character))?;
        check_size(motion, skeleton.joints.len(), fps)?;
        let order: Vec<usize> = skeleton
            .joints
            .iter()
            .filter_map(|name| motion.joints.iter().position(|own| own == name))
            .collect();

        let (lead, cycle) = split(motion);
        let start = cycle[0].time;
        let period = motion.cycle.end - start;
        let travel = GroundTravel::new(&cycle[0].root, &motion.cycle.root_advance, period);
        let targets = target_track(&cycle, start, &order);
        let (poses, mut certificate) = match motion.poses.as_deref() {
            Some(poses) if poses.len() > 2 && poses[poses.len() - 1].time > 0.0 => {
                let samples = poses.iter().map(|pose| {
                    let root = isometry(pose.root.position, pose.root.orientation);
                    (pose.time, flattened(&pose.angles, &order, &(travel.frame(pose.time).inverse() * root)))
                });
                standing(motion, (&skeleton, &travel), closed(samples.collect()))
            }
            _ => (keyframe_track(&cycle, start, &order, Some(&travel)), LoopCertificate::default()),
        };
        let joints = order.len();
        let mut cycle = clip(&poses, &targets, joints, period, fps, |time| travel.frame(time));
        let first = cycle.frames[0].clone();
        if let Some(last) = cycle.frames.last_mut() {
            *last = MotionFrame { time: last.time, travel: last.travel, ..first };
        }
        let entry = if lead.is_empty() {
            None
        } else {
            let targets = target_track(&lead, 0.0, &order);
            let played = if certificate.feet.is_empty() {
                None
            } else {
                entry::played(motion, &skeleton, level(motion))?
            };
            let track = match played {
                Some((samples, stances)) => {
                    let of_loop = (&*poses.first().values, &*certificate.feet);
                    let (track, entering) = entering(motion, &skeleton, (samples, &stances), of_loop);
                    certificate.entry = Some(entering);
                    track
                }
                None => target_entry(&lead, &order, poses.first()),
            };
            let duration = track.duration();
            let mut clip = clip(&track, &targets, joints, duration, fps, |_| Isometry3::identity());
            if let (Some(last), Some(first)) = (clip.frames.last_mut(), cycle.frames.first()) {
                *last = MotionFrame { time: last.time, ..first.clone() };
            }
            Some(clip)
        };
        let gait = motion.metrics.gait.as_deref().filter(|gait| *gait != UNCLASSIFIED);
        let name = gait.unwrap_or(UNNAMED).to_owned();
        Ok(Self { skeleton, entry, cycle, name, certificate })
    }

    /// The same, with its animations called after `name`.
    #[must_use]
    pub fn named(self, name: String) -> Self {
        Self { name, ..self }
    }

    /// Names of the joints in the order of the frames' angles.
    pub fn joints(&self) -> &[String] {
        &self.skeleton.joints
    }

    /// Frames of all links of the character, in their order, in the world frame or without the travel.
    pub fn link_poses(&self, frame: &MotionFrame, in_place: bool) -> Vec<Isometry3<f64>> {
        self.skeleton.poses(&frame.placed_root(in_place), &frame.angles)
    }
}

/// What the animations of a motion are called after the name of its file: those of `3-running-trot.json`, the third of a
/// repertoire, `running_trot`.
pub fn animation_name(file: &str) -> String {
    let stem = file.split('.').next().unwrap_or_default();
    let words: Vec<&str> =
        stem.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    match words.as_slice() {
        [number, name @ ..] if !name.is_empty() && number.parse::<u32>().is_ok() => name.join("_"),
        [] => UNNAMED.to_owned(),
        name => name.join("_"),
    }
}

/// Refuses a rate that is out of range, or at which there would be too much to write.
fn check_size(motion: &Motion, joints: usize, fps: f64) -> Result<(), InputError> {
    let refused = |reason| Err(InputError::impossible("fps", reason));
    if !RATES.contains(&fps) {
        let (least, most) = (RATES.start(), RATES.end());
        return refused(format!("{fps} frames a second; from {least} to {most} are possible"));
    }
    let seconds = motion.cycle.end + motion.entry.last().map_or(0.0, |keyframe| keyframe.time);
    let numbers = (3 * joints + 7) as f64;
    if fps * seconds * numbers > MOST_NUMBERS {
        return refused(format!(
            "{fps} frames a second for {seconds:.1} s, of {joints} joints each, are {:.0} numbers, and {MOST_NUMBERS:.0} \
             can be exported: at most {:.1} frames a second",
            fps * seconds * numbers,
            MOST_NUMBERS / (seconds * numbers),
        ));
    }
    Ok(())
}

/// The keyframes before the loop, the loop's first included (none where the motion starts in its loop), and those of
/// the loop.
fn split(motion: &Motion) -> (Vec<Keyframe>, Vec<Keyframe>) {
    let first = motion.keyframes.iter().position(|keyframe| keyframe.time == motion.cycle.start).unwrap_or(0);
    let (before, cycle) = motion.keyframes.split_at(first);
    let offset = motion.entry.last().map_or(0.0, |keyframe| keyframe.time);
    let entry = motion.entry.iter().take(motion.entry.len().saturating_sub(1)).cloned();
    let moved = |keyframe: &Keyframe| Keyframe { time: offset + keyframe.time, ..keyframe.clone() };
    let mut lead: Vec<Keyframe> = entry.chain(before.iter().map(moved)).collect();
    if !lead.is_empty() {
        lead.push(moved(&cycle[0]));
    }
    (lead, cycle.to_vec())
}

/// The targets over keyframes, from `start` on.
fn target_track(keyframes: &[Keyframe], start: f64, order: &[usize]) -> Track {
    let knot = |keyframe: &Keyframe| Knot {
        time: keyframe.time - start,
        values: order.iter().map(|&joint| keyframe.angles[joint]).collect(),
        rates: order.iter().map(|&joint| keyframe.velocities[joint]).collect(),
    };
    Track::new(keyframes.iter().map(knot).collect())
}

/// Angles and root over the keyframes of an entry that is known by its targets alone: its last stretch leads to `first`, where the
/// loop really starts.
fn target_entry(lead: &[Keyframe], order: &[usize], first: &Knot) -> Track {
    let joints = order.len();
    let mut knots = keyframe_knots(lead, 0.0, order, None);
    if let Some(last) = knots.last_mut() {
        let time = last.time;
        let mut end = first.clone();
        let (root, first) = (rotation_of(&last.values, joints), rotation_of(&end.values, joints));
        if root.dot(&first) < 0.0 {
            end.values[joints + 3..].iter_mut().for_each(|q| *q = -*q);
            end.rates[joints + 3..].iter_mut().for_each(|q| *q = -*q);
        }
        *last = Knot { time, ..end };
    }
    Track::new(knots)
}

/// Angles and root over the keyframes of a loop, whose last one is made the first seen from the travelling frame.
fn keyframe_track(
    keyframes: &[Keyframe],
    start: f64,
    order: &[usize],
    travel: Option<&GroundTravel>,
) -> Track {
    let mut knots = keyframe_knots(keyframes, start, order, travel);
    let first = knots[0].clone();
    if let Some(last) = knots.last_mut() {
        let joints = order.len();
        let turned = rotation_of(&last.values, joints).dot(&rotation_of(&first.values, joints)) < 0.0;
        let sign = if turned { -1.0 } else { 1.0 };
        let time = last.time;
        *last = Knot { time, ..first };
        last.values[joints + 3..].iter_mut().for_each(|q| *q *= sign);
        last.rates[joints + 3..].iter_mut().for_each(|q| *q *= sign);
    }
    Track::new(knots)
}

/// Angles and root at keyframes, the root seen from the travelling frame. Quaternions lie on one side of their
/// neighbours.
fn keyframe_knots(
    keyframes: &[Keyframe],
    start: f64,
    order: &[usize],
    travel: Option<&GroundTravel>,
) -> Vec<Knot> {
    let mut knots: Vec<Knot> = Vec::with_capacity(keyframes.len());
    let joints = order.len();
    for keyframe in keyframes {
        let time = keyframe.time - start;
        let (mut root, linear, angular) = root_in(travel, time, &keyframe.root);
        if let Some(last) = knots.last()
            && rotation_of(&last.values, joints).dot(root.rotation.quaternion()) < 0.0
        {
            root.rotation = UnitQuaternion::new_unchecked(-root.rotation.into_inner());
        }
        // q' = ω q / 2 with the angular velocity in the frame that q leads to.
        let turning = Quaternion::from_imag(angular) * root.rotation.quaternion() * 0.5;
        let mut rates: Vec<f64> = order.iter().map(|&joint| keyframe.velocities[joint]).collect();
        rates.extend(linear.iter());
        rates.extend([turning.w, turning.i, turning.j, turning.k]);
        knots.push(Knot { time, values: flattened(&keyframe.angles, order, &root), rates });
    }
    knots
}

/// Pose and velocities of a root seen from the travelling frame.
fn root_in(
    travel: Option<&GroundTravel>,
    time: f64,
    root: &RootMotion,
) -> (Isometry3<f64>, Vector3<f64>, Vector3<f64>) {
    let pose = isometry(root.position, root.orientation);
    let (linear, angular) = (Vector3::from(root.linear_velocity), Vector3::from(root.angular_velocity));
    let Some(travel) = travel else { return (pose, linear, angular) };
    let pose = travel.frame(time).inverse() * pose;
    let (linear, angular) = travel.relative_velocities(time, &pose.translation.vector, &linear, &angular);
    (pose, linear, angular)
}

/// Evenly spaced frames of `duration` seconds.
fn clip(
    poses: &Track,
    targets: &Track,
    joints: usize,
    duration: f64,
    fps: f64,
    travel: impl Fn(f64) -> Isometry3<f64>,
) -> MotionClip {
    let count = (duration * fps).round().max(2.0) as usize;
    let frame = |index: usize| {
        let time = duration * index as f64 / count as f64;
        let pose = poses.at(time).values;
        let Knot { values, rates, .. } = targets.at(time);
        let position = Vector3::from_column_slice(&pose[joints..joints + 3]);
        let rotation = UnitQuaternion::new_normalize(rotation_of(&pose, joints));
        MotionFrame {
            time,
            angles: pose[..joints].to_vec(),
            targets: values,
            target_rates: rates,
            travel: travel(time),
            root: Isometry3::from_parts(Translation3::from(position), rotation),
        }
    };
    MotionClip { frames: (0..=count).map(frame).collect() }
}

fn isometry(position: [f64; 3], [w, x, y, z]: [f64; 4]) -> Isometry3<f64> {
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(Point3::from(position).into(), rotation)
}
