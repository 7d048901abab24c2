//! A simulated cycle as a loop: made to end where it starts, its standing feet held, and what that took.

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;

use super::feet::{Cycle, StandingFoot};
use super::ground_travel::GroundTravel;
use super::skeleton::Skeleton;
use super::track::Track;
use gaitwright_physics::motion::Motion;
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

/// A cycle of samples that ends where it starts.
pub(super) struct ClosedCycle {
    /// Time and values, the last a repetition of the first.
    samples: Vec<(f64, Vec<f64>)>,
    /// By what each value is multiplied from one cycle to the next, 1 or −1.
    repeat: Vec<f64>,
    /// The most that was added.
    added: PoseChange,
}

/// Samples of a cycle, made to end where they start by an ever greater share of what is missing.
pub(super) fn closed(mut samples: Vec<(f64, Vec<f64>)>) -> ClosedCycle {
    let last = samples.len() - 1;
    let width = samples[0].1.len();
    let joints = width - 7;
    for index in 1..samples.len() {
        let (before, after) = samples.split_at_mut(index);
        let (before, after) = (&before[index - 1].1, &mut after[0].1);
        if rotation_of(before, joints).dot(&rotation_of(after, joints)) < 0.0 {
            after[joints + 3..].iter_mut().for_each(|q| *q = -*q);
        }
    }
    // A root that rolled over once comes back with the other sign of its quaternion.
    let turned = rotation_of(&samples[0].1, joints).dot(&rotation_of(&samples[last].1, joints)) < 0.0;
    let mut repeat = vec![1.0; width];
    repeat[joints + 3..].fill(if turned { -1.0 } else { 1.0 });
    let missing: Vec<f64> =
        (0..width).map(|at| repeat[at] * samples[0].1[at] - samples[last].1[at]).collect();
    let (start, period) = (samples[0].0, samples[last].0 - samples[0].0);
    for (time, values) in &mut samples {
        let part = (*time - start) / period;
        let share = part * part * (3.0 - 2.0 * part);
        values.iter_mut().zip(&missing).for_each(|(value, missing)| *value += share * missing);
    }
    let norm = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let added = PoseChange {
        angle: missing[..joints].iter().fold(0.0, |most: f64, missing| most.max(missing.abs())),
        translation: norm(&missing[joints..joints + 3]),
        // A quaternion turns by half the angle.
        rotation: 2.0 * norm(&missing[joints + 3..]),
    };
    ClosedCycle { samples, repeat, added }
}

/// The curve through a closed cycle whose feet stand still where the document tells when they stand.
pub(super) fn standing(
    motion: &Motion,
    (skeleton, travel): (&Skeleton<'_>, &GroundTravel),
    closed: ClosedCycle,
) -> (Track, LoopCertificate) {
    let ClosedCycle { mut samples, repeat, added } = closed;
    let (joints, count) = (skeleton.joints.len(), samples.len() - 1);
    let root = |values: &[f64]| {
        let position = Vector3::from_column_slice(&values[joints..joints + 3]);
        Isometry3::from_parts(position.into(), UnitQuaternion::new_normalize(rotation_of(values, joints)))
    };
    let mut cycle = Cycle {
        skeleton,
        travel,
        times: samples[..count].iter().map(|(time, _)| *time).collect(),
        period: samples[count].0 - samples[0].0,
        roots: samples[..count].iter().map(|(_, values)| root(values)).collect(),
        angles: samples[..count].iter().map(|(_, values)| values[..joints].to_vec()).collect(),
    };
    let ground = match motion.scene.ground {
        Some(Ground::Plane { height }) if motion.scene.obstacles.is_empty() => Some(height),
        _ => None,
    };
    let feet = cycle.plant(&motion.stances, ground);
    let mut held = PoseChange::default();
    for ((_, values), (angles, moved)) in samples.iter_mut().zip(cycle.angles.iter().zip(&cycle.roots)) {
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
    (Track::closed(samples, &repeat), LoopCertificate { closed: added, held, feet })
}

/// The quaternion behind the angles of as many joints and the place of the root.
pub(super) fn rotation_of(values: &[f64], joints: usize) -> Quaternion<f64> {
    let q = &values[joints + 3..];
    Quaternion::new(q[0], q[1], q[2], q[3])
}
