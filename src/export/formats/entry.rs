//! The poses of an entry. A motion document has its targets; where they take the character, and when its feet stand, comes of
//! simulating it again.

use nalgebra::Isometry3;

use super::closing::{Samples, flattened};
use super::feet::{LIFTED, sole};
use super::skeleton::Skeleton;
use crate::export::Replay;
use gaitwright_learning::gait::Footing;
use gaitwright_physics::fault::InputError;
use gaitwright_physics::motion::{Motion, StanceTime};
use gaitwright_physics::playback::Sample;

/// Time between two samples, s, or as near to it as whole steps are.
const SAMPLED: f64 = 0.005;

/// Plays a motion as far as its loop: the poses, the last at the start of the loop, and when feet stand: those that carry
/// something, and from then on until they are lifted off the `ground` where that is level (m). `None` where the character falls on the way, or the simulation cannot go on.
///
/// # Errors
///
/// When the motion cannot be simulated.
pub(super) fn played(
    motion: &Motion,
    skeleton: &Skeleton<'_>,
    ground: Option<f64>,
) -> Result<Option<(Samples, Vec<StanceTime>)>, InputError> {
    let replay = Replay::new(motion, skeleton.character)?;
    let (check, lead) = (replay.check(), replay.player().lead());
    let trace = check.play(lead + 2.0 * SAMPLED, SAMPLED, &|| false)?;
    let detection = check.detection()?;
    let names = replay.joint_names();
    let order: Vec<usize> =
        skeleton.joints.iter().filter_map(|name| names.iter().position(|own| own == name)).collect();
    // One that falls on the lead's very end, too: the loop does not begin there.
    let after = trace.samples.partition_point(|sample| sample.time < lead);
    if trace.fell_at.is_some() || trace.failure.is_some() || after < 2 || after >= trace.samples.len() {
        return Ok(None);
    }
    let pose = |sample: &Sample| {
        let root = Isometry3::from_parts(sample.root.position.into(), sample.root.orientation);
        flattened(&sample.angles, &order, &root)
    };
    let mut samples: Samples =
        trace.samples[..after].iter().map(|sample| (sample.time, pose(sample))).collect();
    let (one, other) = (&trace.samples[after - 1], &trace.samples[after]);
    let share = (lead - one.time) / (other.time - one.time);
    let mix = |(a, b): (f64, f64)| a + share * (b - a);
    let last: Vec<f64> = pose(one).into_iter().zip(pose(other)).map(mix).collect();
    // Two samples that all but coincide have no rate between them.
    if share < 0.5 {
        samples.pop();
    }
    samples.push((lead, last));

    let links = &skeleton.character.links;
    let standing = links
        .iter()
        .enumerate()
        .filter(|(_, link)| motion.stances.iter().any(|stance| stance.link == link.name));
    let stances = standing.flat_map(|(index, link)| {
        let mut stands = Footing::detect(&trace, &[index], detection).stance;
        // Nothing is known of the loads before the first step.
        stands[0] = stands[1];
        let lifted = |sample: &Sample| {
            let height =
                sole(link, &sample.link_poses[index]).zip(ground).map(|(sole, ground)| sole.z - ground);
            height.is_none_or(|height| height > LIFTED)
        };
        let mut found: Vec<StanceTime> = Vec::new();
        let mut left = true;
        for (sample, stands) in trace.samples.iter().zip(stands) {
            left |= !stands && lifted(sample);
            if stands && left {
                let (start, end) = (sample.time, sample.time);
                found.push(StanceTime { link: link.name.clone(), start, end });
            }
            left &= !stands;
            if let Some(stance) = found.last_mut().filter(|_| !left) {
                stance.end = sample.time;
            }
        }
        found
    });
    Ok(Some((samples, stances.collect())))
}
