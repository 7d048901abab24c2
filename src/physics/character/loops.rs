//! Joints that close loops: whether they can, and where they are on both links.

use std::collections::HashSet;

use nalgebra::Isometry3;

use super::bounds::{check_axis, check_lengths, unit};
use super::draft::{At, Diagnostics, DraftLoop};
use super::{JointKind, Link, Loop, LoopKind};

/// Greatest distance between the two ends of a loop as a document gives them, with all angles at zero, as a share of the distance
/// from the root to the farthest link or to the loop; and greatest angle, rad.
const DISTANCE: f64 = 3e-4;
const ANGLE: f64 = 1e-3;

/// Checks the numbers of a loop by itself.
pub fn check(closing: &DraftLoop, diagnostics: &mut Diagnostics) {
    for At { value, place } in std::iter::once(&closing.origin).chain(&closing.origin_in_second) {
        check_lengths(&value.translation.vector, "the origin", place, diagnostics);
    }
    if matches!(closing.kind, LoopKind::Revolute | LoopKind::Prismatic) {
        check_axis(&closing.axis, diagnostics);
    }
}

/// The loops over `links`, each with its frame on both of its links; faults where a loop cannot be.
pub fn close(drafts: Vec<DraftLoop>, links: &[Link], diagnostics: &mut Diagnostics) -> Vec<Loop> {
    let poses = zero_poses(links);
    let mut names = HashSet::new();
    let mut loops = Vec::with_capacity(drafts.len());
    for draft in drafts {
        if !names.insert(draft.name.value.clone()) {
            diagnostics
                .fault(draft.name.place.as_str(), format!("there is another loop {:?}", draft.name.value));
        }
        let mut find = |end: &At<String>| {
            let found = links.iter().position(|link| link.name == end.value);
            if found.is_none() {
                diagnostics.fault(end.place.as_str(), format!("the link {:?} does not exist", end.value));
            }
            found
        };
        let [first, second] = &draft.ends;
        let (Some(a), Some(b)) = (find(first), find(second)) else { continue };
        if rigid_root(links, a) == rigid_root(links, b) {
            let reason =
                format!("the links {:?} and {:?} are joined rigidly already", first.value, second.value);
            diagnostics.fault(second.place.as_str(), reason);
            continue;
        }
        let world = poses[a] * draft.origin.value;
        let frames = [draft.origin.value, poses[b].inverse() * world];
        let axis = unit(draft.axis.value);
        if let Some(At { value: given, place }) = &draft.origin_in_second {
            let apart = frames[1].inverse() * given;
            let distance = apart.translation.vector.norm();
            let angle = match draft.kind {
                LoopKind::Ball => 0.0,
                LoopKind::Revolute => (apart.rotation * axis).angle(&axis),
                LoopKind::Prismatic | LoopKind::Fixed => apart.rotation.angle(),
            };
            let size = poses.iter().map(|pose| pose.translation.vector.norm()).fold(0.0, f64::max);
            let greatest = DISTANCE * size.max(world.translation.vector.norm());
            if distance > greatest || angle > ANGLE {
                diagnostics.fault(
                    place.as_str(),
                    format!(
                        "with all angles at 0 the loop's ends on {:?} and {:?} are {distance:.3e} m and \
                         {angle:.3e} rad apart",
                        first.value, second.value
                    ),
                );
            }
        }
        loops.push(Loop { name: draft.name.value, kind: draft.kind, links: [a, b], frames, axis });
    }
    loops
}

/// The frames of all links in the root's, with all angles at zero.
fn zero_poses(links: &[Link]) -> Vec<Isometry3<f64>> {
    let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(links.len());
    for link in links {
        let pose =
            link.joint.as_ref().map_or(Isometry3::identity(), |joint| poses[joint.parent] * joint.origin);
        poses.push(pose);
    }
    poses
}

/// The link nearest to the root that `link` is joined to by fixed joints alone.
fn rigid_root(links: &[Link], mut link: usize) -> usize {
    while let Some(joint) = links[link].joint.as_ref().filter(|joint| joint.kind == JointKind::Fixed) {
        link = joint.parent;
    }
    link
}
