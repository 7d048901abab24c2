//! glTF 2.0 binary: the character as a node tree with its shapes, and its animations.
//!
//! The node of a link that a joint moves tells of it in `extras`: `joint` (its name), `kind` (`revolute` or `prismatic`),
//! `axis` (in the node's own frame) and `angle` (rad or m, in the pose that the nodes have without an animation), so that
//! a reader can bend the character as it likes. `extras` of a loop's animations hold its `certificate`: what was
//! adjusted, and how its feet stand.
//!
//! Key frames are joined linearly (quaternions on the shortest arc), which every program plays alike; the last of a
//! loop equals the first, seen from the travelling root node.

mod document;

use std::iter;

use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};
use serde::Serialize;

use super::closing::LoopCertificate;
use super::sampled::{MotionClip, MotionFrame, SampledMotion};
use super::skeleton::Skeleton;
use super::tessellation::DisplayMesh;
use super::unused::unused;
use super::up::y_up;
use crate::export::recording::limb_colors;
use document::{AnimationKeys, Document, Index, Node};
use gaitwright_physics::character::{Joint, JointKind, Link};
use gaitwright_physics::fault::InputError;

/// What `extras` of a link's node tell of the joint that moves it.
#[derive(Serialize)]
struct JointExtras<'a> {
    joint: &'a str,
    kind: &'static str,
    axis: [f64; 3],
    angle: f64,
}

impl<'a> JointExtras<'a> {
    fn new(joint: &'a Joint, angle: f64) -> Self {
        let kind = if joint.kind == JointKind::Prismatic { "prismatic" } else { "revolute" };
        Self { joint: &joint.name, kind, axis: joint.axis.into_inner().into(), angle }
    }
}

/// What `extras` of a loop's animations tell.
#[derive(Serialize)]
struct LoopExtras<'a> {
    certificate: &'a LoopCertificate,
}

/// The nodes that move: the travelling frame and every link.
struct Nodes {
    travel: Index<Node>,
    links: Vec<Index<Node>>,
}

/// The scene's one root node travels evenly over the ground (y up); below it stands a node that turns z up to y up,
/// and below that the root link with all others, each moving as it does in the travelling frame. So the animation
/// with root motion differs from the one in place by the root node alone. Without animations the character stands as
/// `first` starts, the first of the motions.
pub(super) fn write<'a>(
    first: &SampledMotion<'a>,
    others: &[SampledMotion<'a>],
    in_place: bool,
) -> Result<Vec<u8>, InputError> {
    let mut document = Document::default();
    let rest = &first.entry.as_ref().unwrap_or(&first.cycle).frames[0];
    let nodes = nodes(&mut document, &first.skeleton, &rest.root, &rest.angles);
    for sampled in iter::once(first).chain(others) {
        animations(&mut document, sampled, &nodes, in_place);
    }
    let character = &first.skeleton.character.name;
    document.finish(character).map_err(|error| InputError::impossible("", error.to_string()))
}

/// The character without a motion, as [`write`] lays it out: the root link at `root` over the ground, joints at `angles`,
/// rad or m in the order of the skeleton.
pub(super) fn write_pose(
    skeleton: &Skeleton<'_>,
    root: &Isometry3<f64>,
    angles: &[f64],
) -> Result<Vec<u8>, InputError> {
    let mut document = Document::default();
    nodes(&mut document, skeleton, root, angles);
    let character = &skeleton.character.name;
    document.finish(character).map_err(|error| InputError::impossible("", error.to_string()))
}

fn nodes(document: &mut Document, skeleton: &Skeleton<'_>, root: &Isometry3<f64>, angles: &[f64]) -> Nodes {
    let links = &skeleton.character.links;
    let mut indices: Vec<Option<Index<Node>>> = vec![None; links.len()];
    let colors = limb_colors(skeleton.character);
    // Children come after their parents, and a node is written once all that it carries is.
    for (index, link) in links.iter().enumerate().rev() {
        let local = local(skeleton, index, root, angles);
        let children = skeleton.children(index).filter_map(|child| indices[child]).collect();
        let mesh = mesh(document, link, colors[index].map(|part| f32::from(part) / 255.0));
        let node = document.node(&link.name, Some(&local), mesh, children);
        if let (Some(joint), Some(place)) = (&link.joint, skeleton.angle_of[index]) {
            document.describe(node, &JointExtras::new(joint, angles[place]));
        }
        indices[index] = Some(node);
    }
    let links: Vec<Index<Node>> = indices.into_iter().flatten().collect();
    let names: Vec<&str> = skeleton.character.links.iter().map(|link| &*link.name).collect();
    let turned = Isometry3::from_parts(Default::default(), y_up());
    let up =
        document.node(&unused("z_up", |name| names.contains(&name)), Some(&turned), None, vec![links[0]]);
    let travel = document.node(&unused("root_motion", |name| names.contains(&name)), None, None, vec![up]);
    document.scene(travel);
    Nodes { travel, links }
}

/// A link's frame in its parent's; the root link's in the travelling frame.
fn local(skeleton: &Skeleton<'_>, link: usize, root: &Isometry3<f64>, angles: &[f64]) -> Isometry3<f64> {
    if link == 0 { *root } else { skeleton.local(link, angles) }
}

/// The shapes of a link, those of one colour together.
fn mesh(document: &mut Document, link: &Link, fallback: [f32; 4]) -> Option<Index<document::Mesh>> {
    let shapes = if link.visuals.is_empty() { &link.collisions } else { &link.visuals };
    let mut parts: Vec<([f32; 4], DisplayMesh)> = Vec::new();
    for placed in shapes {
        let color = placed.color.map_or(fallback, |color| color.map(|part| part.clamp(0.0, 1.0)));
        let part = match parts.iter().position(|(other, _)| *other == color) {
            Some(part) => part,
            None => {
                parts.push((color, DisplayMesh::default()));
                parts.len() - 1
            }
        };
        parts[part].1.add(&placed.shape, &placed.pose);
    }
    parts.retain(|(_, mesh)| !mesh.indices.is_empty());
    document.mesh(&link.name, &parts)
}

/// The animations of one motion: the loop with root motion, the loop in place, and the entry.
fn animations(document: &mut Document, sampled: &SampledMotion<'_>, nodes: &Nodes, in_place: bool) {
    let SampledMotion { skeleton, entry, cycle, name, certificate } = sampled;
    let extras = LoopExtras { certificate };
    if !in_place {
        animation(document, skeleton, nodes, (name, cycle), true).finish(Some(&extras));
    }
    animation(document, skeleton, nodes, (&format!("{name}_in_place"), cycle), false).finish(Some(&extras));
    if let Some(entry) = entry {
        animation(document, skeleton, nodes, (&format!("{name}_entry"), entry), false)
            .finish(None::<&LoopExtras<'_>>);
    }
}

fn animation<'a>(
    document: &'a mut Document,
    skeleton: &Skeleton<'_>,
    nodes: &Nodes,
    (name, clip): (&str, &MotionClip),
    travels: bool,
) -> AnimationKeys<'a> {
    let mut animation = document.animation(name, clip.frames.iter().map(|frame| frame.time as f32));
    if travels {
        let turned = |frame: &MotionFrame| {
            Isometry3::from_parts(
                (y_up() * frame.travel.translation.vector).into(),
                y_up() * frame.travel.rotation * y_up().inverse(),
            )
        };
        let poses: Vec<Isometry3<f64>> = clip.frames.iter().map(turned).collect();
        animation.translation(nodes.travel, &positions(&poses));
        animation.rotation(nodes.travel, &rotations(&poses));
    }
    for (link, &node) in nodes.links.iter().enumerate() {
        let moves = link == 0 || skeleton.angle_of[link].is_some();
        if !moves {
            continue;
        }
        let poses: Vec<Isometry3<f64>> =
            clip.frames.iter().map(|frame| local(skeleton, link, &frame.root, &frame.angles)).collect();
        if link == 0 || !skeleton.turns(link) {
            animation.translation(node, &positions(&poses));
        }
        if link == 0 || skeleton.turns(link) {
            animation.rotation(node, &rotations(&poses));
        }
    }
    animation
}

fn positions(poses: &[Isometry3<f64>]) -> Vec<[f32; 3]> {
    poses.iter().map(|pose| Vector3::cast::<f32>(pose.translation.vector).into()).collect()
}

/// Quaternions x, y, z, w, each on the side of the one before it.
fn rotations(poses: &[Isometry3<f64>]) -> Vec<[f32; 4]> {
    let mut before: Option<UnitQuaternion<f64>> = None;
    let one = |pose: &Isometry3<f64>| {
        let mut q = pose.rotation;
        if before.is_some_and(|before| before.dot(&q) < 0.0) {
            q = UnitQuaternion::new_unchecked(-q.into_inner());
        }
        before = Some(q);
        let q: Quaternion<f32> = q.into_inner().cast();
        [q.i, q.j, q.k, q.w]
    };
    poses.iter().map(one).collect()
}
