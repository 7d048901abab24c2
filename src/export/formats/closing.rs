//! Simulated poses brought together: a cycle made to end where it starts, an entry to end where the loop starts, the feet
//! that stand held, and what that took.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;

use super::feet::{Course, StandingFoot, Stretch};
use super::ground_travel::GroundTravel;
use super::skeleton::Skeleton;
use super::track::Track;
use gaitwright_physics::motion::{Motion, StanceTime};
use gaitwright_physics::scene::Ground;

/// What was adjusted in the simulated poses of a loop, and how its feet stand; nothing in a motion without such poses.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct LoopCertificate {
    /// The most that was added so that the loop ends where it starts.
    pub closed: PoseChange,
    /// The most that was changed so that feet stand still.
    pub held: PoseChange,
    /// Every link that stands on the ground; empty where the document does not tell.
    pub feet: Vec<StandingFoot>,
    /// The same of the entry, where its poses are simulated: where the document tells how the loop's feet stand.
    pub entry: Option<EntryCertificate>,
}

/// What was adjusted in the simulated poses of an entry, and how its feet stand.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EntryCertificate {
    /// The most that was added so that it ends where the loop starts.
    pub joined: PoseChange,
    /// The most that was changed so that feet stand still.
    pub held: PoseChange,
    /// Every link that stands on the ground in it; held are those that the loop holds.
    pub feet: Vec<StandingFoot>,
}

/// The most by which poses of a loop were changed anywhere.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct PoseChange {
    /// An angle, rad or m.
    pub angle: f64,
    /// The place of the root, m.
    pub translation: f64,
    /// The orientation of the root, rad.
    pub rotation: f64,
}

/// Times, s, and what there is then: angles, rad or m, place of the root, m, and its quaternion.
pub(super) type Samples = Vec<(f64, Vec<f64>)>;

/// A cycle of samples that ends where it starts.
pub(super) struct ClosedCycle {
    /// The last is a repetition of the first.
    samples: Samples,
    /// By what each value is multiplied from one cycle to the next, 1 or −1.
    repeat: Vec<f64>,
    /// The most that was added.
    added: PoseChange,
}

/// Samples of a cycle, made to end where they start by an ever greater share of what is missing.
pub(super) fn closed(mut samples: Samples) -> ClosedCycle {
    align(&mut samples);
    let last = samples.len() - 1;
    let width = samples[0].1.len();
    let joints = width - 7;
    // A root that rolled over once comes back with the other sign of its quaternion.
    let turned = rotation_of(&samples[0].1, joints).dot(&rotation_of(&samples[last].1, joints)) < 0.0;
    let mut repeat = vec![1.0; width];
    repeat[joints + 3..].fill(if turned { -1.0 } else { 1.0 });
    let wanted: Vec<f64> = samples[0].1.iter().zip(&repeat).map(|(value, repeat)| repeat * value).collect();
    let added = lead_to(&mut samples, &wanted);
    ClosedCycle { samples, repeat, added }
}

/// Has every quaternion lie on the side of the one before.
fn align(samples: &mut Samples) {
    for index in 1..samples.len() {
        let (before, after) = samples.split_at_mut(index);
        let (before, after) = (&before[index - 1].1, &mut after[0].1);
        let joints = before.len() - 7;
        if rotation_of(before, joints).dot(&rotation_of(after, joints)) < 0.0 {
            after[joints + 3..].iter_mut().for_each(|q| *q = -*q);
        }
    }
}

/// Has samples end in `wanted`, by an ever greater share of what is missing; what was added at the end.
fn lead_to(samples: &mut Samples, wanted: &[f64]) -> PoseChange {
    let last = samples.len() - 1;
    let joints = wanted.len() - 7;
    let missing: Vec<f64> =
        wanted.iter().zip(&samples[last].1).map(|(wanted, found)| wanted - found).collect();
    let (start, period) = (samples[0].0, samples[last].0 - samples[0].0);
    for (time, values) in samples {
        let part = (*time - start) / period;
        let share = part * part * (3.0 - 2.0 * part);
        values.iter_mut().zip(&missing).for_each(|(value, missing)| *value += share * missing);
    }
    let norm = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    PoseChange {
        angle: missing[..joints].iter().fold(0.0, |most: f64, missing| most.max(missing.abs())),
        translation: norm(&missing[joints..joints + 3]),
        // A quaternion turns by half the angle.
        rotation: 2.0 * norm(&missing[joints + 3..]),
    }
}

/// The curve through a closed cycle whose feet stand still where the document tells when they stand.
pub(super) fn standing(
    motion: &Motion,
    (skeleton, travel): (&Skeleton<'_>, &GroundTravel),
    closed: ClosedCycle,
) -> (Track, LoopCertificate) {
    let ClosedCycle { mut samples, repeat, added } = closed;
    let count = samples.len() - 1;
    let period = samples[count].0 - samples[0].0;
    let course = Course::Loop(travel, period);
    let (held, feet) =
        hold(&mut samples[..count], (skeleton, course), (&motion.stances, level(motion)), |_| true);
    (Track::closed(samples, &repeat), LoopCertificate { closed: added, held, feet, entry: None })
}

/// The curve through the samples of an entry, made to end in `first` of the loop, with the feet standing still that the loop
/// holds.
pub(super) fn entering(
    motion: &Motion,
    skeleton: &Skeleton<'_>,
    (mut samples, stances): (Samples, &[StanceTime]),
    (first, of_loop): (&[f64], &[StandingFoot]),
) -> (Track, EntryCertificate) {
    let last = samples.len() - 1;
    samples.push((samples[last].0, first.to_vec()));
    align(&mut samples);
    // On the side of the samples before, which is the same pose.
    let first = samples.pop().map(|(_, first)| first).unwrap_or_default();
    let joined = lead_to(&mut samples, &first);
    let may = |link: &str| of_loop.iter().any(|foot| foot.held && foot.link == link);
    let (held, feet) = hold(&mut samples, (skeleton, Course::Once), (stances, level(motion)), may);
    (Track::open(samples), EntryCertificate { joined, held, feet })
}

/// The height of the ground, m, where that is level everywhere.
pub(super) fn level(motion: &Motion) -> Option<f64> {
    match motion.scene.ground {
        Some(Ground::Plane { height }) if motion.scene.obstacles.is_empty() => Some(height),
        _ => None,
    }
}

/// Has the feet in samples stand still that `may`; the most that was changed, and how they stand.
fn hold(
    samples: &mut [(f64, Vec<f64>)],
    (skeleton, course): (&Skeleton<'_>, Course<'_>),
    (stances, ground): (&[StanceTime], Option<f64>),
    may: impl Fn(&str) -> bool,
) -> (PoseChange, Vec<StandingFoot>) {
    let joints = skeleton.joints.len();
    let root = |values: &[f64]| {
        let position = Vector3::from_column_slice(&values[joints..joints + 3]);
        Isometry3::from_parts(position.into(), UnitQuaternion::new_normalize(rotation_of(values, joints)))
    };
    let mut stretch = Stretch {
        skeleton,
        times: samples.iter().map(|(time, _)| *time).collect(),
        roots: samples.iter().map(|(_, values)| root(values)).collect(),
        angles: samples.iter().map(|(_, values)| values[..joints].to_vec()).collect(),
        course,
    };
    let feet = stretch.plant(stances, ground, may);
    let mut held = PoseChange::default();
    for ((_, values), (angles, moved)) in samples.iter_mut().zip(stretch.angles.iter().zip(&stretch.roots)) {
        let before = root(values);
        held.translation =
            held.translation.max((moved.translation.vector - before.translation.vector).norm());
        held.rotation = held.rotation.max(moved.rotation.angle_to(&before.rotation));
        for (value, angle) in values.iter_mut().zip(angles) {
            held.angle = held.angle.max((*value - angle).abs());
            *value = *angle;
        }
        // On the same side as the sample before.
        let q = moved.rotation;
        let sign = if rotation_of(values, joints).dot(q.quaternion()) < 0.0 { -1.0 } else { 1.0 };
        values[joints..joints + 3].copy_from_slice(moved.translation.vector.as_slice());
        values[joints + 3..].copy_from_slice(&[q.w, q.i, q.j, q.k].map(|part| sign * part));
    }
    (held, feet)
}

/// The quaternion behind the angles of as many joints and the place of the root.
pub(super) fn rotation_of(values: &[f64], joints: usize) -> Quaternion<f64> {
    let q = &values[joints + 3..];
    Quaternion::new(q[0], q[1], q[2], q[3])
}

/// Angles in the skeleton's order, then position and quaternion of the root.
pub(super) fn flattened(angles: &[f64], order: &[usize], root: &Isometry3<f64>) -> Vec<f64> {
    let q = root.rotation;
    let angles = order.iter().map(|&joint| angles[joint]);
    angles.chain(root.translation.vector.iter().copied()).chain([q.w, q.i, q.j, q.k]).collect()
}
