//! Checks the tree and the numbers of a draft and builds the character from it, whatever the document's format.

use std::collections::{HashMap, HashSet};

use nalgebra::Matrix3;

use super::bounds::{LENGTH, check_axis, check_lengths, shape_fault, unit};
use super::digest::Digests;
use super::draft::{At, Diagnostics, Draft, DraftInertial, DraftJoint, DraftLink};
use super::size::SHAPES;
use super::{
    About, Character, Inertial, Joint, JointKind, Limits, Link, NoteKind, Options, Placed, Reading, inertia,
    loops, stand_in, units, weld::weld,
};
use crate::fault::{Fault, InputError};

/// Greatest mass, kg.
const MASS: f64 = 1e12;
/// Greatest entry of an inertia, kg m².
const INERTIA: f64 = MASS * LENGTH * LENGTH;

/// Checks `draft` and makes it a character.
pub fn build(mut draft: Draft, digests: Digests, options: Options) -> Result<Reading, InputError> {
    let shapes: usize = draft.links.iter().map(|link| link.collisions.len()).sum();
    if shapes > SHAPES {
        let reason = format!("the character has {shapes} collision shapes; at most {SHAPES} are read");
        return Err(InputError::TooLarge(Fault::new("", reason)));
    }
    let diagnostics = &mut draft.diagnostics;
    for link in &draft.links {
        check_link(link, diagnostics);
    }
    for joint in &draft.joints {
        check_joint(joint, diagnostics);
        units::tell_degrees(joint, diagnostics);
    }
    let order = order(&draft.links, &draft.joints, draft.complete, diagnostics);
    check_standing(draft.standing.as_deref(), &draft.joints, diagnostics);
    for closing in &draft.loops {
        loops::check(closing, diagnostics);
    }
    let masses = draft.links.iter().filter_map(|link| link.inertial.as_ref()).map(|it| it.value.mass);
    let total: f64 = masses.sum();
    if diagnostics.faults.is_empty() && total <= 0.0 {
        diagnostics.fault("", "no link has a mass (in URDF `<inertial>`, in JSON `mass` or `density`)");
    }
    if !diagnostics.faults.is_empty() {
        return Err(InputError::Impossible(std::mem::take(&mut diagnostics.faults)));
    }
    let mut diagnostics = std::mem::take(&mut draft.diagnostics);
    for joint in &mut draft.joints {
        weld(joint, &mut diagnostics);
    }
    let (name, standing) = (std::mem::take(&mut draft.name), draft.standing.take());
    let drafted_loops = std::mem::take(&mut draft.loops);
    let Assembled { mut links, places, missing } = assemble(draft, &order, &mut diagnostics);
    let loops = loops::close(drafted_loops, &links, &mut diagnostics);
    if !diagnostics.faults.is_empty() {
        return Err(InputError::Impossible(diagnostics.faults));
    }
    units::tell_millimetres(&links, &places, &mut diagnostics);
    inertia::repair_all(&mut links, &places, &mut diagnostics);
    stand_in::add(&mut links, &missing, &mut diagnostics);
    if options.strict {
        let doubts = diagnostics.notes.iter().filter(|note| note.value.kind != NoteKind::Ignored);
        let faults: Vec<_> =
            doubts.map(|note| Fault::new(note.place.as_str(), note.value.message.as_str())).collect();
        if !faults.is_empty() {
            return Err(InputError::Impossible(faults));
        }
    }
    let standing = standing.map(|mut angles| {
        let rank =
            |name: &str| links.iter().position(|link| link.joint.as_ref().is_some_and(|it| it.name == name));
        // Those of joints that are fixed there need not be said.
        angles.retain(|(name, _)| {
            links
                .iter()
                .filter_map(|link| link.joint.as_ref())
                .any(|joint| joint.name == name.value && joint.kind != JointKind::Fixed)
        });
        angles.sort_by_key(|(name, _)| rank(&name.value));
        angles.into_iter().map(|(name, angle)| (name.value, angle)).collect()
    });
    Ok(Reading {
        character: Character {
            name,
            links,
            loops,
            standing,
            digest: digests.whole,
            embedded_digest: digests.embedded,
        },
        notes: diagnostics.notes.into_iter().map(|note| note.value).collect(),
    })
}

/// How links are joined.
struct Joined {
    /// The joint that carries each link, and the link on which that sits.
    carrier: Vec<Option<(usize, usize)>>,
    /// What each link carries, in the order of the joints.
    children: Vec<Vec<usize>>,
}

/// The links in depth-first order of the joints, parents before children, each with the joint that
/// carries it; faults when they do not form one tree.
fn order(
    links: &[DraftLink],
    joints: &[DraftJoint],
    complete: bool,
    diagnostics: &mut Diagnostics,
) -> Vec<(usize, Option<usize>)> {
    let before = diagnostics.faults.len();
    let Joined { carrier, children } = joined(links, joints, diagnostics);
    if links.is_empty() {
        diagnostics.fault("", "there is no link");
    }
    // Where links or joints are missing, further faults would only be consequences of that.
    if diagnostics.faults.len() > before || !complete {
        return Vec::new();
    }
    let roots: Vec<usize> = (0..links.len()).filter(|link| carrier[*link].is_none()).collect();
    for extra in roots.iter().skip(1) {
        let names = (&links[roots[0]].name.value, &links[*extra].name);
        let reason = format!(
            "the links {:?} and {:?} both have no parent; one root is needed",
            names.0, names.1.value
        );
        diagnostics.fault(names.1.place.as_str(), reason);
    }
    let mut order = Vec::with_capacity(links.len());
    let mut reached = vec![false; links.len()];
    let mut stack = roots;
    while let Some(link) = stack.pop() {
        reached[link] = true;
        order.push((link, carrier[link].map(|(joint, _)| joint)));
        stack.extend(children[link].iter().rev());
    }
    tell_cycles(links, &carrier, reached, diagnostics);
    order
}

/// Which link carries which; faults where a name stands twice, an end does not exist, or a link has two parents.
fn joined(links: &[DraftLink], joints: &[DraftJoint], diagnostics: &mut Diagnostics) -> Joined {
    let mut index = HashMap::new();
    for (number, link) in links.iter().enumerate() {
        if index.insert(link.name.value.as_str(), number).is_some() {
            diagnostics
                .fault(link.name.place.as_str(), format!("there is another link {:?}", link.name.value));
        }
    }
    let mut names = HashSet::new();
    let mut carrier: Vec<Option<(usize, usize)>> = vec![None; links.len()];
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
    for (number, joint) in joints.iter().enumerate() {
        if !names.insert(joint.name.value.as_str()) {
            diagnostics
                .fault(joint.name.place.as_str(), format!("there is another joint {:?}", joint.name.value));
        }
        let mut find = |end: &At<String>, what: &str| {
            let found = index.get(end.value.as_str()).copied();
            if found.is_none() {
                diagnostics
                    .fault(end.place.as_str(), format!("the {what} link {:?} does not exist", end.value));
            }
            found
        };
        let (parent, child) = (find(&joint.parent, "parent"), find(&joint.child, "child"));
        let (Some(parent), Some(child)) = (parent, child) else { continue };
        if let Some((other, _)) = carrier[child] {
            let other = &joints[other].name.value;
            let reason = format!("the link {:?} is the child of joint {other:?} already", joint.child.value);
            diagnostics.fault(joint.child.place.as_str(), reason);
            continue;
        }
        carrier[child] = Some((number, parent));
        children[parent].push(child);
    }
    Joined { carrier, children }
}

/// A link that no root leads to is on a cycle or below one. Each cycle is told once.
fn tell_cycles(
    links: &[DraftLink],
    carrier: &[Option<(usize, usize)>],
    mut reached: Vec<bool>,
    diagnostics: &mut Diagnostics,
) {
    for link in 0..links.len() {
        let mut cycle = Vec::new();
        let mut at = link;
        while !reached[at] {
            reached[at] = true;
            cycle.push(links[at].name.value.as_str());
            at = carrier[at].map_or(at, |(_, parent)| parent);
        }
        if let Some(start) = cycle.iter().position(|name| *name == links[at].name.value) {
            let names = cycle[start..].join("\", \"");
            let reason = match &cycle[start..] {
                [alone] => format!("a joint joins the link {alone:?} to itself"),
                _ => format!(
                    "the links \"{names}\" are joined in a cycle; joints make a tree, and `loops` of a JSON document close it"
                ),
            };
            diagnostics.fault(links[at].name.place.as_str(), reason);
        }
    }
}

fn check_link(link: &DraftLink, diagnostics: &mut Diagnostics) {
    if let Some(At { value, place }) = &link.inertial {
        let DraftInertial { mass, center_of_mass, inertia } = value;
        if !(0.0..=MASS).contains(mass) {
            diagnostics
                .fault(place.as_str(), format!("the mass is {mass:?} kg; it must be from 0 to {MASS:e} kg"));
        }
        check_lengths(&center_of_mass.coords, "the centre of mass", place, diagnostics);
        let inertia = inertia.unwrap_or_default();
        if !inertia.iter().all(|entry| entry.abs() <= INERTIA) {
            diagnostics.fault(place.as_str(), format!("the inertia must be at most {INERTIA:e} kg m²"));
        }
    }
    for fault in link.surface.value.faults() {
        diagnostics.fault(link.surface.place.as_str(), fault.reason);
    }
    for At { value, place } in &link.collisions {
        check_lengths(&value.pose.translation.vector, "the position", place, diagnostics);
        if let Some((_, reason)) = shape_fault(&value.shape) {
            diagnostics.fault(place.as_str(), reason);
        }
    }
    for At { value, place } in &link.visuals {
        check_lengths(&value.pose.translation.vector, "the position", place, diagnostics);
    }
}

fn check_joint(joint: &DraftJoint, diagnostics: &mut Diagnostics) {
    check_lengths(&joint.origin.value.translation.vector, "the origin", &joint.origin.place, diagnostics);
    if joint.kind == JointKind::Fixed {
        return;
    }
    check_axis(&joint.axis, diagnostics);
    if let Some(At { value: [lower, upper], place }) = &joint.limits
        && !(lower.is_finite() && upper.is_finite() && lower <= upper)
    {
        let reason = format!("the lower limit {lower} must not be greater than the upper limit {upper}");
        diagnostics.fault(place.as_str(), reason);
    }
    for (bound, what) in [(&joint.effort, "effort"), (&joint.velocity, "velocity")] {
        if let Some(At { value, place }) = bound
            && !(value.is_finite() && *value > 0.0)
        {
            diagnostics.fault(place.as_str(), format!("the greatest {what} is {value}; it must be positive"));
        }
    }
    let losses = [(&joint.damping, "damping"), (&joint.friction, "friction"), (&joint.armature, "armature")];
    for (At { value, place }, what) in losses {
        if !(value.is_finite() && *value >= 0.0) {
            diagnostics.fault(place.as_str(), format!("the {what} is {value}; it must not be negative"));
        }
    }
}

fn check_standing(
    standing: Option<&[(At<String>, f64)]>,
    joints: &[DraftJoint],
    diagnostics: &mut Diagnostics,
) {
    let by_name: HashMap<_, _> = joints.iter().map(|joint| (joint.name.value.as_str(), joint)).collect();
    for (At { value: name, place }, angle) in standing.unwrap_or_default() {
        let Some(joint) = by_name.get(name.as_str()) else {
            diagnostics.fault(place.as_str(), format!("there is no joint {name:?}"));
            continue;
        };
        if joint.kind == JointKind::Fixed {
            diagnostics.fault(place.as_str(), format!("the joint {name:?} is fixed"));
        }
        let [lower, upper] = joint.limits.as_ref().map_or([f64::NEG_INFINITY, f64::INFINITY], |it| it.value);
        if !(angle.is_finite() && (lower..=upper).contains(angle)) {
            diagnostics.fault(
                place.as_str(),
                format!("{angle} is outside of the joint's range, {lower} to {upper}"),
            );
        }
    }
}

/// Links in their final order, with what the later steps need to know of each.
struct Assembled {
    links: Vec<Link>,
    places: Vec<String>,
    missing: Vec<Vec<At<String>>>,
}

fn assemble(draft: Draft, order: &[(usize, Option<usize>)], diagnostics: &mut Diagnostics) -> Assembled {
    let mut position = HashMap::new();
    for (place, (link, _)) in order.iter().enumerate() {
        position.insert(draft.links[*link].name.value.clone(), place);
    }
    let mut drafts: Vec<Option<DraftLink>> = draft.links.into_iter().map(Some).collect();
    let mut joints: Vec<Option<DraftJoint>> = draft.joints.into_iter().map(Some).collect();
    let mut assembled = Assembled { links: Vec::new(), places: Vec::new(), missing: Vec::new() };
    for (link, joint) in order {
        let Some(link) = drafts[*link].take() else { continue };
        let joint = joint.and_then(|joint| joints[joint].take()).map(|joint| {
            let parent = position.get(&joint.parent.value).copied().unwrap_or_default();
            finished_joint(joint, parent)
        });
        let visuals = visuals(&link, diagnostics);
        assembled.missing.push(link.missing_collisions);
        assembled.places.push(link.name.place);
        assembled.links.push(Link {
            name: link.name.value,
            joint,
            inertial: link.inertial.and_then(|it| finished_inertial(it.value)),
            collisions: link.collisions.into_iter().map(|shape| shape.value).collect(),
            surface: link.surface.value,
            visuals,
        });
    }
    assembled
}

/// The visuals that can be shown; none where one is missing and collision shapes can be shown instead.
fn visuals(link: &DraftLink, diagnostics: &mut Diagnostics) -> Vec<Placed> {
    let about = About::Link(link.name.value.clone());
    let solid = !link.collisions.is_empty() || !link.missing_collisions.is_empty();
    if let Some(At { place, .. }) = link.missing_visuals.first() {
        let why =
            link.missing_visuals.iter().map(|missing| missing.value.as_str()).collect::<Vec<_>>().join(", ");
        let instead =
            if solid { "the collision shapes are shown instead" } else { "nothing is shown for it" };
        diagnostics.note(place.as_str(), about.clone(), NoteKind::Ignored, format!("{why}; {instead}"));
        if solid {
            return Vec::new();
        }
    }
    let mut shown = Vec::new();
    for At { value, place } in &link.visuals {
        match shape_fault(&value.shape) {
            Some((_, reason)) => {
                let message = format!("a visual is left out: {reason}");
                diagnostics.note(place.as_str(), about.clone(), NoteKind::Ignored, message);
            }
            None => shown.push(value.clone()),
        }
    }
    shown
}

/// `None` for a link without mass, unless its own inertia is positive definite. A mass without an inertia is taken as
/// a point mass.
fn finished_inertial(draft: DraftInertial) -> Option<Inertial> {
    let inertia = draft.inertia.map_or_else(Matrix3::zeros, |given| (given + given.transpose()) / 2.0);
    let physical = draft.mass > 0.0 || inertia.symmetric_eigenvalues().min() > 0.0;
    physical.then_some(Inertial { mass: draft.mass, center_of_mass: draft.center_of_mass, inertia })
}

fn finished_joint(joint: DraftJoint, parent: usize) -> Joint {
    Joint {
        name: joint.name.value,
        parent,
        kind: joint.kind,
        origin: joint.origin.value,
        axis: unit(joint.axis.value),
        limits: joint.limits.map(|At { value: [lower, upper], .. }| Limits { lower, upper }),
        driven: joint.driven,
        effort: joint.effort.map(|effort| effort.value),
        velocity: joint.velocity.map(|velocity| velocity.value),
        damping: joint.damping.value,
        friction: joint.friction.value,
        armature: joint.armature.value,
    }
}
